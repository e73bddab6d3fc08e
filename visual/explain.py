"""Explanation of a scene: what rendering takes, what is left out, and which models can show the scene.

Nothing of the scene is loaded, but for shapes that may hide the plate.
"""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np

from relief.ground.arrays import Array
from relief.relief import Relief
from visual.backend import variants
from visual.geometry.film_samples import hidden_plate
from visual.geometry.topology import plate_topology
from visual.lights.kind import Light
from visual.lights.parallel import angles
from visual.lights.quadrature import kind_of
from visual.models import BOX_RADIUS, HIDDEN, OBSTACLES, obstacles
from visual.needs import Needs, camera_name, check_effort, needs_of
from visual.scene_file.check import instantiate
from visual.scene_file.describe import describe
from visual.scene_file.parsed_scene import Camera, CheckedScene, Description, ParsedPlate
from visual.scene_file.plate_fitting import fitted_scene

SAMPLED_ONCE = "; each sample meets each light once, whatever emitter_samples says"
NO_EDGES = "not followed: only gradients need them"
NO_GRADIENTS = "none, so retouch optimize refuses this scene: "
NO_FAST = "cannot show this scene: "
FAST = "can show this scene, so retouch optimize takes --fast"
IF_TRAINED = ", if the net of ambient light was trained for this material"
GRADIENTS = "there, with those of moving shadows: retouch optimize can keep the look of this scene"
OUTLINES = "followed in gradients: from the side, faces move in the picture"


def explain_scene(
    path: str | Path,
    defines: Mapping[str, str] | None = None,
    variant: str | None = None,
    relief: Relief | None = None,
    samples: int | None = None,
) -> list[tuple[str, str]]:
    """Lines on what `visual.load_scene(...).render(samples=samples)` would do.

    The scene is checked: faults are reported as by a rendering.

    Args:
        path: of the scene file.
        defines: values of its `$parameters`.
        variant: of Mitsuba; chosen by the scene's colours if None.
        relief: on the plate; None: the scene's own.
        samples: a pixel; default as the scene file says.

    Returns:
        Lines of a subject and a sentence.

    Raises:
        InputError: what is wrong with the file, in one line.
    """
    checked, relief = fitted_scene(path, defines, relief)
    return explain(checked, relief, variant, samples)


def explain(
    checked: CheckedScene, relief: Relief, variant: str | None, samples: int | None = None
) -> list[tuple[str, str]]:
    """Lines on what rendering a relief in a checked scene would do; as `explain_scene`."""
    heights = relief.heights
    description = describe(checked)
    needs = needs_of(description, (heights.shape[0], heights.shape[1]))
    chosen = variants.choose_variant(needs.colour, variant, needs.spectral)
    exact, fast = (obstacles(model, description, needs, heights.shape) for model in OBSTACLES)
    for number in needs.cameras:
        camera = description.cameras[number]
        check_effort(checked.path, (camera.rows, camera.cols), samples or camera.samples)
    if not exact and _hidden(checked, description, needs, heights, chosen.name):
        exact = (HIDDEN,)
    missing = variants.without_gradients(chosen.name, needs.spectral)
    reasons, unseen = (list(filter(None, dict.fromkeys((missing, *every)))) for every in (exact, fast))
    # Seen from a side, ambient light is swept like any other; the net is for the view from above.
    trained = needs.around and needs.top_view == (True,)
    return [
        ("plate", _plate(description.plate, relief)),
        *_cameras(description, needs, samples),
        *((name, _words(light)) for name, light in zip(needs.lights, needs.alone, strict=False)),
        *_ambient(description, needs),
        ("pictures", _pictures(description, needs)),
        ("bounces", _bounces(needs) + SAMPLED_ONCE * (description.integrator == "direct")),
        ("random rays", _random_rays(needs)),
        ("highlights", _highlights(description.plate, needs)),
        ("colour", f"{_channels(chosen.name, needs)}; {chosen.name}: {chosen.reason}"),
        ("shadow edges", NO_EDGES if reasons else _shadow_edges(needs)),
        *([] if reasons or all(needs.top_view) else [("outlines", OUTLINES)]),
        ("gradients", NO_GRADIENTS + "; ".join(reasons) if reasons else GRADIENTS),
        ("fast look", NO_FAST + "; ".join(unseen) if unseen else FAST + (IF_TRAINED if trained else "")),
    ]


def _hidden(
    checked: CheckedScene, description: Description, needs: Needs, heights: Array, variant: str
) -> bool:
    """Whether another shape hides the plate from a camera that looks straight down, by rays."""
    if description.shapes == 1 or not all(needs.top_view):
        return False
    variants.load_mitsuba(needs.colour, variant, needs.spectral)
    camera = description.cameras[needs.cameras[0]]
    plate = plate_topology(*heights.shape, description.plate.size_mm)
    scene = instantiate(checked, heights, lights=[])
    return hidden_plate(scene, plate, needs.cameras, camera.rows, camera.cols)


def _plate(plate: ParsedPlate, relief: Relief) -> str:
    surface, heights = relief.surface, relief.heights
    heights_mm = f"heights {heights.min():.3g} to {heights.max():.3g} mm from {Path(relief.name).name}"
    varies = f", varies over the plate: {', '.join(plate.textures)}" if plate.textures else ""
    axes = [name for name, wraps in zip("yx", relief.repeats, strict=True) if wraps]
    tile = (
        f", repeats along {' and '.join(reversed(axes))}: light comes in from the neighbours" if axes else ""
    )
    size = f"{surface.width_mm:g} x {surface.height_mm:g} mm{tile}"
    return f"{size}, {heights_mm}, material {_material(plate)}{varies}"


