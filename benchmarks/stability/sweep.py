"""How far from converged the models are at the ends of every parameter, and what is refused.

python -m benchmarks.stability.sweep [NAME ...] [--again]

One thread. The first run builds the operators of every skin and plate (half a GB in the cache folder).
"""

import math
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path
from typing import Any

import drjit
import numpy as np
import torch
from scipy.ndimage import map_coordinates
from torch import Tensor

import tactile
from benchmarks.shared.common import publish, rows_of, table
from benchmarks.shared.scenes import MATERIALS, altered, light, write_scene
from optimize.descent.gauss_newton.step_look import EDGE_SAMPLES, REFINEMENT, STRATA
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.heightmap import load_heights
from tactile.contact import Stop, solve_contact
from tactile.model import TouchModel, touch_model
from tactile.strain import smallest_eigenvalue
from visual.exact.discontinuities import EdgeSamples
from visual.looks import StepView
from visual.scene import Scene, load_scene

TIGHT = 1e-12
"""Tolerance of the contact and of its gradient in the converged run, a thousandth of the default."""
FULL_SAMPLES = 256
"""Most samples a side for which roughness is summed over all offsets; above, few lengths and angles serve.
Also those of the finer grid."""
MOST_SAMPLES = 1024
"""Samples a side at which a row takes some ten minutes, so that it is measured on one relief only."""
FINE_STRATA, FINE_EDGES = 12, EdgeSamples(shadows=64, visibility=4)
"""Samples along a pixel's side, and along edges that cast shadows, of the converged pictures."""
RENDERED_SAMPLES = 16
"""Samples a pixel of pictures by Mitsuba, as in a descent by adam."""


@dataclass(frozen=True)
class Case:
    """A skin on a relief under a light; what is not varied stays as here.

    Attributes:
        relief_mm: height of the relief.
        samples: a side of the relief.
        young_modulus_mpa, poisson_ratio, force_n: of the skin.
        size_mm: side of the plate, over which the relief is stretched as a picture is.
        elevation: of the light above the plate, degrees.
    """

    relief_mm: float = 1.2
    samples: int = 128
    young_modulus_mpa: float = 0.5
    poisson_ratio: float = 0.48
    force_n: float = 10.0
    size_mm: float = 10.0
    elevation: float = 35.0

    @property
    def skin(self) -> tactile.Skin:
        return tactile.Skin(self.young_modulus_mpa, self.poisson_ratio, self.force_n)


COARSEST = Case(samples=0)
"""The usual case on no grid yet."""
TOUCH_AXES: Mapping[str, tuple[float, ...]] = {
    "relief_mm": (0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1, 3),
    "young_modulus_mpa": (0.0, 0.05, 0.1, 0.2, 0.5, 1, 2, 5),
    "poisson_ratio": (0.3, 0.35, 0.4, 0.45, 0.48, 0.49, 0.499, 0.4999),
    "force_n": (0.0, 0.1, 1, 10, 50),
    "size_mm": (1, 4, 10, 20, 40, 100, 101),
    "samples": (8, 2048, 16, 32, 64, 128, 256, 512, MOST_SAMPLES),
}
LOOK_AXES: Mapping[str, tuple[float, ...]] = {
    "elevation": (-5, 0, 2, 5, 10, 20, 35, 50, 70, 80, 88, 90),
    "relief_mm": (0.001, 0.01, 0.1, 0.3, 1, 3),
    "size_mm": (4, 10, 30, 100),
}
"""Values of each parameter, one at a time; those that are to be refused stand at the ends."""
LOOK_SAMPLES = 64
TEXTURES = ("gravel", "waves")
ONE_RELIEF = {
    ("touch", "young_modulus_mpa"): "gravel",
    ("touch", "poisson_ratio"): "gravel",
    ("touch", "force_n"): "gravel",
    ("look", "relief_mm"): "waves",
    ("look", "size_mm"): "waves",
}
"""Parameters that are varied on one relief only."""
MESHED = {"poisson_ratio": (0.3, 0.48, 0.499), "size_mm": (10.0,), "force_n": (10.0,)}
"""Values for which finite elements are built; other parameters need no mesh of their own."""

