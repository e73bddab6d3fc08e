"""Bias of the pictures of steps: how far they are from pictures that Mitsuba renders along the same paths.

Steps see light from lamp to plate to camera, by fixed samples, and few lights in place of an extended one.
Light from face to face, which no step sees, is left out of the rendered pictures, too. What is measured is
what the model of pictures lacks, with the `FIXED_DIRECTIONS` lights of `FixedSamples` and sharp mirror
images. Steps of gauss-newton take 16 lights and average mirror images over `STEP_BLUR`; a bias that original
and result have in common cancels in the change that they see.
"""

import math
from dataclasses import replace

import numpy as np

from relief.ground.arrays import Array
from relief.ground.formatting import number
from relief.ground.progress import stage
from visual.backend import variants
from visual.backend.mitsuba import mi
from visual.backend.user_settings import user_settings_kept
from visual.exact.discontinuities import EdgeSamples
from visual.exact.render import RenderSettings, scene_pictures
from visual.lights.quadrature import kind_of
from visual.looks import EXACT, FIXED_DIRECTIONS, FixedSamples, look_model
from visual.scene import Scene

SIDE, SAMPLES, FEWEST_SAMPLES = 128, 16, 4
"""Root of a number of pixels, samples for each of them, and least samples of a pixel. The noise of a mean
square bias is about the variance of a pixel over the root of the pixels. By these samples squares of gravel
in the scenes `studio`, `evening` and `in-hand` are off by up to (2.2 %)², a third of (5 %)² - (3 %)². More
pixels have fewer samples for the same noise, fewer pixels more samples at the same cost."""
ROUNDS = 3
"""Most rounds of rendered pictures: each but the first doubles their samples."""
LINE = 0.04
"""Bias from which a line says so, a share of the mean radiance: between 3 %, where none may, and 5 %, where
one must, about the root of the mean of both squares."""


def pictures_of_steps(scene: Scene, look: str, heights: Array, seed: int = 0) -> Array:
    """Pictures of a relief by which the steps of a descent see it, at the film's resolution.

    Args:
        scene: of the pictures.
        look: name of `visual.looks.LOOKS`.
        heights: (rows, cols) mm.
        seed: of the samples in each pixel; the lights that represent an extended one are always the same.

    Returns:
        (2, conditions, rows, cols) radiance: twice, with samples of their own; a look without samples has the
        same pictures twice.

    Raises:
        InputError: the look has no pictures of the scene with gradients.
    """
    strata = math.ceil(math.sqrt(_samples(scene)))

    def pictures(number: int) -> Array:
        # Edges serve derivatives alone, and none is wanted.
        views = scene.look(look).views(FixedSamples(None, number, strata, EdgeSamples(1, 1)))
        return np.concatenate([view.evaluate(heights, jacobian=False).pictures for view in views])

    if look_model(look).sampled:
        return np.stack([pictures(number) for number in _seeds(seed)])
    # From above the fast look has finer pixels for steps, whose means its pictures are.
    overhead = scene.needs.top_view == (True,)
    one = np.asarray(scene.render(heights, model=look)) if overhead else pictures(seed)
    return np.stack([one, one])


@user_settings_kept
@stage("comparing the pictures of steps")
def step_bias(
    scene: Scene, look: str, heights: Array | None = None, seed: int = 0, steps: Array | None = None
) -> Array:
    """Root mean square difference of the pictures of steps from rendered ones, free of the noise of both.

    Two pictures of each kind have random numbers of their own, so that the noise has no part in the mean
    product of the two differences.

    Args:
        scene, look: as of `pictures_of_steps`.
        heights: (rows, cols) mm; default the scene's own.
        seed: of the random numbers.
        steps: the `pictures_of_steps`, if they exist already.

    Returns:
        (conditions,) shares of the mean radiance over the pixels that show the plate; 0 for a black picture,
        and where the mean product is negative, which is noise.

    Raises:
        InputError: as `pictures_of_steps`, or a camera does not see the plate.
    """
    relief = scene.heights if heights is None else heights
    steps = pictures_of_steps(scene, look, relief, seed) if steps is None else steps
    weights, rendered, samples = scene.plate_weights(), np.zeros_like(steps), 0
    for round_number in range(ROUNDS):
        added = samples or _samples(scene)
        pictures = [_direct_pictures(scene, relief, added, one) for one in _seeds(seed, round_number)]
        samples += added
        rendered += added / samples * (np.stack(pictures) - rendered)
        square, doubtful = _mean_square(steps, rendered, weights)
        if not doubtful:
            break
    return np.sqrt(np.maximum(square, 0.0))


