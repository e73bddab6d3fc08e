"""What the rule that ends a contact costs in accuracy: presses as they end beside solutions to eleven digits.

python -m benchmarks.touch.stopping    # about five minutes

100 reliefs, random ones of every kind and extreme ones (10 µm high, needles, steep noise, dots, stiff skin,
0.05 to 20 N), by flat and round fingers, by the layer and by finite elements; in double precision, and in
single precision as in the steps of a descent. Writes results/stopping.json and a place of
docs/evidence/touch.md.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

import tactile
from benchmarks.shared.common import machine, parser_of, publish, save, table
from benchmarks.touch.pressed_reliefs import SIDE, SIZE_MM, crop, grating, many, noise, scaled
from optimize.settings.skins import load_skin
from relief.ground.arrays import Array
from relief.patches import Patches
from relief.places import places
from relief.surface import Surface
from tactile.contact import Stop, solve_contact
from tactile.model import ModelName, TouchModel, touch_model

TIGHT = Stop(residual=1e-11)
RANDOM = 60
"""Number of random reliefs; the others are extreme."""
MEASURES = ("V_percent", "area_percent", "gradient_percent")


@dataclass(frozen=True)
class Case:
    """A relief under a finger, by a model of touch."""

    relief: str
    heights: Array
    finger: str
    skin: tactile.Skin
    model: ModelName


def main() -> None:
    parser_of(__doc__).parse_args()
    torch.set_num_threads(1)
    rows = []
    for case in cases():
        rows.append(row_of(case))
        print(rows[-1], flush=True)
    save("stopping", {"machine": machine(), "rows": rows})
    publish("touch", "stopping", as_text(rows))


def cases() -> Iterator[Case]:
    """Random reliefs by turns of the finger, and every extreme relief by two fingers."""
    paper, measured = load_skin("paper"), load_skin("measured")
    fingers: tuple[tuple[str, tactile.Skin, ModelName], ...] = (
        ("flat", paper, "layer"),
        ("flat", paper, "fem"),
        ("measured", measured, "layer"),
        ("measured", measured, "fem"),
        ("flat, stiff", replace(paper, young_modulus_mpa=50.0), "layer"),
    )
    reliefs = dict(list(many(2 * RANDOM, seed=49).items())[:RANDOM]) | extremes()
    loads = np.geomspace(0.05, 20.0, len(reliefs))
    for number, (name, heights) in enumerate(reliefs.items()):
        finger, skin, model = fingers[number % len(fingers)]
        if number >= RANDOM and skin.shape == "flat":
            skin = replace(skin, force_n=float(loads[(7 * number) % len(loads)]))
        yield Case(name, heights, f"{finger}, {skin.force_n:.2g} N", skin, model)


def extremes() -> dict[str, Array]:
    """Forty reliefs at the ends of what a finger meets."""
    random = np.random.default_rng(50)
    every = np.zeros((SIDE, SIDE))
    needles = every.copy()
    needles[8::16, 8::16] = 3.0
    dots = np.hypot(*(np.mgrid[:SIDE, :SIDE] % 32 - 15.5)) < 6.0
    step = every.copy()
    step[:, : SIDE // 2] = 3.0
    one = every.copy()
    one[SIDE // 2, SIDE // 2] = 3.0
    shapes = {
        "needles": needles,
        "dots": 1.8 * dots,
        "step": step,
        "one needle": one,
        "steep noise": scaled(noise(random, 0.05), 3.0),
        "noise, 10 µm": scaled(noise(random, 0.3), 0.01),
        "gravel, 10 µm": crop("gravel", 0, 0.01),
        "gravel, 3 mm": crop("gravel", 1, 3.0),
        "fine grating": scaled(grating(random, 0.3), 0.5),
        "flat": every,
    }
    # Every shape by four of the five fingers.
    return {f"{name} ({turn})": shape for turn in range(4) for name, shape in turned(shapes, turn)}


def turned(shapes: dict[str, Array], turn: int) -> list[tuple[str, Array]]:
    """The shapes, moved on so that each turn meets another finger."""
    pairs = list(shapes.items())
    return pairs[turn:] + pairs[:turn]


def row_of(case: Case) -> dict[str, Any]:
    """V, contact area and the gradient of V as a press ends, off those of a tight solution, in %."""
    patches = Patches(
        surface := Surface(case.heights.shape, SIZE_MM), places(surface), side_mm=case.skin.patch_mm
    )
    fields = torch.as_tensor(patches.within_reach(case.heights, slice(0, 1)))[0]
    samples, size = patches.samples, patches.size_mm
    double = touch_model(case.skin, samples, size, torch.float64, case.model)
    tight = replace(double, solve=_tight, gradient_tolerance=TIGHT.residual)
    truth = pressed(tight, fields)
    row: dict[str, Any] = {"relief": case.relief, "finger": case.finger, "model": case.model}
    for name, model in (
        ("double", double),
        ("single", touch_model(case.skin, samples, size, torch.float32, case.model)),
    ):
        found = pressed(model, fields)
        row[name] = {"bound": found["bound"], **off(found, truth)}
    return row | {"V": truth["V"], "area_mm2": truth["area"]}


def _tight(body: Any, heights: Tensor, mean: float, start: Tensor | None) -> Any:
    return solve_contact(body, heights, mean, start, TIGHT)


def pressed(model: TouchModel, heights: Tensor) -> dict[str, Any]:
    """V, contact area (mm²), the gradient of V, and the bound, of one press."""
    field = heights.to(model.flat_strain.dtype).requires_grad_()
    touch = model.press(field)
    value = tactile.roughness(touch)
    (gradient,) = torch.autograd.grad(value, field)
    return {
        "V": float(value.detach()),
        "area": float(tactile.contact_area(touch).detach()),
        "gradient": gradient.double(),
        "bound": float(touch.error_bound),
    }


def off(found: dict[str, Any], truth: dict[str, Any]) -> dict[str, float | None]:
    """How far numbers are off, in %; None of V and its gradient where the relief is as smooth as a plate."""
    smooth = truth["V"] < 1e-6
    slope = truth["gradient"]
    return {
        "V_percent": None if smooth else 100.0 * abs(found["V"] / truth["V"] - 1.0),
        "area_percent": 100.0 * abs(found["area"] / truth["area"] - 1.0),
        "gradient_percent": None
        if smooth
        else 100.0 * float((found["gradient"] - slope).norm() / slope.norm()),
    }


def as_text(rows: list[dict[str, Any]]) -> str:
    """Medians and worst cases by precision and model."""
    lines = []
    for precision in ("double", "single"):
        for model in ("layer", "fem"):
            some = [row for row in rows if row["model"] == model]
            cells: list[Any] = [precision, model, len(some)]
            cells += [float(reduce([row[precision]["bound"] for row in some])) for reduce in (np.median, max)]
            for measure in MEASURES:
                values = [v for row in some if (v := row[precision][measure]) is not None]
                cells += [float(np.median(values)), float(max(values))]
            lines.append(tuple(cells))
    head = ["precision", "model", "cases", "bound, median", "worst"]
    for name in ("V off %", "contact area off %", "gradient of V off %"):
        head += [f"{name}, median", "worst"]
    return table(head, lines)


if __name__ == "__main__":
    main()
