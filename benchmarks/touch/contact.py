"""Every model of touch: what it costs, and how far it is from the finest.

python -m benchmarks.touch.contact           # every part that is not in the results yet
python -m benchmarks.touch.contact many      # one part: meshes, finer, elastic_layer, bare, many,
                                             # tetrahedra, fingertips
python -m benchmarks.touch.contact --again many

Reliefs are 128 x 128 (`benchmarks.touch.pressed_reliefs`), V over all offsets, float64. The finest model is
the reference with a node at every pixel. Builds run in a process and a cache folder of their own.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import torch

from benchmarks.shared.common import load, machine, parser_of, save, table
from benchmarks.touch.pressed_reliefs import SIDE, SIZE_MM, many, twelve
from benchmarks.touch.relief_pressing import SKIN, Array, Measured, compared, measure, resampled, stacked
from benchmarks.touch.unstructured import fingertips, tetrahedra
from tactile.elements.finite_elements import finite_element_operator
from tactile.layer.elastic_layer import elastic_layer_operator

MESHES = (16, 32, 48, 64, 96, 128)
FINEST = MESHES[-1]
FINER = 160
BARE = (32, 64, 96, 128)
COARSE = (8, 16, 24, 32, 48)
MANY = 208


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("parts", nargs="*", default=list(PARTS))
    parser.add_argument("--again", action="store_true")
    parser.add_argument("--build", type=int, help="build one mesh in this process and print what it took")
    arguments = parser.parse_args()
    if arguments.build:
        print(json.dumps(build(arguments.build)))
        return
    results = load("contact")
    results["machine"] = machine()
    for name in arguments.parts:
        if arguments.again or name not in results:
            results[name] = PARTS[name]()
            save("contact", results)
        print(f"\n{name}\n{as_table(name, results[name])}", flush=True)


def build(mesh: int) -> dict[str, float]:
    """Seconds and peak memory of building the reference."""
    began = time.perf_counter()
    finite_element_operator(SKIN, SIDE, SIZE_MM, mesh=mesh)
    seconds = time.perf_counter() - began
    return {"build s": seconds, "peak GB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6}


def built_apart(mesh: int) -> dict[str, float]:
    """`build` in a process and a cache folder of its own."""
    with tempfile.TemporaryDirectory() as folder:
        done = subprocess.run(
            [sys.executable, "-m", "benchmarks.touch.contact", "--build", str(mesh)],
            env=os.environ | {"RETOUCH_CACHE": folder},
            capture_output=True,
            check=True,
            text=True,
        )
    built: dict[str, float] = json.loads(done.stdout)
    return built


def finest() -> Measured:
    return measure(finite_element_operator(SKIN, SIDE, SIZE_MM, mesh=FINEST), stacked(twelve()))


def meshes() -> list[dict[str, Any]]:
    """The reference by its mesh, contact always at 128 x 128."""
    rows, truth = [], finest()
    for mesh in MESHES:
        coarser = measure(finite_element_operator(SKIN, SIDE, SIZE_MM, mesh=mesh), stacked(twelve()))
        rows.append({"nodes a side": mesh} | built_apart(mesh) | compared(coarser, truth))
    return rows


def finer() -> list[dict[str, Any]]:
    """The finest mesh of the others against one that is finer than the pixels."""
    truth = measure(finite_element_operator(SKIN, SIDE, SIZE_MM, mesh=FINER), stacked(twelve()))
    against = {"nodes a side": FINEST, "against": FINER}
    return [against | compared(finest(), truth)]


def elastic_layer() -> list[dict[str, Any]]:
    """The layer model by its coarse mesh."""
    truth = finest()
    return [
        {"nc": coarse}
        | compared(
            measure(elastic_layer_operator(SKIN, SIDE, SIZE_MM, torch.float64, coarse), stacked(twelve())),
            truth,
        )
        for coarse in COARSE
    ]


def bare() -> list[dict[str, Any]]:
    """Elements alone, contact at their own nodes, against the reference on the same grid."""
    rows = []
    for nodes in BARE:
        heights = resampled(stacked(twelve()), nodes)
        truth = measure(finite_element_operator(SKIN, nodes, SIZE_MM, mesh=nodes), heights)
        alone = measure(finite_element_operator(SKIN, nodes, SIZE_MM, mesh=nodes, exact_layer=False), heights)
        rows.append({"nodes a side": nodes} | compared(alone, truth))
    return rows


def many_reliefs() -> dict[str, Any]:
    """The layer model against the finest reference, relief by relief."""
    reliefs = many(MANY)
    truth = measure(finite_element_operator(SKIN, SIDE, SIZE_MM, mesh=FINEST), stacked(reliefs))
    layer = measure(elastic_layer_operator(SKIN, SIDE, SIZE_MM), stacked(reliefs))
    return {
        "names": list(reliefs),
        "height_mm": [float(h.max()) for h in reliefs.values()],
        "reference": {"V": truth.roughness.tolist(), "A": truth.area.tolist()},
        "fraction": truth.fraction.tolist(),
        "layer": {"V": layer.roughness.tolist(), "A": layer.area.tolist()},
    }


def as_table(name: str, result: Any) -> str:
    """Markdown of one part."""
    if name == "many":
        return distribution(result)
    if not result:
        return "not installed"
    return table(list(result[0]), [list(row.values()) for row in result])


def deviations(result: dict[str, Any]) -> tuple[Array, Array]:
    """|V| and |A| deviations of the layer model in %, relief by relief."""
    v, a = (
        100.0 * np.abs(np.array(result["layer"][key]) / np.array(result["reference"][key]) - 1.0)
        for key in ("V", "A")
    )
    return v, a


def distribution(result: dict[str, Any]) -> str:
    """Quantiles by kind of relief, and the worst."""
    v, a = deviations(result)
    kinds = np.array([name.rsplit(" ", 1)[0] for name in result["names"]])
    head = ("reliefs", "count", "V median %", "V 95 %", "V worst %", "A median %", "A 95 %", "A worst %")
    rows: list[list[Any]] = []
    for kind in ("all", *dict.fromkeys(kinds)):
        here = np.ones(len(v), dtype=bool) if kind == "all" else kinds == kind
        row: list[Any] = [kind, int(here.sum())]
        for values in (v[here], a[here]):
            row += [float(np.median(values)), float(np.percentile(values, 95)), float(values.max())]
        rows.append(row)
    worst = [
        [
            result["names"][i],
            result["height_mm"][i],
            result["reference"]["V"][i],
            result["fraction"][i],
            v[i],
            a[i],
        ]
        for i in np.argsort(v)[::-1][:6]
    ]
    worst_head = ("worst", "height mm", "V", "in contact", "V off %", "A off %")
    return table(head, rows) + "\n\n" + table(worst_head, worst)


PARTS: dict[str, Callable[[], Any]] = {
    "meshes": meshes,
    "finer": finer,
    "elastic_layer": elastic_layer,
    "bare": bare,
    "many": many_reliefs,
    "tetrahedra": tetrahedra,
    "fingertips": fingertips,
}


if __name__ == "__main__":
    main()
