"""Is the layer right under a round finger? Roughness by layer, corrected layer and finer elements.

python -m benchmarks.skin.round_truth            # what is not in the results yet; JSON and tables
python -m benchmarks.skin.round_truth --again    # all of it anew
"""

from __future__ import annotations

import resource
import time
from collections.abc import Callable
from dataclasses import asdict, replace
from itertools import combinations
from typing import Any

import numpy as np
import torch

from benchmarks.shared.common import again_given, load, machine, median_seconds, save, table
from benchmarks.skin.experiment_plates import DOT_MM, HIGH_MM, NATURAL, PHASES, dots, natural
from benchmarks.skin.operators import PITCH_MM, Felt, felt, on_patch, peak
from benchmarks.touch.round_tetrahedra import round_tetrahedra
from relief.ground.arrays import Array
from relief.ground.progress import say
from tactile.contact import solve_contact
from tactile.elements.round_pad import PadMesh, difference, round_pad_operator
from tactile.jnd import jnd_apart
from tactile.layer.cosine_layer import sliding_layer
from tactile.pressing import SkinOperator, rise_mm
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
MESHES = {
    "0.67 mm, waves of 1.33 mm": PadMesh(4.0 / 3.0, 2.0 / 3.0, 0.25, 1.4, 1.0),
    "0.5 mm, waves of 1.33 mm": PadMesh(4.0 / 3.0),
    "0.5 mm, waves of 1 mm (the default)": PadMesh(),
}
PATCHES_MM = (16.0, 20.0)
SPHERE_MM = 2.0
"""Radius of a sphere that is pushed into a finger."""
SPHERE_FORCES_N = (0.01, 0.02, 0.05, 0.1, 0.2, 0.4)
SPHERE_DEPTHS_MM = (0.5, 1.0, 1.5)
"""Depths below that at the least force."""
SPACINGS_MM = (1.3, 1.6, 1.9, 2.2, 2.5, 2.8, 3.2, 4.0)
TETRAHEDRA = Sizing(0.4, 0.8)
TETRAHEDRA_PITCH_MM = 1.0 / 3.0
"""Sampling of the check by tetrahedra: finer than their facets, contact creeps."""


def main() -> None:
    results: dict[str, Any] = {} if again_given(__doc__) else load("round_truth")
    parts: dict[str, Callable[[], Any]] = {
        "cost": cost,  # the first, so that the greatest memory is that of a build
        "reliefs": reliefs,
        "dots": spacings,
        "sphere": sphere,
        "patches": patches,
        "meshes": meshes,
        "tetrahedra": tetrahedra,
        "flat tetrahedra": flat_tetrahedra,
    }
    for name, measure in parts.items():
        if name not in results:
            say(name)
            results[name] = measure()
            save("round_truth", results | {"machine": machine()})
    for text in tables(results):
        print(text + "\n")


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


def spacings() -> dict[str, Any]:
    """Roughness of dots over their spacing, mean of three phases, and the spacing of the roughest."""
    plates = [dots(DOT_MM, HIGH_MM, apart, phase) for apart in SPACINGS_MM for phase in PHASES]
    heights = on_patch(np.array(plates), SIZE_MM)
    result: dict[str, Any] = {}
    for name, skin in FINGERS.items():
        exploring = replace(skin, force_n=FORCES_N[0])
        for body, operator in bodies(skin).items():
            rough = felt(operator, exploring, heights).roughness.reshape(len(SPACINGS_MM), -1).mean(1)
            top = peak(np.array(SPACINGS_MM), rough)
            result.setdefault(name, {})[body] = {"roughness": rough.tolist(), "peak_mm": top}
    return result


def sphere() -> dict[str, Any]:
    """Force of a sphere at depths below that at the least force, and the depths at each force."""
    samples = round(SIZE_MM / PITCH_MM)
    place = ((np.arange(samples) + 0.5) / samples - 0.5) * SIZE_MM
    below = np.maximum(SPHERE_MM**2 - place[:, None] ** 2 - place**2, 0.0)
    heights = torch.as_tensor(np.sqrt(below) - SPHERE_MM)
    result: dict[str, Any] = {}
    for name, skin in FINGERS.items():
        assert skin.radii_mm is not None
        shaped = heights - rise_mm(skin.radii_mm, heights, SIZE_MM)
        for body, operator in bodies(skin, finest=False).items():
            depths = []
            for force in SPHERE_FORCES_N:
                load = replace(skin, force_n=force).mean_pressure_mpa(SIZE_MM) / skin.young_modulus_mpa
                depths.append(float(solve_contact(operator, shaped, load).approach))
            sunk = np.array(depths) - depths[0]
            # Smooth on logarithms; the first, at which nothing is sunk, has none.
            forces = np.exp(
                np.interp(np.log(SPHERE_DEPTHS_MM), np.log(sunk[1:]), np.log(SPHERE_FORCES_N[1:]))
            )
            result.setdefault(name, {})[body] = {"depth_mm": depths, "force_n": forces.tolist()}
    return result