def _material(plate: ParsedPlate) -> str:
    """The outermost material that is more than a wrapper."""
    return next((kind for kind in plate.material if kind != "twosided"), plate.material[0])


def _cameras(description: Description, needs: Needs, samples: int | None) -> Iterator[tuple[str, str]]:
    one = len(needs.cameras) == 1
    shares = np.array(needs.weights).reshape(len(needs.cameras), -1)[:, 0]
    for number, top_view, share in zip(needs.cameras, needs.top_view, shares, strict=True):
        camera = description.cameras[number]
        part = "" if one else f", {100.0 * share:.3g} % of the look"
        yield (
            "camera" if one else camera_name(camera, number),
            _camera(camera, top_view, samples or camera.samples) + part,
        )
    left_out = len(description.cameras) - len(needs.cameras)
    if left_out:
        yield "cameras", f"of weight 0, hence left out: {left_out}"


def _camera(camera: Camera, top_view: bool, samples: int) -> str:
    view = "straight above, the plate fills the picture" if top_view else _view(camera)
    through = "" if camera.filter_radius == BOX_RADIUS else f", {camera.filter} filter"
    return f"{view}, {camera.cols} x {camera.rows} pixels, {samples} samples each{through}"


def _view(camera: Camera) -> str:
    """Where a camera looks from."""
    behind = camera.to_world[:3, 2]
    azimuth, elevation = angles(-behind / np.linalg.norm(behind))
    return f"{camera.kind}, from azimuth {azimuth:g}°, elevation {elevation:g}°"


def _words(light: Light) -> str:
    return kind_of(light).words(light)


def _ambient(description: Description, needs: Needs) -> Iterator[tuple[str, str]]:
    if needs.around:
        role = "part of every condition" if needs.alone else "the only condition"
        yield "ambient", f"{_words(needs.around[0])}, {role}"
    elif any(kind_of(light).ambient for light in description.lights):
        yield "ambient", "black, hence left out"


def _pictures(description: Description, needs: Needs) -> str:
    if not needs.alone:
        count = "1 is" if needs.passes == 1 else f"{needs.passes} are"
        return f"{count} rendered, by ambient light alone"
    by = "" if len(needs.cameras) == 1 else "by each camera "
    count = f"{needs.passes} {'is' if needs.passes == 1 else 'are'} rendered: {by}each light alone"
    if needs.around:
        return f"{count}, and ambient light once, which is added to every condition"
    return f"{count}; there is no ambient light, so none is looked for"


def _bounces(needs: Needs) -> str:
    if needs.direct:
        return "one (max_depth 2): light goes from lamp to plate to camera, no longer paths are traced"
    followed = (
        "gradients follow them but for the shadows they move; Gauss-Newton steps see direct light alone"
    )
    if needs.max_depth is None:
        return f"without limit (max_depth -1): whole paths of light are traced; {followed}"
    count = f"at most {max(0, needs.max_depth - 1)} (max_depth {needs.max_depth})"
    return f"{count}: paths of light are traced; {followed}"


def _random_rays(needs: Needs) -> str:
    if not needs.direct:
        return "at every bounce, as the paths go on by them"
    by_chance = [name for name, light in _named(needs) if kind_of(light).met_by_chance]
    others = [name for name, light in _named(needs) if not kind_of(light).met_by_chance]
    never = "a ray off the plate never meets a parallel light or a point"
    if not by_chance:
        return f"none: {never}"
    sent = f"one a sample off the plate, which may meet {_list(by_chance)}"
    return f"{sent}; none for {_list(others)}: {never}" if others else sent


def _highlights(plate: ParsedPlate, needs: Needs) -> str:
    if needs.matte:
        return "none: the material is matte, so none are sampled"
    sampled = ", mirror images of lights that a ray can meet among them" if plate.mirror else ""
    return f"computed, as {_material(plate)} has them{sampled}"


def _channels(variant: str, needs: Needs) -> str:
    if "mono" in variant:
        return "one channel is rendered instead of three"
    if "spectral" in variant:
        return "whole spectra are rendered"
    return "three channels are rendered" + ("" if needs.colour else ", though every one is the same")


def _shadow_edges(needs: Needs) -> str:
    followed = [name for name, light in _named(needs) if _has_edges(light)]
    above = [name for name, light in _named(needs) if not _has_edges(light)]
    sentences = []
    if followed:
        sentences.append(
            f"followed in gradients for {_list(followed)}, where the relief has any; "
            "where it has none, no ray is traced for them"
        )
    if above:
        sentences.append(f"none for {_list(above)}: under light from straight above nothing is shaded")
    return "; ".join(sentences)


def _has_edges(light: Light) -> bool:
    return kind_of(light).ambient or kind_of(light).casts_shadows(light)


def _named(needs: Needs) -> Iterator[tuple[str, Light]]:
    """Lights by their names in the other lines; ambient light once."""
    yield from zip(needs.lights, needs.alone, strict=False)
    yield from (("ambient", light) for light in needs.around[:1])


def _list(names: Iterable[str]) -> str:
    *first, last = names
    return f"{', '.join(first)} and {last}" if first else last
