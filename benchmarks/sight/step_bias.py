"""Bias of the pictures of a step: five materials under eight lights, on two reliefs.

python -m benchmarks.sight.step_bias                  # what is not in the results yet, some minutes
python -m benchmarks.sight.step_bias --again
python -m benchmarks.sight.step_bias --column before  # of a checkout that is kept to compare with

The bias of a condition is the root of the mean product of two differences between the pictures of a step
and rendered ones, over the mean of the rendered ones. Each difference has samples of its own, so that the
noise of neither counts; the product is a mean over all pairs of four seeds. The scenes have direct light
alone, because steps leave out light from face to face.
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable, Iterator
from functools import partial
from itertools import product
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from benchmarks.shared.common import DOCS, kept, load, parser_of, publish, table
from benchmarks.shared.scenes import light
from mitsuba_scenes import find_texture
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from visual.looks import EXACT, FixedSamples
from visual.scene import Scene, load_scene
from visual.step_bias import bias_line, step_bias

NAME, COMMAND = "step_bias", "benchmarks.sight.step_bias"
SIDE, SAMPLES, SEEDS = 64, 256, (3, 4, 5, 6)
"""Samples of the waves along a side; samples a pixel; seeds of the differences."""
NO_LINE, LINE = 3.0, 5.0
"""Bias, %, below which a run says nothing, and from which it says a line."""

MATERIALS = {
    "diffuse": '<bsdf type="diffuse"/>',
    "plastic": '<bsdf type="plastic"/>',
    "roughplastic 0.1": '<bsdf type="roughplastic"><float name="alpha" value="0.1"/></bsdf>',
    "conductor": '<bsdf type="conductor"/>',
    "roughconductor 0.05": '<bsdf type="roughconductor"><float name="alpha" value="0.05"/></bsdf>',
}
"""Materials: matte, a mirror-smooth coat, a broad highlight, a mirror, a narrow lobe without a matte part."""
RELIEFS, COLUMNS = {"waves": SIDE, "gravel-tile": 128}, ("before", "after")
"""Height samples along a side of each relief, and pixels of the film; columns of the table."""
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


def waves(rows: int = SIDE, cols: int = SIDE) -> Array:
    """Heights (rows, cols) from 0 to 1 of two crossing waves, as steep along both axes."""
    y, x = np.mgrid[0:rows, 0:cols] / rows
    return np.asarray(
        0.5 + 0.3 * np.sin(2.0 * np.pi * (2.0 * x + y)) + 0.2 * np.cos(2.0 * np.pi * (3.0 * y - x))
    )


def scene_of(material: str, shining: str, relief: str, folder: Path) -> Scene:
    """A plate of 10 mm from straight above, by the names of material, light and relief."""
    np.save(folder / "waves.npy", waves())
    path = folder / "scene.xml"
    path.write_text(
        f"""<scene version="3.0.0">
        <integrator type="path"><integer name="max_depth" value="2"/></integrator>
        <sensor type="orthographic">
            <transform name="to_world">
                <scale x="5" y="5"/><lookat origin="0, 0, 20" target="0, 0, 0" up="0, 1, 0"/>
            </transform>
            <sampler type="independent"><integer name="sample_count" value="64"/></sampler>
            <film type="hdrfilm"><integer name="width" value="{RELIEFS[relief]}"/>
                <integer name="height" value="{RELIEFS[relief]}"/>
                <rfilter type="box"/></film>
        </sensor>
        {lights()[shining](folder)}
        <shape type="heightfield"><string name="filename" value="waves.npy"/>{MATERIALS[material]}</shape>
        </scene>""",
        encoding="utf-8",
    )
    return load_scene(path, texture=None if relief == "waves" else find_texture(relief))


Value = TypeVar("Value")


def timed(work: Callable[[], Value]) -> tuple[Value, dict[str, float]]:
    """What a function gives, and its CPU and wall seconds."""
    began, wall = time.process_time(), time.perf_counter()
    value = work()
    spent = {"cpu_s": time.process_time() - began, "wall_s": time.perf_counter() - wall}
    return value, {unit: round(seconds, 2) for unit, seconds in spent.items()}


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
    """One scene: its refusal, or the bias of its conditions; what a run says; seconds."""
    with tempfile.TemporaryDirectory() as folder:
        try:
            scene = scene_of(material, shining, relief, Path(folder))
            of_steps(scene, SEEDS[0])  # Compiles.
            rendered(scene, SEEDS[0])
            steps, stepping = timed(lambda: np.stack([of_steps(scene, seed) for seed in SEEDS]))
            pictures, rendering = timed(lambda: np.stack([rendered(scene, seed) for seed in SEEDS]))
            line, saying = timed(lambda: said(scene))
        except InputError as refusal:
            return {"refused": str(refusal).replace(f"{folder}/", "")}
    bias, noise = bias_percent(steps, pictures)
    return {
        "bias_percent": by_condition(scene, bias),
        "noise_percent": by_condition(scene, noise),
        "mean_of_steps": by_condition(scene, steps.mean((0, 2, 3))),
        "mean_of_pictures": by_condition(scene, pictures.mean((0, 2, 3))),
        "line": line,
        "steps": stepping,
        "pictures": rendering,
        "check": saying,
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
    parser = parser_of(__doc__)
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--column", choices=COLUMNS, default="after")
    arguments = parser.parse_args()
    for case in cases():
        kept(NAME, arguments.column, ", ".join(case), partial(measure, *case), arguments.again)
    publish(DOCS / "evidence" / "appearance.md", NAME, COMMAND, as_table(load(NAME)))


def as_table(results: dict[str, Any]) -> str:
    """A row for each material and light as Markdown, the reliefs side by side."""
    head = [f"{relief} {column}, %" for column in COLUMNS for relief in RELIEFS]
    rows = []
    for material, shining in product(MATERIALS, lights()):
        found = [
            [results.get(column, {}).get(f"{material}, {shining}, {relief}") for relief in RELIEFS]
            for column in COLUMNS
        ]
        line = " / ".join(
            "-" if row is None else "refused" if "refused" in row else "line" if row["line"] else "none"
            for row in found[-1]
        )
        cpu_s = " / ".join(
            "-" if row is None or "check" not in row else f"{row['check']['cpu_s']:.1f}" for row in found[-1]
        )
        rows.append([material, shining, *(shown(row) for column in found for row in column), line, cpu_s])
    return table(("material", "light", *head, "said", "CPU s"), rows)


def shown(row: dict[str, Any] | None) -> str:
    """The largest bias of a scene's conditions with its standard error, or what noise alone would show."""
    if row is None or "refused" in row:
        return "-" if row is None else "refused"
    conditions = row["bias_percent"]
    if not any(row["mean_of_pictures"].values()):
        return "black"
    name = max(conditions, key=lambda each: conditions[each])
    bias, noise = conditions[name], row["noise_percent"][name]
    # Of the square, the noise is one standard error.
    if bias <= 1.4 * noise:
        return f"below {digits(2.0 * noise)}"
    return f"{digits(bias)} ± {digits(0.5 * noise**2 / bias)}"


def digits(value: float) -> str:
    """A number with two digits, or as many as it has before the point."""
    return f"{value:.0f}" if value >= 10.0 else f"{value:.2g}"


if __name__ == "__main__":
    main()
