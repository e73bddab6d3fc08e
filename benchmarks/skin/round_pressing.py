"""What a round finger feels: V over the pairs on its own contact, and over the paper's 100 mm² beside it.

`tactile.press` does not serve: strain is needed with and without the flat plate's, and V over other pairs.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import torch
from torch import Tensor

import tactile
from benchmarks.skin.experiment_plates import APART_MM, DOT_MM, HIGH_MM, ROUND_SAMPLES, SAMPLES
from benchmarks.skin.plate_pressing import EXPLORING_N
from benchmarks.skin.round_stimuli import dot_plates, natural_plates, round_series
from relief.ground.arrays import Array
from relief.ground.limits import PATCH_SIDE_MM
from tactile.layer.elastic_layer import ElasticLayerOperator, elastic_layer_operator
from tactile.pressing import Press
from tactile.skin import Skin
from tactile.strain import principal_strain

SIZE_MM = PATCH_SIDE_MM * ROUND_SAMPLES / SAMPLES
"""Side of the patch, 16.25 mm."""
FORCES_N = (0.5, 1.0, 2.0)
"""Forces of the series "force" for round fingers, N: none above 2."""
WAYS = ("V", "no dome", "100 mm²", "100 mm², no dome")
"""Kinds of V: over pairs on the contact with a flat plate; the same of the strain as it is, from which that
of the flat plate is not subtracted; and both over pairs on 10 x 10 mm, as the paper has them."""
EXPLORED = ("spacing", "human SA1", "spacing, high", "grooves")
"""Series that facts ask for at `EXPLORING_N`."""


@dataclass(frozen=True)
class RoundFinger:
    """A round finger on its patch, in single precision.

    Attributes:
        skin: of shape "round".
        samples: a side.
        size_mm: side of the patch.
    """

    skin: Skin
    samples: int = ROUND_SAMPLES
    size_mm: float = SIZE_MM

    @cached_property
    def operator(self) -> ElasticLayerOperator:
        """The layer with sliding sides, which knows no force or modulus."""
        return elastic_layer_operator(self.skin, self.samples, self.size_mm, torch.float32)

    def pressure(self, heights: Tensor) -> Tensor:
        """(..., n, n) pressures in units of the base's modulus on heights in mm."""
        return Press.of(self.skin, self.operator).pressure(heights)

    @cached_property
    def flat(self) -> tuple[Tensor, Tensor]:
        """Where the finger touches a flat plate (n, n), and its strain there (n, n)."""
        pressure = self.pressure(torch.zeros(self.samples, self.samples))
        return pressure > 0.0, principal_strain(self.operator, pressure)

    @property
    def flat_mm2(self) -> float:
        """Area of contact with a flat plate, mm²."""
        return float(self.flat[0].sum()) * (self.size_mm / self.samples) ** 2

    def felt(
        self, heights: Array, ways: Sequence[str] = WAYS[:1]
    ) -> tuple[dict[str, list[float]], list[float]]:
        """V of reliefs (k, n, n) mm by `WAYS`, and their areas of contact, mm²."""
        pressure = self.pressure(torch.as_tensor(np.ascontiguousarray(heights, dtype=np.float32)))
        whole = principal_strain(self.operator, pressure)
        mask, flat = self.flat
        margin = (self.samples - SAMPLES) // 2
        inner = slice(margin, margin + SAMPLES)
        found = {}
        for way in ways:
            strain = whole if "no dome" in way else whole - flat
            found[way] = (
                tactile.roughness(strain[..., inner, inner], PATCH_SIDE_MM, quadrature="thinned").tolist()
                if "100" in way
                else tactile.roughness(strain, self.size_mm, receptors=mask).tolist()
            )
        areas = (pressure > 0.0).sum((-2, -1)) * (self.size_mm / self.samples) ** 2
        return found, areas.tolist()


def pressed_round(skin: Skin, names: Iterable[str], ways: Sequence[str] = WAYS[:1]) -> dict[str, Any]:
    """V of series by name and of natural reliefs, as `benchmarks.skin.plate_pressing.pressed` has them.

    Args:
        skin: of shape "round"; its force is that of every series.
        names: of series; "natural" and "force" are those of reliefs and of `FORCES_N`.
        ways: of V; those beyond the first are told under "WAY: NAME".
    """
    finger = RoundFinger(skin)
    found: dict[str, Any] = {"flat, mm2": finger.flat_mm2}
    for name in names:
        if name == "natural":
            felt, areas = finger.felt(natural_plates(), ways)
            found[name], found["natural, mm2"] = felt["V"], areas
        elif name == "force":
            weights, plates = dot_plates(DOT_MM, HIGH_MM, APART_MM)
            found[name] = [
                float(weights @ RoundFinger(replace(skin, force_n=force)).felt(plates)[0]["V"])
                for force in FORCES_N
            ]
        else:
            curves: dict[str, list[float]] = {way: [] for way in ways}
            for weights, plates in round_series(name):
                felt, _ = finger.felt(plates, ways)
                for way in ways:
                    curves[way].append(float(weights @ felt[way]))
            found[name] = curves["V"]
            found |= {f"{way}: {name}": curves[way] for way in ways if way != "V"}
    return found


def exploring(skin: Skin, ways: Sequence[str] = WAYS[:1]) -> dict[str, Any]:
    """V of the series that facts ask for at the force of a hand that explores, under "NAME, exploring"."""
    felt = pressed_round(replace(skin, force_n=EXPLORING_N), EXPLORED, ways)
    return {f"{name}, exploring": value for name, value in felt.items()}


def flat_exploring(skin: Skin) -> dict[str, Any]:
    """V of the series of `EXPLORED` that only new sources have, for a flat finger, as `exploring`."""
    found = {}
    inner = slice((ROUND_SAMPLES - SAMPLES) // 2, (ROUND_SAMPLES + SAMPLES) // 2)
    finger = replace(skin, force_n=EXPLORING_N)
    for name in EXPLORED[1:]:
        curve = []
        for weights, plates in round_series(name):
            heights = np.ascontiguousarray(plates[:, inner, inner], dtype=np.float32)
            felt = tactile.roughness(tactile.press(heights, PATCH_SIDE_MM, finger).strain)
            curve.append(float(weights @ felt.double().numpy()))
        found[f"{name}, exploring"] = curve
    return found
