"""Reach of a texture: the largest changes, rougher and smoother, before its pictures visibly change.

Two short descents each way, to 2 and to 4 just-noticeable differences, by the fast models where these can
show the scene. Beyond, the change of the pictures is extrapolated (`optimize.estimates.change_curves`).
docs/evidence/optimiser.md compares with whole runs.
"""

import logging
import math
from collections.abc import Callable
from dataclasses import replace

import numpy as np

import tactile
from optimize.descent.driver import Iterate, descend
from optimize.descent.gauss_newton.method import GaussNewton
from optimize.descent.problem import Problem
from optimize.descent.targets import Targets
from optimize.estimates.change_curves import ChangeCurve, Reach, crossing
from optimize.verification.picture_change import crossed_magnitude
from optimize.verification.picture_metrics import pixel_weights
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.progress import Stage, stage
from tactile.jnd import ROUGHNESS_JND, SMOOTH_BELOW, smooth_clause
from tactile.model import ModelName
from tactile.quantities import LIMIT_PERCENT, ROUGHNESS
from tactile.skin import Skin
from visual.looks import EXACT, FAST, look_model
from visual.picture_noise import batched
from visual.scene import Scene

_log = logging.getLogger(__name__)

CURVE_JND = (2.0, 4.0)
"""Samples of the picture-change curve: ends of the short descents, JND. A reach between the
samples is measured, and a reach beyond them is extrapolated."""
STEPS = 8
"""Most steps of each short descent; on the bundled textures three to seven arrive."""
TOLERANCE = 0.01
"""Relative error of the roughness at which a short descent has arrived, as in a run."""
SAMPLES = 64
"""Samples a pixel of rendered pictures. The noise of their change is far below the limit: on gravel 0.1 %."""


Changed = Callable[[Array], float]
"""From heights (rows, cols) to the mean change of their pictures in % of white."""
Keep = Callable[[Iterate, float, float], object]
"""Called with the end of each short descent, its JND, and the change of its pictures in % of white."""


def reach(scene: Scene, skin: Skin, keep: Keep = lambda *sample: None) -> Reach:
    """Reach of the scene's relief, rougher and smoother.

    The fast models take the steps where the fast look can show the scene, else the exact ones.

    Args:
        scene: with the relief.
        skin: the finger.
        keep: called with each sample of the curve.

    Raises:
        InputError: a flat or smooth texture, or a scene without gradients of its pictures.
        ContactError: the contact on the original does not converge.
    """
    if np.ptp(scene.heights) == 0.0:
        raise InputError("the texture is flat; there is no relief to change")
    touch: ModelName = "quick"
    look = FAST
    try:
        scene.look(look).check()
    except InputError as unable:
        _log.info("exact models take the steps: %s", unable)
        touch, look = "layer", EXACT
    problem = Problem(scene.relief, skin, Targets(), scene, touch=touch, look=look)
    original = problem.press(scene.heights, gradients=False).values[ROUGHNESS.name]
    if (own := float(original.mean())) < SMOOTH_BELOW:
        raise InputError(f"{smooth_clause(own)}; there is no reach in just-noticeable differences from there")
    changed, mean = _rendered_change(scene) if look_model(look).sampled else picture_change(scene, look)
    with stage("short descents", 2 * len(CURVE_JND), at_most=True) as advance:
        rougher, smoother = (
            _curve(problem, original, sense, changed, keep, advance) for sense in (1.0, -1.0)
        )
    return Reach(rougher, smoother, touch, look, mean)


def _curve(
    problem: Problem, original: Array, sense: float, changed: Changed, keep: Keep, advance: Stage
) -> ChangeCurve:
    ends: list[tuple[float, float]] = []
    mean = float(original.mean())
    # Toward smoother only as far as just-noticeable differences count, though one descent is made.
    counted = math.inf if sense > 0.0 else tactile.jnd_apart(mean, SMOOTH_BELOW)
    heights, memory = problem.heights, dict[str, Array]()
    for magnitude in CURVE_JND:
        if ends and magnitude > counted:
            break
        goals = [tactile.jnd_scaled(float(value), sense * magnitude) for value in original]
        targets = Targets.of(TOLERANCE, roughness=goals)
        method = GaussNewton(replace(problem, targets=targets))
        reached = descend(method, targets, method.begin(0, heights, memory), STEPS).best
        jnd = sense * math.log(reached.means[ROUGHNESS.name] / mean) / math.log(ROUGHNESS_JND)
        ends.append((jnd, changed(reached.heights)))
        keep(reached, sense * jnd, ends[-1][1])
        advance()
        _log.info("%+.2f JND: the pictures change by %.2f %% of white", sense * jnd, ends[-1][1])
        if not targets.met(reached.values):
            return ChangeCurve(min(jnd, counted, crossing(ends, sense > 0.0)), False, tuple(ends))
        if ends[-1][1] >= LIMIT_PERCENT:
            break
        # Trust in longer steps is that of a new descent; the pressure is still a good start.
        heights, memory = reached.heights, {"pressure": reached.memory["pressure"]}
    crossed = crossing(ends, sense > 0.0)
    return ChangeCurve(min(crossed, counted), crossed <= counted, tuple(ends))


def picture_change(scene: Scene, look: str) -> tuple[Changed, float]:
    """From heights to the mean change of the scene's pictures by a look without noise, and the mean picture.

    Both are means over the plate in % of white.
    """
    return _change(
        scene, lambda heights: scene.render(heights, model=look).numpy(), lambda one: np.abs(one).mean()
    )


def _rendered_change(scene: Scene) -> tuple[Changed, float]:
    """The same by rendered pictures: mean of an estimate that noise enlarges and one that noise lowers."""

    def size(difference: Array) -> float:
        return float(np.mean((np.abs(difference.mean(axis=0)).mean(), crossed_magnitude(difference))))

    return _change(scene, lambda heights: batched(scene, heights, SAMPLES).pictures, size)


def _change(
    scene: Scene, pictures: Callable[[Array], Array], size: Callable[[Array], float]
) -> tuple[Changed, float]:
    """`picture_change` by pictures of heights, and the size of their weighted difference."""
    weights, original = pixel_weights(scene.plate_weights(), scene.weights), pictures(scene.heights)

    def changed(heights: Array) -> float:
        return 100.0 * float(size(weights * (pictures(scene.levelled(heights)) - original))) / scene.white

    return changed, 100.0 * float((weights * original).mean()) / scene.white
