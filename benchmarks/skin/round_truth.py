"""Is the layer right under a round finger? Roughness by layer, corrected layer and finer elements.

python -m benchmarks.skin.round_truth [PART ...] [--again]
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np

from benchmarks.bundled.textures import TEXTURES
from benchmarks.shared.common import publish, rows_of, table
from benchmarks.skin.operators import PITCH_MM, Felt, felt, on_patch
from benchmarks.touch.round_tetrahedra import round_tetrahedra
from mitsuba_scenes import find_texture
from relief.ground.arrays import Array
from relief.heightmap import load_heights
from tactile.elements.round_pad import PadMesh, round_pad_operator
from tactile.jnd import jnd_apart
from tactile.layer.cosine_layer import sliding_layer
from tactile.pressing import SkinOperator
from tactile.skin import Skin
from tactile.unstructured.meshing import Sizing

RADIUS_MM, THICKNESS_MM, DEPTH_MM = 8.0, 4.0, 0.75
SIZE_MM = 16.0
FINGERS = {
    "0.5 mm of 0.35 over 0.03 MPa": Skin(
        0.03,
        thickness_mm=THICKNESS_MM,
        depth_mm=DEPTH_MM,
        layers=((0.5, 0.35),),
        shape="round",
        radius_mm=RADIUS_MM,
    ),
    "0.05 MPa": Skin(0.05, thickness_mm=THICKNESS_MM, depth_mm=DEPTH_MM, shape="round", radius_mm=RADIUS_MM),
}
FORCES_N = (0.6, 1.0)
TRUTH = PadMesh(2.0 / 3.0, 0.4, 0.2, 1.25, 0.6)
"""Mesh that the others are judged by."""
PATCHES_MM = (16.0, 20.0)
HEAD = [
    *("finger, force", "by", "V, median", "largest", "V's ratio, JND: median", "largest"),
    *("flat area", "approach"),
]
TETRAHEDRA = Sizing(0.4, 0.8)
TETRAHEDRA_PITCH_MM = 1.0 / 3.0
"""Sampling of the check by tetrahedra: finer than their facets, contact creeps."""


def main() -> None:
    measures: dict[str, Callable[[], Any]] = {
        "reliefs": reliefs,
        "patches": patches,
        "tetrahedra": tetrahedra,
        "flat tetrahedra": flat_tetrahedra,
    }
    results = rows_of(__doc__, "round_truth", None, measures)
    publish("touch", "round", table(HEAD, _errors(results["reliefs"])))
    publish("touch", "tetrahedra", table(["compared", *HEAD[2:4], *HEAD[6:]], _by_tetrahedra(results)))


def natural() -> Array:
    """(textures, n, n) heights of the bundled textures, mm."""
    return np.stack([load_heights(find_texture(name)) for name in sorted(TEXTURES)])


def bodies(skin: Skin, size: float = SIZE_MM, finest: bool = True) -> dict[str, SkinOperator]:
    """Operators of a finger by name."""
    samples = round(size / PITCH_MM)
    found: dict[str, SkinOperator] = {
        "layer": sliding_layer(skin.at_unit_modulus(), samples, size),
        "corrected": round_pad_operator(skin, samples, size),
    }
    if finest:
        found["truth"] = round_pad_operator(skin, samples, size, mesh=TRUTH)
    return found


def row_of(found: Felt) -> dict[str, Any]:
    """Touch measures as the results have them."""
    return {
        "roughness": found.roughness.tolist(),
        "area_mm2": found.flat_area_mm2,
        "approach_mm": found.flat_approach_mm,
    }


def reliefs() -> dict[str, Any]:
    """Roughness of the bundled reliefs by finger, force and operator."""
    heights = on_patch(natural(), SIZE_MM)
    return {
        name: {
            f"{force:g} N": {
                body: row_of(felt(operator, replace(skin, force_n=force), heights))
                for body, operator in bodies(skin).items()
            }
            for force in FORCES_N
        }
        for name, skin in FINGERS.items()
    }


def skin_at(skin: Skin) -> Skin:
    """The finger at its larger force."""
    return replace(skin, force_n=FORCES_N[1])


def patches() -> dict[str, Any]:
    """Roughness of the reliefs at 1 N on wider patches."""
    return {
        name: {
            f"{size:g} mm": {
                body: row_of(felt(operator, skin_at(skin), on_patch(natural(), size)))
                for body, operator in bodies(skin, size, finest=False).items()
            }
            for size in PATCHES_MM
        }
        for name, skin in FINGERS.items()
    }


def tetrahedra() -> dict[str, Any]:
    """Roughness of the reliefs to the finger of one modulus at 1 N, by tetrahedra and by the others."""
    skin = skin_at(FINGERS["0.05 MPa"])
    samples = round(SIZE_MM / TETRAHEDRA_PITCH_MM)
    heights = on_patch(natural(), SIZE_MM, TETRAHEDRA_PITCH_MM)
    operators: dict[str, SkinOperator] = {
        "layer": sliding_layer(skin.at_unit_modulus(), samples, SIZE_MM),
        "corrected": round_pad_operator(skin, samples, SIZE_MM),
        "tetrahedra": round_tetrahedra(skin, samples, SIZE_MM, TETRAHEDRA),
    }
    return {name: row_of(felt(operator, skin, heights)) for name, operator in operators.items()}


def flat_tetrahedra() -> dict[str, Any]:
    """The same by tetrahedra of a flat pad, whose exact answer is the layer: the error of the tetrahedra."""
    skin = skin_at(FINGERS["0.05 MPa"])
    samples = round(SIZE_MM / TETRAHEDRA_PITCH_MM)
    operator = round_tetrahedra(skin, samples, SIZE_MM, TETRAHEDRA, flat=True)
    return row_of(felt(operator, skin, on_patch(natural(), SIZE_MM, TETRAHEDRA_PITCH_MM)))


def off(measured: dict[str, Any], exact: dict[str, Any]) -> Array:
    """(reliefs,) relative differences of roughness."""
    return np.divide(measured["roughness"], exact["roughness"]) - 1.0


def ratios_off(measured: dict[str, Any], exact: dict[str, Any]) -> Array:
    """(pairs,) differences, JND, of the ratio of roughness between two reliefs."""
    one, other = measured["roughness"], exact["roughness"]
    pairs = combinations(range(len(TEXTURES)), 2)
    return np.array([abs(jnd_apart(one[a], one[b]) - jnd_apart(other[a], other[b])) for a, b in pairs])


def percent(share: float) -> str:
    return f"{100.0 * share:.1f} %"


def _spread(errors: Array) -> list[str]:
    return [percent(float(np.median(np.abs(errors)))), percent(float(np.abs(errors).max()))]


def _contact(measured: dict[str, Any], exact: dict[str, Any]) -> list[str]:
    return [f"{100.0 * (measured[key] / exact[key] - 1.0):+.1f} %" for key in ("area_mm2", "approach_mm")]


def _errors(found: dict[str, Any]) -> list[list[Any]]:
    rows = []
    for name, forces in found.items():
        for force, by_body in forces.items():
            exact = by_body["truth"]
            for body in ("layer", "corrected"):
                jnd = ratios_off(by_body[body], exact)
                spread = [f"{np.median(jnd):.2f}", f"{jnd.max():.2f}"]
                row = [f"{name}, {force}", body, *_spread(off(by_body[body], exact)), *spread]
                rows.append([*row, *_contact(by_body[body], exact)])
    return rows


def _by_tetrahedra(results: dict[str, Any]) -> list[list[Any]]:
    found = results["tetrahedra"]
    flat = results["flat tetrahedra"]
    curved = {
        key: np.divide(found["tetrahedra"][key], flat[key]) * found["layer"][key]
        for key in ("roughness", "area_mm2", "approach_mm")
    }
    compared = {
        "layer, flat tetrahedra": (found["layer"], flat),
        "corrected, round tetrahedra": (found["corrected"], found["tetrahedra"]),
        "corrected, layer times round over flat tetrahedra": (found["corrected"], curved),
    }
    return [[name, *_spread(off(*pair)), *_contact(*pair)] for name, pair in compared.items()]


if __name__ == "__main__":
    main()