Row = dict[str, Any]
Measure = Callable[[Case, str], Row]


def main() -> None:
    drjit.set_thread_count(1)
    torch.set_num_threads(1)
    rows = rows_of(__doc__, "stability", "rows", dict(works()))
    publish("speed", "stability", as_text(rows))


TOUCH_MODELS = {
    "layer": "`layer`",
    "single": "`layer`, single precision",
    "quick": "`quick`",
    "net": "`net`",
    "elements": "`layer` against finite elements",
}
LOOK_MODELS = {"explicit": "a step's pictures", "fast": "the fast look", "rendered": "16 samples a pixel"}
"""Models of the tables, in words."""
ELEVATIONS = {"from 50 degrees up": (50, 90), "20 to 35": (20, 35), "below 20": (-5, 10)}
"""Elevations of the light, degrees, whose largest errors are shown."""


def as_text(rows: Mapping[str, Row]) -> str:
    """Largest errors of every model over all parameters; of pictures, by the elevation of the light."""
    touch_lines = []
    for model, words in TOUCH_MODELS.items():
        found = [row["models"][model] for row in rows.values() if model in row.get("models", {})]
        errors = [one for one in found if "V" in one]
        most = (f"{max(one[key] for one in errors):.2g}" for key in ("V", "A", "contact"))
        touch_lines.append((words, len(errors), *most, sum("refused" in one for one in found)))
    look_lines = []
    for model, words in LOOK_MODELS.items():
        cells = []
        for low, high in ELEVATIONS.values():
            some = [
                row
                for key, row in rows.items()
                if "elevation" in key and low <= float(key.split()[-1]) <= high
            ]
            most = (max(row["models"][model][key] for row in some) for key in ("mean", "gradient"))
            cells.append(", ".join(f"{each:.2g}" for each in most))
        look_lines.append((words, *cells))
    head = ("model of touch", "cases", "V, % at most", "A, %", "share in contact, %", "refused")
    heads = ("pictures: mean, gradient, % at most", *(f"light {words}" for words in ELEVATIONS))
    return f"{table(head, touch_lines)}\n\n{table(heads, look_lines)}"


def works() -> Iterator[tuple[str, "partial[Row]"]]:
    """Every row: its name, and what measures it."""
    singly: tuple[tuple[str, Case, Mapping[str, tuple[float, ...]], Measure], ...] = (
        ("touch", Case(), TOUCH_AXES, touch),
        ("look", Case(samples=LOOK_SAMPLES), LOOK_AXES, look),
    )
    for texture in TEXTURES:
        for sense, base, axes, measure in singly:
            for name, values in axes.items():
                for value in values:
                    wanted = ONE_RELIEF.get((sense, name), "waves" if value == MOST_SAMPLES else texture)
                    if texture == wanted:
                        case = varied(base, {name: value})
                        yield row_name(sense, texture, {name: value}), partial(measure, case, texture)


def varied(base: Case, values: Mapping[str, Any]) -> Case:
    """A case with other values."""
    return replace(base, **values)


def row_name(sense: str, texture: str, values: Mapping[str, float]) -> str:
    """Name of a row in the results."""
    return f"{sense}, {texture}, " + ", ".join(f"{name} {value:g}" for name, value in values.items())


def relief(texture: str, samples: int, height: float) -> Array:
    """The relief (n, n), the same surface at every number of samples, from 0 to `height` mm."""
    places = (np.arange(samples) + 0.5) / samples
    field = _waves(places) if texture == "waves" else _gravel(places)
    return height * np.clip(field, 0.0, 1.0)


