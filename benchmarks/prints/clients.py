"""PrusaSlicer reads what Retouch writes: `results/clients.json`.

python -m benchmarks.prints.clients

The slicer states size, volume and repairs of each file and slices it for filament and for resin.
The resin layers of a plate, a picture each, are stacked back to heights, which are compared with the model of
the printer (`relief.printers`).
"""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

import retouch
from benchmarks.prints.prusa import PRINTER, Slicer, plate_heights
from benchmarks.shared.common import load, parser_of, publish, save, table
from mitsuba_scenes import find_texture
from relief.ground.arrays import Array
from relief.heightmap import HeightMap, load_height_map, save_heights_exr
from relief.printed import printed
from relief.solids.body import Body, Part, joined
from relief.solids.export.parts import write_parts
from relief.solids.export.plate_export import plate_mesh, repeated
from relief.solids.meshes.solid import volume_mm3
from relief.solids.objects.table import OBJECTS

OBJECT_NAMES = ("starfish", "slider", "frog")
GAP_MM = 3.0
PRINT = "-print.3mf"
"""End of the names of plates that are prints already, in flat pixels."""
FILM = 86
"""Pixels across the plates in which pictures are compared: one is a minute of arc wide, 40 cm away."""
SAMPLES = 64
"""Samples a pixel of these pictures."""
MESHES = (".3mf", ".stl", ".obj")
"""Formats that the slicer reads."""
KINDS = {
    "plate": "plates as 3MF, STL, OBJ",
    "pixels": "plates in flat pixels",
    "several": "several plates, tiles, a set",
    "object": "objects",
}
"""Kinds of files, in words."""
PRINTS = {"screen": "as designed", "model": "by the printer's model", "slicer": "as PrusaSlicer cuts"}
"""Kinds of prints, in words."""


def files(folder: Path, reliefs: Mapping[str, HeightMap]) -> dict[Path, Body]:
    """Write plates, tiles, two plates with places, and objects; returns what each file is to hold."""
    base = PRINTER.base_mm
    plates = {name: plate_mesh(read.heights, read.side_mm, base) for name, read in reliefs.items()}
    found: dict[Path, list[Part]] = {}
    for suffix in MESHES:
        for name, body in plates.items():
            found[folder / f"{name}{suffix}"] = [Part(name, body)]
    for name, read in reliefs.items():
        body = plate_mesh(model_of(read), read.side_mm, base, stepped=True)
        found[folder / f"{name}{PRINT}"] = [Part(name, body)]
    tile = load_height_map(find_texture("gravel-tile"))
    tiles = plate_mesh(repeated(tile.heights, (3, 3), "gravel-tile"), 3.0 * tile.side_mm, base)
    found[folder / "tiles.3mf"] = [Part("3 x 3 tiles", tiles)]
    beside = [
        Part(name, body, np.vstack([np.eye(3), [(10.0 + GAP_MM) * number, 0.0, base]]))
        for number, (name, body) in enumerate(plates.items())
    ]
    found[folder / "both.3mf"] = beside
    for name in OBJECT_NAMES:
        found[folder / f"{name}.3mf"] = [Part(name, OBJECTS[name].make())]
    for path, parts in found.items():
        write_parts(path, parts)
    return {path: joined(parts) for path, parts in found.items()}


def model_of(read: HeightMap) -> Array:
    """Heights (rows, cols) mm as the model of the printer has them."""
    return printed(read.heights, read.side_mm / read.heights.shape[1], PRINTER)


def sliced(slicer: Slicer, bodies: Mapping[Path, Body]) -> tuple[dict[str, Any], dict[str, Array]]:
    """What the slicer makes of each file; and heights of the 3MF plates by file, from resin layers."""
    found, heights = {}, {}
    for path, body in bodies.items():
        info = slicer.info(path)
        resin, solid = slicer.resin(path)
        size = np.ptp(body.vertices, axis=0)
        found[path.name] = {
            **info,
            "facets_written": len(body.faces),
            "volume_error_percent": 100.0 * (info["volume_mm3"] / volume_mm3(body) - 1.0),
            "size_error_mm": float(np.abs(size - info["size_mm"]).max()),
            "filament": slicer.filament(path),
            "resin": resin,
            "resin_volume_error_percent": 100.0
            * (float(solid.sum()) * PRINTER.pixel_mm**2 * PRINTER.layer_mm / volume_mm3(body) - 1.0),
        }
        if path.name.startswith("gravel") and path.suffix == ".3mf":
            heights[path.name] = plate_heights(solid, PRINTER.base_mm)
    return found, heights


