"""Bias of the pictures of a step: five materials under eight lights, on two reliefs.

python -m benchmarks.sight.step_bias [NAME ...] [--again]    # some minutes

The bias of a condition is the root of the mean product of two differences between the pictures of a step
and rendered ones, over the mean of the rendered ones. Each difference has samples of its own, so that the
noise of neither counts; the product is a mean over all pairs of four seeds. The scenes have direct light
alone, because steps leave out light from face to face.
"""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterator
from functools import partial
from itertools import product
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from benchmarks.shared.common import publish, rows_of, table
from benchmarks.shared.scenes import light, write_scene
from mitsuba_scenes import find_texture
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from visual.looks import EXACT, FixedSamples
from visual.scene import Scene, load_scene
from visual.step_bias import bias_line, step_bias

NAME = "step_bias"
SIDE, SAMPLES, SEEDS = 64, 256, (3, 4, 5, 6)
"""Samples of the waves along a side; samples a pixel; seeds of the differences."""

MATERIALS = {
    "diffuse": '<bsdf type="diffuse"/>',
    "plastic": '<bsdf type="plastic"/>',
    "roughplastic 0.1": '<bsdf type="roughplastic"><float name="alpha" value="0.1"/></bsdf>',
    "conductor": '<bsdf type="conductor"/>',
    "roughconductor 0.05": '<bsdf type="roughconductor"><float name="alpha" value="0.05"/></bsdf>',
}
"""Materials: matte, a mirror-smooth coat, a broad highlight, a mirror, a narrow lobe without a matte part."""
RELIEFS = {"waves": SIDE, "gravel-tile": 128}
"""Height samples along a side of each relief, and pixels of the film."""
SKY = '<emitter type="envmap"><string name="filename" value="{}"/>'
SKY += '<transform name="to_world"><rotate x="1" angle="90"/></transform></emitter>'


def lights() -> dict[str, Callable[[Path], str]]:
    """Lights by their names, each as a function that writes its files into a folder and gives its XML."""
    return {
        "constant": partial(light, "ambient"),
        "window": partial(_map, [((12, 22), (30, 44), 12.0)]),
        "smooth sky": partial(light, "map"),
        "sky with a sun": partial(_map, [((16, 17), (36, 37), 3000.0)]),
        "far disk": partial(light, "2-degree sun"),
        "near rectangle": partial(light, "near area"),
        "near sphere": _sphere,
        "parallel and constant": lambda folder: light("35", folder) + light("ambient", folder),
    }


def _map(bright: list[tuple[tuple[int, int], tuple[int, int], float]], folder: Path) -> str:
    """An even sky with bright rectangles of rows, columns and radiance, as an environment map."""
    import OpenEXR

    radiance = np.full((64, 128, 3), 0.3, np.float32)
    for (top, bottom), (left, right), value in bright:
        radiance[top:bottom, left:right] = value
    OpenEXR.File({"type": OpenEXR.scanlineimage}, {"RGB": radiance}).write(str(folder / "even.exr"))
    return SKY.format("even.exr")


def _sphere(_: Path) -> str:
    return """<shape type="sphere"><point name="center" x="9" y="3" z="7"/><float name="radius" value="2"/>
        <emitter type="area"><float name="radiance" value="8"/></emitter></shape>"""


def waves() -> Array:
    """Heights from 0 to 1 of two crossing waves."""
    y, x = np.mgrid[0:SIDE, 0:SIDE] / SIDE
    return np.asarray(
        0.5 + 0.3 * np.sin(2.0 * np.pi * (2.0 * x + y)) + 0.2 * np.cos(2.0 * np.pi * (3.0 * y - x))
    )


def scene_of(material: str, shining: str, relief: str, folder: Path) -> Scene:
    """A plate of 10 mm from straight above, by the names of material, light and relief."""
    np.save(folder / "heights.npy", waves())
    path = folder / "scene.xml"
    write_scene(path, lights()[shining](folder), MATERIALS[material], RELIEFS[relief])
    return load_scene(path, texture=None if relief == "waves" else find_texture(relief))