def bias_line(scene: Scene, look: str, bias: Array) -> str | None:
    """The line about a `step_bias` (conditions,): which conditions, how much, why and what to do; or None."""
    worst, count = int(np.argmax(bias)), np.count_nonzero(bias >= LINE)
    if count == 0:
        return None
    reason, remedy = reason_of(scene, look)
    others = f", and {count - 1} more of {len(bias)} conditions differ by {100.0 * LINE:g} % or more"
    percent = f"{number(100.0 * bias[worst], 2)} %{others if count > 1 else ''}"
    return (
        f"{scene.file}: {scene.conditions[worst]}: the pictures by which steps steer differ from rendered "
        f"ones by {percent}; likely {reason}; {remedy}, or trust the verified change alone"
    )


def reason_of(scene: Scene, look: str) -> tuple[str, str]:
    """Why the pictures of steps are likely to differ, and what to do about it."""
    if look != EXACT:
        return f"the look {look} approximates shadows and highlights", f'take look.model = "{EXACT}"'
    lights = (*scene.needs.alone, *scene.needs.around)
    if not any(kind_of(light).met_by_chance for light in lights):
        return "material and relief vary more finely than their samples", "take a smoother texture"
    stand = f"the {FIXED_DIRECTIONS} lights that stand for an extended light"
    if scene.description.plate.blended:
        return (
            "Mitsuba's own pictures of a blend of unlike materials are too dark",
            "take one of its materials",
        )
    if scene.needs.matte:
        return f"shadows of {stand} are sharp", "take a smaller or a directional light"
    remedy = "take a rougher material (alpha), or a directional or point light"
    # Narrow highlights are sampled, by few directions; a broad one may be narrower than the lights' gaps.
    return f"a highlight has few samples, or shadows of {stand} are sharp", remedy


def _mean_square(steps: Array, rendered: Array, weights: Array) -> tuple[Array, bool]:
    """Squares (conditions,) of the bias, and whether more rendered samples may move one across the line."""
    level = (weights * rendered.mean(0)).mean((1, 2))
    unit = np.divide(1.0, level, out=np.zeros_like(level), where=level > 0.0)
    products = weights * np.prod(steps - rendered, axis=0) * np.square(unit)[:, None, None]
    square, error = products.mean((1, 2)), products.std((1, 2)) / math.sqrt(products[0].size)
    noise, of_steps = ((weights * np.square(two[1] - two[0])).mean((1, 2)) for two in (rendered, steps))
    return square, bool(np.any((np.abs(square - LINE**2) < 2.0 * error) & (noise > 2.0 * of_steps)))


def _seeds(seed: int, number: int = 0) -> list[int]:
    """Seeds of the two pictures of each kind in the round of this number."""
    return [int(one) for one in np.random.SeedSequence((seed, number)).generate_state(2)]


def _samples(scene: Scene) -> int:
    """Samples a pixel of each picture of steps, and of the first rendered ones."""
    ratio = SIDE / math.sqrt(math.prod(scene.resolution))
    return max(FEWEST_SAMPLES, math.ceil(SAMPLES * ratio * max(1.0, ratio)))


def _direct_pictures(scene: Scene, heights: Array, samples: int, seed: int) -> Array:
    """Rendered pictures (conditions, rows, cols) without light from face to face."""
    variants.use(scene.variant)
    # Rays by lights and by the material, as either misses what the other samples.
    direct = mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": 1})
    alone, ambient = scene.lit_scenes()
    lights = [replace(light, integrator=direct) for light in alone]
    around = ambient and replace(ambient, integrator=direct)
    return scene_pictures(lights, around, heights, RenderSettings(samples, seed, shadow_edges=False))
