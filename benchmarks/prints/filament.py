"""G-code of PrusaSlicer as beads: seconds, memory, V beside a dense computation, and the sum of filament.

python -m benchmarks.prints.filament [NAME ...] [--again]     # NAME is part of "box, 0.2 mm"

Ten parts are sliced with four profiles, with `prusa-slicer` of the path. Each row is a process of its own. It
reads the G-code, presses on up to 32 places all over the part, whose mesh is the object without texture, and
presses anew on four of them, with heights by sphere tracing (`benchmarks.prints.dense_beads`) and 512 samples
along 10 mm in place of 256. Filament is added up a second time from the words of the file. Resumable:
results/filament.json keeps each row.
"""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from manifold3d import CrossSection, Manifold

from benchmarks.prints.dense_beads import dense_heights
from benchmarks.shared.common import DOCS, ROOT, kept, load, parser_of, publish, table
from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.verification.solids.bead_feel import BeadFeel, feel_of_beads
from optimize.verification.solids.mesh_feel import pressed
from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts
from relief.solids.filament.bead_surface import of_part
from relief.solids.filament.beads import Beads
from relief.solids.filament.gcode_reader import read_gcode
from relief.solids.filament.object_place import offset_of
from relief.solids.filament.sliced_shape import shape_of
from relief.solids.files import read_mesh
from relief.solids.meshes.crops import Cropper, reachable
from relief.solids.objects.table import OBJECTS
from retouch.verbs.evaluation import load_skin
from tactile.jnd import SMOOTH_BELOW
from tactile.quantities import ROUGHNESS

RESULT, COMMAND, PAGE = "filament", "benchmarks.prints.filament", DOCS / "evidence" / "printing.md"
RUNS = ROOT / "runs" / "filament"
SAMPLES, PLACES, COMPARED = 512, 32, 4
"""Samples along 10 mm of the dense computation; most places of a part, and those that it is compared at."""
COMMON = {"perimeters": 2, "fill-density": "15%", "fill-pattern": "grid", "first-layer-extrusion-width": 0}
COMMON |= {"top-solid-min-thickness": 0.7, "bottom-solid-min-thickness": 0.5, "skirts": 0}
"""Settings of all profiles, by the slicer's options; widths are left to the slicer."""
MADE: Mapping[str, Callable[[], Manifold]] = {
    "box": lambda: Manifold.cube((30.0, 30.0, 20.0)),
    "cone": lambda: Manifold.cylinder(20.0, 20.0, 6.0, 256),
    "tube": lambda: Manifold.cylinder(20.0, 15.0, 15.0, 256) - Manifold.cylinder(20.0, 12.0, 12.0, 256),
    "dome": lambda: Manifold.sphere(20.0, 256).trim_by_plane((0.0, 0.0, 1.0), 0.0),
    "wedge": lambda: Manifold.extrude(
        CrossSection([[(0.0, 0.0), (44.4, 0.0), (30.0, 14.4), (0.0, 14.4)]]), 30.0
    ).rotate((90.0, 0.0, 0.0)),
}
PARTS = ("box", "cone", "tube", "dome", "ball", "cylinder", "starfish", "frog", "curved", "bracelet")


def profile(layer_mm: float, nozzle_mm: float, fuzzy: tuple[float, float] | None = None) -> dict[str, Any]:
    """Options of the slicer; `fuzzy` is thickness and point distance, mm."""
    options = {**COMMON, "nozzle-diameter": nozzle_mm}
    options |= {"layer-height": layer_mm, "first-layer-height": layer_mm}
    if fuzzy is not None:
        skin = {"thickness": fuzzy[0], "point-dist": fuzzy[1]}
        options |= {"fuzzy-skin": "external", **{f"fuzzy-skin-{key}": mm for key, mm in skin.items()}}
    return options


PROFILES = {
    "0.2 mm": profile(0.2, 0.4),
    "0.1 mm": profile(0.1, 0.4),
    "0.3 mm, nozzle 0.6": profile(0.3, 0.6),
    "0.2 mm, fuzzy": profile(0.2, 0.4, (0.3, 0.8)),
}


def sliced(part: str, options: Mapping[str, Any], folder: Path = RUNS) -> tuple[Path, Path]:
    """The mesh of a part, and its G-code by PrusaSlicer."""
    mesh, gcode = folder / f"{part}.stl", folder / f"{part}.gcode"
    if part in MADE:
        made = MADE[part]().to_mesh64()
        body = Body(np.array(made.vert_properties[:, :3]), np.array(made.tri_verts, dtype=np.intp))
    else:
        body = OBJECTS[part].make()
    write_parts(mesh, [Part(part, body)])
    words = [word for key, value in options.items() for word in (f"--{key}", str(value))]
    command = ["prusa-slicer", "--export-gcode", *words, "-o", str(gcode), str(mesh)]
    subprocess.run(command, check=True, capture_output=True)
    return mesh, gcode