def _waves(places: Array) -> Array:
    """Plane waves of 2 to 25 periods a side at random, amplitude as wavelength to the power 0.8."""
    random = np.random.default_rng(1)
    periods, angle, phase = np.geomspace(2, 25, 60), *(2.0 * np.pi * random.random((2, 60)))

    def field(places: Array) -> Array:
        total = np.zeros((len(places), len(places)))
        for k, a, start in zip(periods, angle, phase, strict=True):
            along = places[:, None] * np.sin(a) + places[None, :] * np.cos(a)
            total += k**-0.8 * np.cos(2.0 * np.pi * k * along + start)
        return total

    fixed = field((np.arange(256) + 0.5) / 256)
    return np.asarray((field(places) - fixed.min()) / np.ptp(fixed))


def _gravel(places: Array) -> Array:
    """The bundled gravel, by cubic interpolation between the pixels of its picture."""
    picture = load_heights("mitsuba_scenes/textures/gravel.png", relief_mm=1.0)
    pixel = np.clip(places * len(picture) - 0.5, 0, len(picture) - 1)
    return np.asarray(map_coordinates(picture, np.meshgrid(pixel, pixel, indexing="ij"), mode="nearest"))


def refusing(measure: Callable[[], Row]) -> Row:
    """A measurement, or the line in which it is refused or fails."""
    try:
        return measure()
    except InputError as error:
        return {"refused": str(error)}
    except tactile.ContactError as error:
        return {"failed": str(error)}


def touch(case: Case, texture: str) -> Row:
    """Every model of touch against the converged layer, the layer against elements and a finer grid."""

    def measure() -> Row:
        truth = pressed(converged("layer", case), case, texture)
        row = against_truth(case, texture, truth, ("layer", "single", "quick", "net"))
        if texture == "gravel" and all(getattr(case, name) in values for name, values in MESHED.items()):
            row["models"]["elements"] = refusing(
                lambda: deviations(truth, pressed(converged("fem", case), case, texture))
            )
        if texture == "waves" and case.samples < FULL_SAMPLES and varied(case, {"samples": 0}) == COARSEST:
            fine = replace(case, samples=FULL_SAMPLES)
            row["models"]["finer grid"] = refusing(lambda: deviations(truth, finest(fine, texture)))
        return row

    return refusing(measure)


@cache
def finest(case: Case, texture: str) -> Row:
    """The converged press on a finer grid, without gradient."""
    return pressed(converged("layer", case), case, texture, gradient=False)


def against_truth(case: Case, texture: str, truth: Row, models: tuple[str, ...]) -> Row:
    """Numbers of the converged run, and what each model is off by."""

    def off(name: str) -> Row:
        return deviations(pressed(descents(name, case), case, texture), truth)

    return {
        "truth": {name: truth[name] for name in ("V", "A", "contact")},
        "models": {name: refusing(partial(off, name)) for name in models},
    }


def descents(name: Any, case: Case) -> TouchModel:
    """A model as a descent takes it; "single" is the layer in single precision."""
    dtype = torch.float64 if name == "layer" else torch.float32
    return touch_model(case.skin, case.samples, case.size_mm, dtype, "layer" if name == "single" else name)


def converged(name: Any, case: Case) -> TouchModel:
    """A model in double precision that is solved to `TIGHT`."""
    model = touch_model(case.skin, case.samples, case.size_mm, torch.float64, name)
    solve = partial(solve_contact, stop=Stop(residual=TIGHT))
    mean = case.skin.mean_pressure_mpa(case.size_mm) / case.skin.young_modulus_mpa
    flat = solve(model.operator, torch.zeros_like(model.flat_strain), mean).pressure
    return replace(
        model,
        flat_strain=smallest_eigenvalue(model.operator.strain(flat)),
        solve=lambda body, heights, mean, start: solve(body, heights, mean, start),
        gradient_tolerance=TIGHT,
    )


def pressed(model: TouchModel, case: Case, texture: str, gradient: bool = True) -> Row:
    """V, A (mm²), share in contact, and the gradient of V, of one press."""
    dtype = model.flat_strain.dtype
    heights = torch.as_tensor(relief(texture, case.samples, case.relief_mm), dtype=dtype)
    heights.requires_grad_(gradient)
    state = model.press(heights)
    few = case.samples > FULL_SAMPLES
    roughness = tactile.roughness(state.strain, case.size_mm, "polar" if few else "full")
    slope = torch.autograd.grad(roughness, heights)[0].double() if gradient else None
    return {
        "V": float(roughness.detach()),
        "A": float(tactile.contact_area(state.gap.detach(), case.size_mm)),
        "contact": float(state.contact_fraction),
        "gradient": slope,
    }