def of_steps(scene: Scene, seed: int) -> Array:
    """Pictures (conditions, rows, cols) of a step."""
    views = scene.look(EXACT).views(FixedSamples(seed=seed))
    return np.concatenate([view.evaluate(scene.heights, False, False).pictures for view in views])


def rendered(scene: Scene, seed: int) -> Array:
    """Pictures (conditions, rows, cols) by Mitsuba."""
    return np.asarray(scene.render(samples=SAMPLES, seed=seed).numpy(), dtype=np.float64)


def bias_percent(steps: Array, pictures: Array) -> tuple[Array, Array]:
    """Bias of each condition, % of its mean picture, and the bias that noise alone would show.

    Args:
        steps: (seeds, conditions, rows, cols) pictures of a step.
        pictures: of the same shape, rendered.

    Returns:
        (conditions,) bias, negative where noise alone is left; (conditions,) one standard error of the mean
        product over the pixels, as a bias.
    """
    differences, count = steps - pictures, len(steps)
    products = (differences.sum(0) ** 2 - (differences**2).sum(0)) / (count * (count - 1))
    square, spread = products.mean((1, 2)), products.std((1, 2)) / np.sqrt(products[0].size)
    mean = pictures.mean((0, 2, 3))
    percent = 100.0 / np.where(mean > 0.0, mean, 1.0)
    return percent * np.sign(square) * np.sqrt(np.abs(square)), percent * np.sqrt(spread)


def measure(material: str, shining: str, relief: str) -> dict[str, Any]:
    """One scene: its refusal, or the bias of its conditions; what a run reports."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            scene = scene_of(material, shining, relief, Path(folder))
            steps = np.stack([of_steps(scene, seed) for seed in SEEDS])
            pictures = np.stack([rendered(scene, seed) for seed in SEEDS])
            line = said(scene)
        except InputError as refusal:
            return {"refused": str(refusal).replace(f"{folder}/", "")}
    bias, noise = bias_percent(steps, pictures)
    return {
        "bias_percent": by_condition(scene, bias),
        "noise_percent": by_condition(scene, noise),
        "line": line,
    }


def by_condition(scene: Scene, values: Array) -> dict[str, float]:
    """Values (conditions,) by their names, to four digits."""
    return {name: float(f"{value:.4g}") for name, value in zip(scene.conditions, values, strict=True)}


def said(scene: Scene) -> str | None:
    """The line on the bias with which a run of this scene begins; None if there is none."""
    line = bias_line(scene, EXACT, step_bias(scene, EXACT))
    return None if line is None else line.replace(f"{scene.file.parent}/", "")


def cases() -> Iterator[tuple[str, str, str]]:
    """Material, light and relief of every case."""
    for relief, material, shining in product(RELIEFS, MATERIALS, lights()):
        yield material, shining, relief


def main() -> None:
    measures = {", ".join(case): partial(measure, *case) for case in cases()}
    rows = rows_of(__doc__, NAME, "rows", measures)
    publish("appearance", NAME, as_text(rows))


def as_text(rows: dict[str, Any]) -> str:
    """Bias of each material over the lights, and under how many lights a run reports one."""
    lines = [
        [material, *(_over_lights(rows, material, relief) for relief in RELIEFS)] for material in MATERIALS
    ]
    heads = (f"{relief}: median, largest bias; lights reported" for relief in RELIEFS)
    return table(("material", *heads), lines)


def _over_lights(rows: dict[str, Any], material: str, relief: str) -> str:
    every = (rows[f"{material}, {light}, {relief}"] for light in lights())
    found = [row for row in every if "refused" not in row]
    bias = [max(row["bias_percent"].values()) for row in found]
    reported = sum(row["line"] is not None for row in found)
    return f"{median(bias):.1f}, {max(bias):.0f} %; {reported} of {len(found)}"


if __name__ == "__main__":
    main()
