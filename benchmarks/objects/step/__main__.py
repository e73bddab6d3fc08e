"""STEP parts of a CAD kernel, wrapped from STEP and from the same parts as coarse STL.

python -m benchmarks.objects.step [NAME ...] [--again]

Leather of 0.5 mm on 60,000 triangles, on a part of each so that some faces stay bare. The textured surface
before its displacement is compared with the formulas of the part's faces, at vertices where the relief is
whole; a free-form part, with triangles within 0.5 um. The STL has facets within 0.1 mm and 0.5 rad, what
CAD programs call medium, and differs in nothing else.
"""

import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import cascadio
import numpy as np

from benchmarks.shared.common import cpu_s, publish, rows_of, table
from relief.ground.arrays import Array
from relief.solids.body import Body, Part
from relief.solids.export.parts import as_written, write_parts
from relief.solids.files.glb_reader import read_glb
from relief.solids.files.mesh import read_mesh
from relief.solids.meshes.intersections import self_intersections
from relief.solids.meshes.neighbourhood import edge_pairs
from relief.solids.remeshing.nearest import NearestPoints
from retouch.verbs.objects.wrap_options import WrapOptions
from retouch.verbs.objects.wrap_task import task_of
from tests.relief.solids.files.exact_surfaces import SURFACES, distance

HERE = Path(__file__).parent
MASKS = {
    **{"knob": "z>8", "bracket": "x>10 | z>10", "bottle": "z>10", "ring": "x>0", "cone": "z>10"},
    **{"chamfers": "z>8", "pin": "z>10", "pair": "x<0", "inches": "x>0", "free_form": "y<15 & z>5"},
}
"""Where texture lies, by the name of the part."""
CHORD_MM, TURN = 0.1, 0.5
"""Largest distance, mm, and angle, rad, between facets of the STL and the surface."""
FINEST_MM = 5e-4
"""Largest distance of triangles from a free-form surface that others are compared with, mm."""
WHOLE = 0.999
"""Share of the relief from which it is whole."""
FACES = 60_000


def coarse(file: Path, folder: Path) -> Path:
    """The part of a STEP file as coarse STL, mm."""
    return write_parts(folder / f"{file.stem}.stl", [Part("", triangles(file, CHORD_MM, TURN))])


def triangles(file: Path, chord_mm: float, turn: float) -> Body:
    """The part of a STEP file in triangles within a distance, mm, and an angle, rad."""
    glb = cascadio.load(file.read_bytes(), "step", tol_linear=chord_mm, tol_angular=turn, use_parallel=False)
    parsed = read_glb(glb, file, cad=True)
    places, number = np.unique(1000.0 * parsed.vertices, axis=0, return_inverse=True)
    return Body(places, number.reshape(-1)[parsed.faces])


def apart(file: Path, points: Array) -> Array:
    """Distances (n,) of points (n, 3) from the exact surface of a part, mm."""
    if file.stem in SURFACES:
        return distance(file.stem, points)
    body = triangles(file, FINEST_MM, 0.05)
    nearest = NearestPoints(body, np.zeros(body.faces.shape, bool), 0.5)
    nearest.region[:] = 0
    start = np.zeros(len(points), np.int64)
    return np.asarray(np.linalg.norm(nearest.places(*nearest.at(points, start)) - points, axis=1))


def outcome(file: Path, step: Path) -> dict[str, Any]:
    """What comes out of a file, by the exact surface of its STEP file."""
    begun = cpu_s()
    task = task_of("leather-tile", file, WrapOptions(mask=MASKS[step.stem], faces=FACES, relief_mm=0.5))
    with tempfile.TemporaryDirectory() as folder:
        written = partial(as_written, suffix=".stl")
        wrapped = task.wrapped(task.settings, written)
        seconds = cpu_s() - begun
        out = write_parts(Path(folder) / "out.stl", [Part("", wrapped.body)])
        body = read_mesh(out).body
    whole = wrapped.textured > WHOLE
    bare = wrapped.body.vertices[wrapped.textured == 0.0]
    away = 1000.0 * apart(step, wrapped.original.vertices[whole])
    return {
        "facets": len(task.mesh.body.faces),
        "faces": len(body.faces),
        "largest_um": float(away.max()),
        "share_95_um": float(np.quantile(away, 0.95)),
        "bare_um": float(1000.0 * apart(step, bare).max()),
        "farthest_um": 1000.0 * wrapped.base.mesh.farthest_mm,
        "closed": 2 * len(edge_pairs(body.faces)) == 3 * len(body.faces),
        "crossings": self_intersections(body),
        "cpu_s": seconds,
    }


def compared(name: str) -> dict[str, Any]:
    """What comes out of a part's STEP file, and of the same part as coarse STL."""
    step = HERE / f"{name}.step"
    with tempfile.TemporaryDirectory() as folder:
        return {"step": outcome(step, step), "stl": outcome(coarse(step, Path(folder)), step)}


def main() -> None:
    measures = {name: partial(compared, name) for name in MASKS}
    rows = rows_of(__doc__, "step", "parts", measures)
    publish("objects", "step", summary(rows))


def summary(parts: dict[str, Any]) -> str:
    """Distances of the textured surface and of bare facets from the exact surface, over all parts."""
    rows = []
    for kind in ("step", "stl"):
        some = [row[kind] for row in parts.values()]
        whole = f"{sum(row['closed'] and not row['crossings'] for row in some)} of {len(some)}"
        away = (max(row[key] for row in some) for key in ("share_95_um", "largest_um", "bare_um"))
        rows.append(
            (kind.upper(), whole, *(f"{each:.1f}" for each in away), f"{max(r['cpu_s'] for r in some):.0f}")
        )
    head = ("read from", "closed, without crossings", "95 %, at most, µm", "largest, µm", "bare corners, µm")
    return table((*head, "CPU s, most"), rows)


if __name__ == "__main__":
    main()
