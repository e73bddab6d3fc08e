"""G-code of PrusaSlicer as beads: seconds, memory, V beside a dense computation, and the sum of filament.

python -m benchmarks.prints.filament [NAME ...] [--again]     # with prusa-slicer of the path

Ten parts are sliced with four profiles. Each row is a process of its own. It reads the G-code, presses on up
to 32 places of the part, whose mesh is the object without texture, and presses anew on some of them,
with heights by sphere tracing (`tests.relief.solids.dense_beads`) and 512 samples along 10 mm, not 256.
Filament is added up a second time from the words of the file.
"""

from __future__ import annotations

import re
import resource
import subprocess
import time
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from itertools import product
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
from manifold3d import CrossSection, Manifold

from benchmarks.shared.common import ROOT, publish, rows_of, table
from optimize.verification.solids.bead_feel import BeadFeel, feel_of_beads
from optimize.verification.solids.mesh_feel import pressed
from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts
from relief.solids.filament.beads import SlicedPart
from relief.solids.filament.gcode_reader import read_gcode
from relief.solids.filament.object_place import offset_of
from relief.solids.files.mesh import read_mesh
from relief.solids.meshes.crops import Cropper, reachable
from relief.solids.objects.table import OBJECTS
from tactile.jnd import SMOOTH_BELOW
from tactile.skin import Skin
from tests.relief.solids.dense_beads import dense_heights

RESULT = "filament"
RUNS = ROOT / "runs" / "filament"
SAMPLES, PLACES, COMPARED = 512, 32, 3
"""Samples along 10 mm of the dense computation; most places of a part, and those that it is compared at."""
COMMON = (
    "--perimeters 2 --fill-density 15% --fill-pattern grid --first-layer-extrusion-width 0 --skirts 0 "
    "--top-solid-min-thickness 0.7 --bottom-solid-min-thickness 0.5"
)
"""Options of the slicer in all profiles, which leave widths to the slicer."""
WEDGE = CrossSection([[(0.0, 0.0), (44.4, 0.0), (30.0, 14.4), (0.0, 14.4)]])
MADE = {
    "box": Manifold.cube((30.0, 30.0, 20.0)),
    "cone": Manifold.cylinder(20.0, 20.0, 6.0, 256),
    "tube": Manifold.cylinder(20.0, 15.0, 15.0, 256) - Manifold.cylinder(20.0, 12.0, 12.0, 256),
    "dome": Manifold.sphere(20.0, 256).trim_by_plane((0.0, 0.0, 1.0), 0.0),
    "wedge": Manifold.extrude(WEDGE, 30.0).rotate((90.0, 0.0, 0.0)),
}
PARTS = ("box", "cone", "tube", "dome", "ball", "cylinder", "starfish", "frog", "curved", "bracelet")


def profile(layer_mm: float, nozzle_mm: float, fuzzy: tuple[float, float] | None = None) -> str:
    """Options of the slicer; `fuzzy` is thickness and point distance, mm."""
    layers = f"--nozzle-diameter {nozzle_mm} --layer-height {layer_mm} --first-layer-height {layer_mm}"
    if fuzzy is None:
        return layers
    return (
        f"{layers} --fuzzy-skin external --fuzzy-skin-thickness {fuzzy[0]} --fuzzy-skin-point-dist {fuzzy[1]}"
    )


PROFILES = {
    "0.2 mm": profile(0.2, 0.4),
    "0.1 mm": profile(0.1, 0.4),
    "0.3 mm, nozzle 0.6": profile(0.3, 0.6),
    "0.2 mm, fuzzy": profile(0.2, 0.4, (0.3, 0.8)),
}


def sliced(part: str, options: str) -> tuple[Path, Path]:
    """The mesh of a part, and its G-code by PrusaSlicer; the next slice of the part replaces both files."""
    mesh, gcode = RUNS / f"{part}.stl", RUNS / f"{part}.gcode"
    if part in MADE:
        made = MADE[part].to_mesh64()
        body = Body(np.array(made.vert_properties[:, :3]), np.array(made.tri_verts, dtype=np.intp))
    else:
        body = OBJECTS[part].make()
    write_parts(mesh, [Part(part, body)])
    words = ["prusa-slicer", "--export-gcode", *COMMON.split(), *options.split(), "-o", str(gcode), str(mesh)]
    subprocess.run(words, check=True, capture_output=True)
    return mesh, gcode


