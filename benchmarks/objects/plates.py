"""Plates by their files beside their height maps: sizes, formats, labels, turns, fewer triangles.

python -m benchmarks.objects.plates [NAME ...] [--again]
"""

import tempfile
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

import retouch
from benchmarks.shared.common import publish, rows_of, table
from mitsuba_scenes import find_texture
from relief.ground.arrays import Array
from relief.heightmap import load_heights
from relief.solids.body import Body, Part
from relief.solids.export.back_labels import labelled
from relief.solids.export.parts import write_parts
from relief.solids.export.plate_export import plate_mesh
from relief.solids.meshes.shells import body_of, manifold_of
from tactile import jnd_apart

TEXTURES = ("gravel", "leather", "bark", "brick", "knit", "terrain")
SIZES_MM, WIDE_MM, TILE_MM = (10.0, 15.0, 25.0, 40.0), 25.0, 10.0
TOLERANCES_MM = (0.005, 0.02)
"""Distances by which fewer triangles may be off, mm."""
SUFFIXES = (".stl", ".3mf", ".obj")


def cut(name: str, size_mm: float) -> Array:
    """Heights of a tile over a plate, mm."""
    tile = load_heights(find_texture(f"{name}-tile"))
    side = round(size_mm / TILE_MM * len(tile))
    return np.asarray(np.tile(tile, (4, 4))[:side, :side])


def variants(heights: Array, folder: Path) -> Iterator[tuple[str, Path]]:
    """Kinds and files of a plate of 25 mm that was labelled, turned or decimated."""
    body = plate_mesh(heights, WIDE_MM)
    kinds = {f"{how} label": labelled(body, ["A1"], mm) for how, mm in (("raised", 0.4), ("engraved", -0.4))}
    for how, degrees in (("on its side", (90, 0, 0)), ("by 30 degrees", (0, 0, 30)), ("askew", (20, 50, 70))):
        turn = Rotation.from_euler("xyz", degrees, degrees=True).as_matrix()
        kinds[how] = Body(body.vertices @ turn.T, body.faces)
    for mm in TOLERANCES_MM:
        coarse, _ = body_of(manifold_of(body, np.zeros(len(body.faces), np.int64)).simplify(mm))
        kinds[f"{len(coarse.faces) / len(body.faces):.0%} of the triangles"] = coarse
    for kind, each in kinds.items():
        yield kind, write_parts(folder / "variant.stl", [Part("plate", each)])


def compared(path: Path, flat: retouch.Evaluation) -> dict[str, Any]:
    """Roughness and places of a file beside those of its height map."""
    felt = retouch.evaluate(path, quiet=True)
    row = {"roughness": felt.roughness, "flat": flat.roughness, "places": felt.places.count}
    return row | {"places_flat": flat.places.count, "jnd": jnd_apart(felt.roughness, flat.roughness)}


def measured(name: str) -> dict[str, Any]:
    """Rows of a texture, by size and kind."""
    with tempfile.TemporaryDirectory() as folder:
        return dict(kinds_of(name, Path(folder)))


def kinds_of(name: str, folder: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    """Sizes and kinds of a texture's plates, with what was measured."""
    for size_mm in SIZES_MM:
        relief = retouch.Relief.of(cut(name, size_mm), size_mm)
        flat = retouch.evaluate(relief, quiet=True)
        for suffix in SUFFIXES if size_mm == WIDE_MM else SUFFIXES[:1]:
            path = folder / f"plate{suffix}"
            retouch.export(relief, path)
            yield f"{size_mm:g} mm, {suffix[1:]}", compared(path, flat)
        for kind, path in variants(relief.heights, folder) if size_mm == WIDE_MM else ():
            yield kind, compared(path, flat)


def main() -> None:
    measures = {name: partial(measured, name) for name in TEXTURES}
    content = rows_of(__doc__, "plates", "plates", measures)
    heads = ["texture, 25 mm", "V of the height map", "V of its STL"]
    heads += ["contact locations", "all kinds, most JND off"]
    rows = []
    for name, kinds in content.items():
        row, most = kinds["25 mm, stl"], max(abs(each["jnd"]) for each in kinds.values())
        places = f"{row['places']} of {row['places_flat']}"
        rows.append((name, f"{row['flat']:.4f}", f"{row['roughness']:.4f}", places, f"{most:.3f}"))
    publish("objects", "plates", table(heads, rows))


if __name__ == "__main__":
    main()
