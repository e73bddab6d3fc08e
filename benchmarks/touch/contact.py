"""Models of touch beside the finest: V and contact area of the reference, of the layer, of elements alone.

python -m benchmarks.touch.contact [PART ...] [--again]

Reliefs are 128 x 128 (`benchmarks.touch.pressed_reliefs`), V over all offsets, float64. The finest model is
the reference with a node at every pixel.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from benchmarks.shared.common import publish, rows_of, table
from benchmarks.touch.bare_elements import bare_elements
from benchmarks.touch.pressed_reliefs import SIDE, SIZE_MM, many, twelve
from benchmarks.touch.relief_pressing import SKIN, Measured, compared, measure, resampled, stacked
from tactile.elements.finite_elements import finite_element_operator
from tactile.layer.elastic_layer import elastic_layer_operator
from tactile.touch_limits import FEM_MESH

MESHES = (16, 32, 48, 64, 96, 128)
FINEST, FINER = MESHES[-1], 160
BARE = (32, 64, 96, 128)
MANY = 208


def main() -> None:
    results = rows_of(__doc__, "contact", None, PARTS)
    publish("touch", "models", as_text(results))


def by_elements(mesh: int) -> Measured:
    """The twelve reliefs by the reference with so many nodes a side."""
    return measure(finite_element_operator(SKIN, SIDE, SIZE_MM, mesh=mesh), stacked(twelve()))


def meshes() -> list[dict[str, Any]]:
    """The reference by its mesh, contact always at 128 x 128."""
    truth = by_elements(FINEST)
    return [{"nodes a side": mesh} | compared(by_elements(mesh), truth) for mesh in MESHES]


def finer() -> list[dict[str, Any]]:
    """The finest mesh of the others against one that is finer than the pixels."""
    return [{"nodes a side": FINEST, "against": FINER} | compared(by_elements(FINEST), by_elements(FINER))]


def bare() -> list[dict[str, Any]]:
    """Elements alone, contact at their own nodes, against the reference on the same grid."""
    rows = []
    for nodes in BARE:
        heights = resampled(stacked(twelve()), nodes)
        truth = measure(finite_element_operator(SKIN, nodes, SIZE_MM, mesh=nodes), heights)
        alone = measure(bare_elements(SKIN, nodes, SIZE_MM), heights)
        rows.append({"nodes a side": nodes} | compared(alone, truth))
    return rows


def many_reliefs() -> dict[str, Any]:
    """The layer model against the finest reference, relief by relief."""
    reliefs = many(MANY)
    truth = measure(finite_element_operator(SKIN, SIDE, SIZE_MM, mesh=FINEST), stacked(reliefs))
    layer = measure(elastic_layer_operator(SKIN, SIDE, SIZE_MM), stacked(reliefs))
    return {
        "names": list(reliefs),
        "reference": {"V": truth.roughness.tolist(), "A": truth.area.tolist()},
        "layer": {"V": layer.roughness.tolist(), "A": layer.area.tolist()},
    }


def as_text(results: dict[str, Any]) -> str:
    """Median and worst deviation of V and contact area, model by model."""
    keys = [f"{quantity} {which} %" for quantity in "VA" for which in ("median", "worst")]
    of_mesh = {row["nodes a side"]: row for row in results["meshes"]}
    reference = f"reference, {FINEST} nodes a side"
    rows = [
        [f"reference, {FEM_MESH} nodes a side", reference, 12, *(of_mesh[FEM_MESH][key] for key in keys)],
        [reference, f"reference, {FINER} nodes a side", 12, *(results["finer"][0][key] for key in keys)],
        ["`layer`", reference, MANY, *deviations(results["many"])],
        ["elements alone, 64 nodes", "reference, 64 nodes", 12, *(results["bare"][1][key] for key in keys)],
    ]
    heads = ("V, median %", "V, worst %", "contact area, median %", "contact area, worst %")
    return table(("model", "against", "reliefs", *heads), rows)


def deviations(result: dict[str, Any]) -> list[float]:
    """Median and worst deviation of the layer's V and contact area over the reliefs, %."""
    found = []
    for key in ("V", "A"):
        off = 100.0 * np.abs(np.array(result["layer"][key]) / np.array(result["reference"][key]) - 1.0)
        found += [float(np.median(off)), float(off.max())]
    return found


PARTS = {"meshes": meshes, "finer": finer, "bare": bare, "many": many_reliefs}


if __name__ == "__main__":
    main()
