"""Programs that read what Retouch writes: PrusaSlicer, and Blender if there is one.

python -m benchmarks.prints.clients [--blender PYTHON]

With `--blender` and the Python of an environment that has `bpy`, Blender reads files, too. Writes
`results/clients.json`.

The slicer tells what it holds of each file and slices it for filament and for resin. The resin layers of a
plate, a picture each, are stacked back to heights, which are compared with the model of the printer
(`relief.printers`).
"""

from __future__ import annotations

import json
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.ndimage import map_coordinates

import retouch
from benchmarks.prints.prusa import PRINTER, TIME_LIMIT_S, Slicer, plate_heights
from benchmarks.shared.common import parser_of, save, table
from mitsuba_scenes import find_texture
from relief.ground.arrays import Array
from relief.heightmap import HeightMap, load_height_map, save_heights_exr, save_heights_png
from relief.printed import printed
from relief.solids.body import Body, Part, joined
from relief.solids.export.parts import write_parts
from relief.solids.export.plate_export import plate_mesh, repeated
from relief.solids.files import read_mesh
from relief.solids.meshes.solid import volume_mm3
from relief.solids.objects.table import OBJECTS

OBJECT_NAMES = ("starfish", "slider", "frog")
GAP_MM = 3.0
PRINT = "-print.3mf"
"""End of the names of plates that are prints already, in flat pixels."""
FILMS = (32, 86, 128)
"""Pixels across the plates in which pictures are compared: of 86 one is a minute of arc wide, 40 cm away."""
MESHES = (".3mf", ".stl", ".obj")
"""Formats that the slicer reads."""
RIM = 0.98
"""Share of the plate on which heights are compared in Blender, where the picture repeats beyond its rim."""


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
    folder: Path, reliefs: Mapping[str, HeightMap], heights: Mapping[str, Array], samples: int
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
        change = {}
        for film in FILMS:
            both = retouch.compare(*pair, samples=samples, defines={"resolution": str(film)}, quiet=True)
            change[film] = both["look"]["change_percent"]
        found[kind] = {"jnd_apart": both["jnd_apart"], "picture_change_percent_of_mean": change}
    return found


def in_blender(python: str, folder: Path, reliefs: Mapping[str, HeightMap]) -> dict[str, Any]:
    """Sizes of the files that Blender imports, and the heights to which it displaces a grid by the PNG."""
    name, read = next(iter(reliefs.items()))
    rows, cols = read.heights.shape
    strength, width, depth = float(read.heights.max()), read.side_mm, read.side_mm * rows / cols
    body = plate_mesh(read.heights, read.side_mm)
    parts = [Part(name, body), Part(f"{name} beside", body, np.vstack([np.eye(3), [13.0, 0.0, 0.0]]))]
    paths = [write_parts(folder / f"parts{suffix}", parts) for suffix in (".glb", ".obj", ".stl", ".ply")]
    picture = folder / f"{name}.png"
    save_heights_png(picture, read.heights, strength, read.side_mm)
    task = {
        "files": [str(path) for path in paths],
        "picture": str(picture),
        **{
            "width": width / 1000.0,
            "depth": depth / 1000.0,
            "strength": strength / 1000.0,
            "squares": 2 * cols,
        },
    }
    script = Path(__file__).with_name("read_in_blender.py")
    done = subprocess.run(
        [python, str(script)],
        input=json.dumps(task),
        capture_output=True,
        text=True,
        timeout=TIME_LIMIT_S,
        check=True,
    )
    line = next(line for line in done.stdout.splitlines() if line.startswith("RESULT"))
    output = json.loads(line.removeprefix("RESULT"))
    points = 1000.0 * np.array(output["displaced"])
    inside = (np.abs(points[:, :2]) < RIM * 0.5 * np.array([width, depth])).all(axis=1)
    x, y, z = points[inside].T
    at = [(0.5 - y / depth) * rows - 0.5, (x / width + 0.5) * cols - 0.5]
    wanted = map_coordinates(read.heights, at, order=1, mode="nearest")
    size = np.ptp(joined(parts).vertices, axis=0)
    return {
        "version": output["version"],
        "files": {
            Path(path).name: {
                "objects": each["objects"],
                # GLB is in metres, as Blender is; the others come in as if their mm were metres.
                "size_error_mm": float(
                    np.abs(np.array(each["size"]) * (1000.0 if path.endswith(".glb") else 1.0) - size).max()
                ),
            }
            for path, each in output["files"].items()
        },
        "displacement": {
            "vertices": len(z),
            "largest_error_um": 1000.0 * float(np.abs(z - wanted).max()),
            "grey_level_um": 1000.0 * strength / 65535,
            "size_mm": np.ptp(points[:, :2], axis=0).tolist(),
        },
    }


def main(argv: Sequence[str] | None = None) -> None:
    parser = parser_of(__doc__)
    parser.add_argument("--slicer", default="prusa-slicer", help="PrusaSlicer's command")
    parser.add_argument("--blender", metavar="PYTHON", help="a Python that has bpy")
    parser.add_argument(
        "--run", type=Path, help="directory of a run of gravel with +2 JND (default: a new one)"
    )
    parser.add_argument(
        "--also", type=Path, nargs="*", default=[], metavar="FILE", help="more files to slice: sets, objects"
    )
    parser.add_argument("--samples", type=int, default=64, help="a pixel, of the pictures")
    arguments = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        run = arguments.run
        if run is None:
            run = folder / "run"
            fast = ["touch.jnd=2", "touch.model=quick", "look.model=auto"]
            gravel = str(find_texture("gravel"))
            retouch.optimize(retouch.run_from_scene("studio", gravel, fast), run, quiet=True)
        reliefs = {
            "gravel": load_height_map(find_texture("gravel")),
            "gravel+2": load_height_map(find_texture(run)),
        }
        slicer = Slicer(arguments.slicer, folder)
        also = {path: read_mesh(path).body for path in arguments.also}
        read, heights = sliced(slicer, files(folder, reliefs) | also)
        found = {
            "slicer": slicer.version,
            "files": read,
            "resin": resin_prints(folder, reliefs, heights, arguments.samples),
        }
        if arguments.blender:
            found["blender"] = in_blender(arguments.blender, folder, reliefs)
    save("clients", found)
    print(report(found))


def report(found: Mapping[str, Any]) -> str:
    """The tables of docs/evidence/fabrication.md."""
    head = (
        "file",
        "objects",
        "manifold",
        "repairs",
        "facets",
        "volume (%)",
        "size (mm)",
        "resin",
        "filament",
    )
    rows = [
        (
            name,
            *(each["objects"], "yes" if each["manifold"] else "no", each["repairs"], each["facets"]),
            *(f"{each['volume_error_percent']:+.4f}", f"{each['size_error_mm']:.4f}"),
            *(each["resin"]["layers"], each["filament"]["layers"]),
        )
        for name, each in found["files"].items()
    ]
    resin = found["resin"]
    kinds = [
        (
            kind,
            f"{resin[kind]['jnd_apart']:.2f}",
            *(f"{change:.1f}" for change in resin[kind]["picture_change_percent_of_mean"].values()),
        )
        for kind in ("screen", "model", "slicer")
    ]
    films = [f"picture change, {10.0 / film:.2f} mm a pixel (%)" for film in FILMS]
    return f"{table(head, rows)}\n\n{table(('prints', 'JND apart', *films), kinds)}"


if __name__ == "__main__":
    main()