def counted(text: str) -> float:
    """Filament of moves along X or Y that extrude, mm, from the words of G-code with absolute lengths."""
    total = before = 0.0
    for name, words, length in re.findall(r"^(G1|G92) ([^;\n]*?)E(-?[\d.]+)", text, re.MULTILINE):
        if name == "G1" and re.search("[XY]", words):
            total += max(float(length) - before, 0.0)
        before = float(length)
    return total


def measured(part: str, options: str) -> dict[str, Any]:
    """A row of the table, measured in this process; V is of Retouch."""
    mesh_file, gcode = sliced(part, options)
    mesh, times = read_mesh(mesh_file), [time.process_time()]
    read = read_gcode(gcode)
    times.append(time.process_time())
    (feel,) = feel_of_beads([read], Skin(), most=PLACES, without_texture=mesh)
    times.append(time.process_time())
    gb, text = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6, gcode.read_text()
    felt = (f"{region} {part.means['roughness']:.4f}" for region, part in feel.by_region().items())
    above, below = apart(beside_dense(read, feel, mesh.body))
    filament = sum(read.filament_mm.values())
    return {
        "moves": text.count("\nG1 "),
        "reading, CPU s": times[1] - times[0],
        "pressing, CPU s": times[2] - times[1],
        "GB": gb,
        "V": ", ".join(felt),
        "V off, %": above,
        "V off below the floor": below,
        "filament off the sum, %": 100.0 * abs(filament / counted(text) - 1.0),
        "off the header, %": 100.0 * abs(filament / (read.header_mm or np.nan) - 1.0),
    }


def beside_dense(read: SlicedPart, feel: BeadFeel, body: Body) -> list[list[float]]:
    """V of Retouch and of the dense computation at some places of all regions, over an object."""
    beads = read.beads.of_part
    shapes = Cropper(Body(body.vertices + offset_of(feel.body, body), body.faces))
    order = sorted(range(len(feel.crops)), key=lambda n: feel.regions[:n].count(feel.regions[n]))
    pairs = []
    for number in order[:COMPARED]:
        frame, side_mm = feel.crops[number].frame, feel.crops[number].side_mm
        heights = dense_heights(beads, frame, side_mm, SAMPLES)
        shape = shapes.heights(frame, side_mm, SAMPLES, 6.0)
        with np.errstate(invalid="ignore"):
            down, across = np.gradient(shape, side_mm / SAMPLES)
            over = (heights - shape) / np.sqrt(1.0 + down**2 + across**2)
        there = (reachable(heights, side_mm)[0] > 0.0) & np.isfinite(over)
        alone = reachable(np.where(there, over, -np.inf), side_mm)[0]
        dense = pressed(alone[None], Skin(), "layer", side_mm)[0]["roughness"][0]
        pairs.append([float(feel.values["roughness"][number]), float(dense)])
    return pairs


def apart(pairs: Sequence[Sequence[float]]) -> tuple[float, float]:
    """Largest difference of pairs of V: in % of those from the floor on, and of those below it."""
    shares = [100.0 * abs(one / two - 1.0) for one, two in pairs if two >= SMOOTH_BELOW]
    below = [abs(one - two) for one, two in pairs if two < SMOOTH_BELOW]
    return max(shares, default=0.0), max(below, default=0.0)


def in_process(part: str, options: str) -> dict[str, Any]:
    """A row of the table, measured in a process of its own."""
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        return pool.submit(measured, part, options).result()


def main() -> None:
    measures = {
        f"{part}, {name}": partial(in_process, part, options)
        for part, (name, options) in product(PARTS, PROFILES.items())
    }
    rows = rows_of(__doc__, RESULT, "parts", measures)
    publish("fabrication", "filament", summary(rows))


def summary(found: dict[str, dict[str, Any]]) -> str:
    """Parts by profile: what reading and pressing cost at most, and the largest differences."""
    rows = []
    for name in PROFILES:
        some = [found[f"{part}, {name}"] for part in PARTS]
        rows.append((name, *(max(row[key] for row in some) for key in SHOWN)))
    return table(("layers", *SHOWN), rows)


SHOWN = ("moves", "reading, CPU s", "pressing, CPU s", "GB", "V off, %")
"""Columns of the table: the largest numbers of all parts."""


if __name__ == "__main__":
    main()