def meshes() -> dict[str, Any]:
    """Roughness of the reliefs at 1 N by coarser meshes."""
    heights, samples = on_patch(natural(), SIZE_MM), round(SIZE_MM / PITCH_MM)
    return {
        name: {
            kind: row_of(felt(round_pad_operator(skin, samples, SIZE_MM, mesh=mesh), skin_at(skin), heights))
            for kind, mesh in MESHES.items()
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


def cost() -> dict[str, Any]:
    """CPU seconds and memory of a build, size on disk, and seconds of a press beside the layer's."""
    skin = skin_at(FINGERS["0.5 mm of 0.35 over 0.03 MPa"])
    began = time.process_time()
    kept = difference(skin.at_unit_modulus(), (RADIUS_MM, RADIUS_MM), SIZE_MM, PadMesh(), (False, True))
    one = time.process_time() - began
    heights = on_patch(natural()[:1], SIZE_MM)[0]
    load = skin.mean_pressure_mpa(SIZE_MM) / skin.young_modulus_mpa
    seconds = {
        name: median_seconds(lambda body=body: solve_contact(body, heights, load), 5)  # type: ignore[misc]
        for name, body in bodies(skin, finest=False).items()
    }
    return {
        "mesh": asdict(PadMesh()),
        "build_cpu_s": 3.0 * one,
        "peak_gb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6,
        "numbers": {part: list(array.shape) for part, array in kept.items()},
        "press_s": seconds,
    }


def tables(results: dict[str, Any]) -> list[str]:
    """What the results show, in Markdown."""
    return [
        table(
            [
                "finger, force",
                "V of",
                "median",
                "largest",
                "V's ratio, JND: median",
                "largest",
                "area",
                "approach",
            ],
            _errors(results["reliefs"]),
        ),
        table(
            ["finger at 0.6 N", *(f"{body}, mm" for body in ("layer", "corrected", "truth"))],
            [[name, *(each["peak_mm"] for each in pads.values())] for name, pads in results["dots"].items()],
        ),
        table(
            ["force of a sphere at depth", "by", *(f"{depth:g} mm" for depth in SPHERE_DEPTHS_MM)],
            [
                [name, body, *found["force_n"]]
                for name, pads in results["sphere"].items()
                for body, found in pads.items()
            ],
        ),
        table(["finger at 1 N", "elements", "median", "largest"], _by_mesh(results)),
        table(
            ["finger at 1 N", "patch", "corrected, median", "largest", "layer's error"], _by_patch(results)
        ),
        table(["against tetrahedra", "median", "largest", "area", "approach"], _by_tetrahedra(results)),
    ]


def off(measured: dict[str, Any], exact: dict[str, Any]) -> Array:
    """(reliefs,) relative differences of roughness."""
    return np.divide(measured["roughness"], exact["roughness"]) - 1.0


def ratios_off(measured: dict[str, Any], exact: dict[str, Any]) -> Array:
    """(pairs,) differences, JND, of the ratio of roughness between two reliefs."""
    one, other = measured["roughness"], exact["roughness"]
    pairs = combinations(range(len(NATURAL)), 2)
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


def _by_mesh(results: dict[str, Any]) -> list[list[Any]]:
    return [
        [name, kind, *_spread(off(found, results["reliefs"][name]["1 N"]["truth"]))]
        for name, by_kind in results["meshes"].items()
        for kind, found in by_kind.items()
    ]


def _by_patch(results: dict[str, Any]) -> list[list[Any]]:
    rows = []
    for name, by_size in results["patches"].items():
        widest = by_size[f"{PATCHES_MM[-1]:g} mm"]["corrected"]
        for size, found in by_size.items():
            layer = percent(float(np.median(np.abs(off(found["layer"], found["corrected"])))))
            rows.append([name, size, *_spread(off(found["corrected"], widest)), layer])
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