def counted(gcode: Path) -> tuple[int, float]:
    """Number of moves, and filament of those along X or Y that extrude, mm, from the words of the file."""
    moves, total, before, relative = 0, 0.0, 0.0, False
    for line in gcode.read_text().splitlines():
        name, *words = line.partition(";")[0].split() or [""]
        values = {word[0]: float(word[1:]) for word in words if name in ("G0", "G1", "G92")}
        moves += name in ("G0", "G1")
        relative = name == "M83" or (relative and name != "M82")
        after = values.get("E", 0.0 if relative else before)
        if name == "G1" and values.keys() & {"X", "Y"}:
            total += max(after - (0.0 if relative else before), 0.0)
        before = after
    return moves, total


def in_process(part: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """A row of the results, measured in this process."""
    mesh_file, gcode = sliced(part, options)
    skin, mesh, times = load_skin(DEFAULT_SKIN), read_mesh(mesh_file), [time.process_time()]
    read = read_gcode(gcode)
    times.append(time.process_time())
    (feel,) = feel_of_beads([read], skin, most=PLACES, without_texture=mesh)
    times.append(time.process_time())
    peak_kb = next(line for line in Path("/proc/self/status").read_text().split("\n") if "VmHWM" in line)
    moves, counted_mm = counted(gcode)
    return {
        "moves": moves,
        "read_s": times[1] - times[0],
        "feel_s": times[2] - times[1],
        "places": len(feel.crops),
        "gb": int(peak_kb.split()[1]) / 1e6,
        "roughness": {name: part.means[ROUGHNESS.name] for name, part in feel.by_region().items()},
        "filament_mm": sum(read.filament_mm.values()),
        "counted_mm": counted_mm,
        "header_mm": read.header_mm,
        "beside": beside_dense(read.beads.part(of_part(read.beads)), feel, mesh.body),
    }


def beside_dense(beads: Beads, feel: BeadFeel, body: Body) -> list[dict[str, Any]]:
    """V of Retouch and of the dense computation at some places of each region.

    Args:
        beads: of the part.
        feel: of Retouch, with the object's own curvature taken out.
        body: the object, over which heights along its normals are felt.
    """
    way = offset_of(shape_of(beads), body)[0]
    shapes = Cropper(Body(body.vertices + way, body.faces))
    order = sorted(range(len(feel.crops)), key=lambda n: feel.regions[:n].count(feel.regions[n]))
    rows, skin = [], load_skin(DEFAULT_SKIN)
    for number in order[:COMPARED]:
        frame, side_mm = feel.crops[number].frame, feel.crops[number].side_mm
        heights = dense_heights(beads, frame, side_mm, SAMPLES)
        shape = shapes.heights(frame, side_mm, SAMPLES, 6.0)
        with np.errstate(invalid="ignore"):
            slopes = np.gradient(shape, side_mm / SAMPLES)
            over = (heights - shape) / np.sqrt(1.0 + slopes[0] ** 2 + slopes[1] ** 2)
        there = (reachable(heights, side_mm)[0] > 0.0) & np.isfinite(over)
        alone = reachable(np.where(there, over, -np.inf), side_mm)[0]
        dense = pressed(alone[None], skin, "layer", side_mm)[0][ROUGHNESS.name]
        pair = [float(feel.values[ROUGHNESS.name][number]), float(dense[0])]
        rows.append({"region": feel.regions[number], "roughness": pair})
    return rows


def apart(pairs: list[list[float]]) -> tuple[float, float]:
    """Largest difference of pairs of V: in % of those from the floor on, and of those below it."""
    shares = [100.0 * abs(one / two - 1.0) for one, two in pairs if two >= SMOOTH_BELOW]
    below = [abs(one - two) for one, two in pairs if two < SMOOTH_BELOW]
    return max(shares, default=0.0), max(below, default=0.0)


def report(rows: Mapping[str, Mapping[str, Any]]) -> str:
    """A table of all rows."""
    cells = []
    for name, row in rows.items():
        felt = ", ".join(f"{region} {value:.4f}" for region, value in row["roughness"].items())
        above, below = apart([place["roughness"] for place in row["beside"]])
        off = [1e2 * abs(row["filament_mm"] / row[key] - 1.0) for key in ("counted_mm", "header_mm")]
        costs = f"{row['read_s']:.1f}", f"{row['feel_s']:.0f}", f"{row['gb']:.2f}"
        cells.append(
            (name, row["moves"], *costs, felt, f"{above:.2f} %; {below:.5f}", *(f"{one:.3f}" for one in off))
        )
    head = ("part, layers", "moves", "reading, CPU s", "pressing", "GB", "V")
    head += ("V off, above; below the floor", "filament off the sum, %", "off the header, %")
    return table(head, cells)


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", default=[""])
    parser.add_argument("--again", action="store_true")
    arguments = parser.parse_args()
    with ProcessPoolExecutor(1, get_context("spawn"), max_tasks_per_child=1) as pool:
        for part in PARTS:
            for name, options in PROFILES.items():
                row = f"{part}, {name}"
                if any(given in row for given in arguments.names):
                    kept(RESULT, "parts", row, pool.submit(in_process, part, options).result, arguments.again)
    publish(PAGE, "filament", COMMAND, report(load(RESULT)["parts"]))


if __name__ == "__main__":
    main()
