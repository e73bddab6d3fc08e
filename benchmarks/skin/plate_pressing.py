"""What a skin feels of every plate: mean roughness over the phases, and contact areas of natural reliefs."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

import tactile
from benchmarks.skin.experiment_plates import APART_MM, Series
from relief.ground.arrays import Array
from relief.ground.limits import PATCH_SIDE_MM
from tactile.skin import Skin

FORCES = (0.5, 1.0, 2.0)
"""Forces of the series "force", in units of the skin's own."""
EXPLORING_N = 0.6
"""Force of a hand that explores a texture, N: 0.5 to 0.65 (Smith 2002)."""


def pressed(skin: Skin, plates: list[Series], reliefs: Array) -> dict[str, Any]:
    """Roughness of every series, by name, in the order of its values; roughness and area of the reliefs.

    Args:
        skin: the finger.
        plates: every series.
        reliefs: (k, n, n) natural ones, mm.
    """
    found: dict[str, Any] = {}
    for one in plates:
        found[one.name] = _roughness(skin, one.heights)
        if one.name == "spacing":
            exploring = replace(skin, force_n=EXPLORING_N)
            found["spacing, exploring"] = _roughness(exploring, one.heights)
            usual = one.heights[[one.values.index(APART_MM)]]
            found["force"] = [
                *(_roughness(replace(skin, force_n=share * skin.force_n), usual)[0] for share in FORCES),
            ]
    touch = tactile.press(reliefs.astype(np.float32), skin=skin)
    found["natural"] = tactile.roughness(touch.strain).tolist()
    found["natural, mm2"] = tactile.contact_area(touch.gap).tolist()
    found["natural, share"] = touch.contact_fraction.tolist()
    return found


def _roughness(skin: Skin, heights: Array) -> list[float]:
    """Mean roughness of plates (values, phases, n, n) over the phases."""
    means = []
    for phases in heights.astype(np.float32):
        strain = tactile.press(phases, PATCH_SIDE_MM, skin).strain
        means.append(float(tactile.roughness(strain).double().mean()))
    return means