def resin_prints(
    folder: Path, reliefs: Mapping[str, HeightMap], heights: Mapping[str, Array]
) -> dict[str, Any]:
    """The slicer's prints of both plates beside the model of the printer: heights, JND and pictures."""
    found: dict[str, Any] = {"printer": PRINTER.name, **PRINTER.numbers()}
    for name, read in reliefs.items():
        model, cut = model_of(read), heights[f"{name}.3mf"]
        apart = np.rint((cut - model) / PRINTER.layer_mm)
        apart_of_print = np.rint((heights[f"{name}{PRINT}"] - model) / PRINTER.layer_mm)
        found[name] = {
            "same_layer_percent": 100.0 * float(np.mean(apart == 0)),
            "within_a_layer_percent": 100.0 * float(np.mean(np.abs(apart) <= 1)),
            "mean_um": 1000.0 * PRINTER.layer_mm * float(np.abs(apart).mean()),
            "bias_um": 1000.0 * PRINTER.layer_mm * float(apart.mean()),
            "same_layer_of_print_percent": 100.0 * float(np.mean(apart_of_print == 0)),
        }
        for kind, each in (("slicer", cut), ("model", model)):
            save_heights_exr(folder / f"{name}-{kind}.exr", np.clip(each, 0.0, 3.0), read.side_mm)
        save_heights_exr(folder / f"{name}-screen.exr", read.heights, read.side_mm)
    for kind in ("screen", "model", "slicer"):
        pair = [folder / f"{name}-{kind}.exr" for name in reliefs]
        found[kind] = compared(pair)
    return found


def compared(pair: list[Path]) -> dict[str, Any]:
    """JND between two reliefs, and change of their pictures in % of the mean, by pixels of the film."""
    both = retouch.compare(*pair, samples=SAMPLES, defines={"resolution": str(FILM)}, quiet=True)
    change = {str(FILM): both["look"]["change_percent"]}
    return {"jnd_apart": both["jnd_apart"], "picture_change_percent_of_mean": change}


def gravel_rougher(run: Path) -> Path:
    """The directory of a new run of gravel with +2 JND."""
    fast = ["touch.jnd=2", "touch.model=quick", "look.model=auto"]
    retouch.optimize(retouch.run_from_scene("studio", str(find_texture("gravel")), fast), run, quiet=True)
    return run


def main() -> None:
    parser_of(__doc__).parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        run = gravel_rougher(folder / "run")
        reliefs = {
            "gravel": load_height_map(find_texture("gravel")),
            "gravel+2": load_height_map(find_texture(run)),
        }
        slicer = Slicer("prusa-slicer", folder)
        read, heights = sliced(slicer, files(folder, reliefs))
        resin = resin_prints(folder, reliefs, heights)
    save("clients", {"slicer": slicer.version, "files": read, "resin": resin})
    publish("fabrication", "clients", report(load("clients")))


def report(found: Mapping[str, Any]) -> str:
    """Text of docs/evidence/fabrication.md: files by kind, and how far two prints of gravel differ."""
    kinds = {kind: [each for name, each in found["files"].items() if kind_of(name) == kind] for kind in KINDS}
    rows = [
        (
            words,
            len(kinds[kind]),
            sum(each["manifold"] and not each["repairs"] for each in kinds[kind]),
            f"{max(abs(each['volume_error_percent']) for each in kinds[kind]):.4f}",
        )
        for kind, words in KINDS.items()
    ]
    head = ("kind of file", "files", "sound, no repairs", "volume off, % at most")
    apart = (
        f"{words} by {found['resin'][kind]['jnd_apart']:.2f} JND and "
        f"{found['resin'][kind]['picture_change_percent_of_mean'][str(FILM)]:.1f} %"
        for kind, words in PRINTS.items()
    )
    return f"{table(head, rows)}\n\nThe two differ {', '.join(apart)}."


def kind_of(name: str) -> str:
    """The kind of a file by its name."""
    if name.startswith(("both", "tiles", "set")):
        return "several"
    if name.startswith("gravel"):
        return "pixels" if PRINT in name or "mask" in name else "plate"
    return "object"


if __name__ == "__main__":
    main()