def deviations(one: Row, other: Row) -> Row:
    """Error of one press from another, %; a gradient by the norm of the difference."""
    off = {name: percent(one[name], other[name]) for name in ("V", "A", "contact")}
    slopes: list[Tensor] = [one["gradient"], other["gradient"]]
    if all(slope is not None for slope in slopes) and slopes[0].shape == slopes[1].shape:
        size = float(slopes[1].norm())
        off["gradient"] = 100.0 * float((slopes[0] - slopes[1]).norm()) / size if size else math.nan
    return off


def percent(value: float, truth: float) -> float:
    """Absolute deviation, %; not a number where the truth is 0 or a value is not finite."""
    return 100.0 * abs(value / truth - 1.0) if truth and math.isfinite(value) else math.nan


@cache
def scene_of(case: Case, texture: str) -> Scene:
    """The plate from straight above, a pixel at each sample, under one light."""
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        np.save(folder / "heights.npy", relief(texture, case.samples, case.relief_mm))
        path = folder / "scene.xml"
        lit = light(f"{case.elevation:g}", folder)
        write_scene(path, lit, MATERIALS["plastic"], case.samples, size_mm=case.size_mm)
        scene = load_scene(path)
        scene.render(samples=1)
        scene.render(samples=1, resolution=REFINEMENT * case.samples)
        scene.views()
    return scene


def look(case: Case, texture: str) -> Row:
    """Models of pictures against many samples: the mean, and the loss's slope toward its target."""

    def measure() -> Row:
        scene = scene_of(case, texture)
        scene_of.cache_clear()
        heights = scene.heights
        change = case.relief_mm * (altered(heights / case.relief_mm) - heights / case.relief_mm)
        resolution = REFINEMENT * case.samples
        fine = scene.views(resolution, 0, FINE_STRATA, FINE_EDGES)[0]
        adjoint = coarse(seen(fine, heights + change) - seen(fine, heights))
        spread = np.kron(adjoint, np.ones((REFINEMENT, REFINEMENT))) / REFINEMENT**2

        def explicit(view: StepView) -> Row:
            result = view.evaluate(heights)
            slope = spread.ravel() @ (result.jacobians[0] @ change.ravel())
            return {"mean": float(result.pictures.mean()), "gradient": float(slope)}

        def differentiated(weights: Array, **options: Any) -> Row:
            field = torch.as_tensor(heights).clone().requires_grad_()
            shown = scene.render(field, **options)[0]
            (slope,) = torch.autograd.grad((torch.as_tensor(weights) * shown).sum(), field)
            return {
                "mean": float(shown.detach().mean()),
                "gradient": float((slope.numpy() * change).sum()),
            }

        models: dict[str, Callable[[], Row]] = {
            "explicit": lambda: explicit(scene.views(resolution, 0, STRATA, EDGE_SAMPLES)[0]),
            "rendered": lambda: differentiated(spread, samples=RENDERED_SAMPLES, resolution=resolution),
            "fast": lambda: differentiated(adjoint, model="fast"),
        }
        truth = explicit(fine)

        def off(name: str) -> Row:
            return {number: percent(value, truth[number]) for number, value in models[name]().items()}

        return {"truth": truth, "models": {name: refusing(partial(off, name)) for name in models}}

    return refusing(measure)


def seen(view: StepView, heights: Array) -> Array:
    """The picture (rows, cols) of one light."""
    return view.evaluate(heights, jacobian=False).pictures[0]


def coarse(picture: Array) -> Array:
    """Means of blocks of pixels: a picture with a pixel at each sample."""
    side = len(picture) // REFINEMENT
    return np.asarray(picture.reshape(side, REFINEMENT, side, REFINEMENT).mean((1, 3)))


if __name__ == "__main__":
    main()
