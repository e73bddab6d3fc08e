"""Feel of meshes: gravel around tubes, beside the same heights laid flat, and time.

python -m benchmarks.touch.mesh_feel [CASE ...] [--again]
"""

from __future__ import annotations

import tempfile
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shared.common import rows_of, table_of
from mitsuba_scenes import find_texture
from optimize.verification.solids.mesh_feel import feel_of
from relief.ground.arrays import Array
from relief.heightmap import load_heights
from relief.places import places
from relief.relief import Relief
from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts
from relief.solids.files.mesh import Mesh, read_mesh
from relief.solids.meshes.refining import refined
from relief.solids.meshes.solid import check_solid
from relief.solids.remeshing.smooth_surface import EDGE_MM
from relief.surface import Surface
from tactile import jnd_apart
from tactile.measures import measure_touch
from tactile.skin import Skin

TILE_MM = 10.0
AROUND = {"gravel, 32 mm": 20, "gravel, 16 mm": 10, "gravel, 9.5 mm": 6, "gravel, 6.4 mm": 4}
"""Tiles around the tubes, by name and radius."""
PLACES, COARSER = 12, 4
"""Contact locations, and samples of the texture between those of the smooth tube."""


def tube(heights: Array, pitch_mm: float) -> Body:
    """A tube of a relief that repeats along its columns, closed by flat ends; the radius follows.

    Args:
        heights: (rows, cols) mm over the tube; rows run along it, from the top down.
        pitch_mm: Distance of the samples, mm.
    """
    rows, cols = heights.shape
    angle, z = np.arange(cols) * 2.0 * np.pi / cols, (rows - 1.0 - np.arange(rows)) * pitch_mm
    radius = cols * pitch_mm / (2.0 * np.pi) + heights
    side = np.stack([radius * np.cos(angle), radius * np.sin(angle), np.repeat(z[:, None], cols, 1)], axis=-1)
    index = np.arange(rows * cols).reshape(rows, cols)
    beside = np.roll(index, -1, axis=1)
    ends = np.repeat(rows * cols + np.arange(2), cols).reshape(2, cols)
    faces = [
        np.stack([index[:-1], index[1:], beside[:-1]], axis=-1),
        np.stack([beside[:-1], index[1:], beside[1:]], axis=-1),
        np.stack([ends[:1], index[:1], beside[:1]], axis=-1),
        np.stack([ends[1:], beside[-1:], index[-1:]], axis=-1),
    ]
    vertices = np.concatenate([side.reshape(-1, 3), [[0.0, 0.0, z[0]], [0.0, 0.0, z[-1]]]])
    return Body(vertices, np.concatenate([part.reshape(-1, 3) for part in faces]))


def touched(textured: Body, base: Body | None = None) -> dict[str, Any]:
    """What fingers get from the side of an upright tube, as pressed; over a bare tube, without curvature."""
    bare = None if base is None else Mesh(base, None, Path("base"))
    feel = feel_of(Mesh(textured, None, Path("body")), Skin(), most=PLACES, without_texture=bare)
    side = np.array([abs(crop.frame.axes[2, 2]) < 0.5 for crop in feel.crops])
    v, area = (feel.as_pressed[name][side] for name in ("roughness", "contact_area_mm2"))
    row = {"roughness": float(v.mean()), "std": float(v.std()), "places": len(v), "on_edge": feel.edges}
    return row | {"contact_area_mm2": float(area.mean())}


def around_tube(around: int) -> dict[str, Any]:
    """Tiles of gravel around a tube, felt with and without its curvature, and the same laid flat."""
    tile = load_heights(find_texture("gravel-tile"))[::2, ::2]
    heights, pitch_mm = np.tile(tile, (2, around)), TILE_MM / len(tile)
    rows, cols = heights.shape
    body = tube(heights, pitch_mm)
    check_solid(body, "tube")
    smooth = tube(np.zeros((-(-rows // COARSER), cols // COARSER)), COARSER * pitch_mm)
    surface = Surface((rows, cols), cols * pitch_mm, (True, True))
    at = places(surface)
    chosen = at[np.linspace(0, len(at) - 1, min(len(at), 2 * PLACES)).astype(np.int64)]
    flat = measure_touch(Relief(heights, surface.width_mm, surface.repeats), Skin(), "layer", at=chosen)
    row: dict[str, Any] = {"radius_mm": float(cols * pitch_mm / (2.0 * np.pi)), "faces": len(body.faces)}
    row["flat"] = flat.means["roughness"]
    for kind, under in (("out", refined(smooth, EDGE_MM).body), ("within", None)):
        row[kind] = touched(body, under)
        row[f"jnd_{kind}"] = jnd_apart(row[kind]["roughness"], row["flat"])
    return row


def seconds() -> dict[str, Any]:
    """Seconds for up to 300 places on a file of 204,800 triangles, a tube of gravel 64 mm across."""
    tile = load_heights(find_texture("gravel-tile"))[::4, ::4]
    row: dict[str, Any] = {}
    with tempfile.TemporaryDirectory() as folder:
        body = tube(np.tile(tile, (5, 20)), TILE_MM / len(tile))
        path = write_parts(Path(folder) / "tube.stl", [Part("tube", body)])
        feel_of(Mesh(body, None, path), Skin(), most=1)  # Builds what is kept from run to run.
        cpu, wall = time.process_time(), time.perf_counter()
        mesh = read_mesh(path)
        check_solid(mesh.body, path)
        row["read_and_check_cpu_s"] = time.process_time() - cpu
        feel = feel_of(mesh, Skin())
    row |= {"cpu_s": time.process_time() - cpu, "wall_s": time.perf_counter() - wall}
    return row | {"faces": len(mesh.body.faces), "places": len(feel.crops), "on_edge": feel.edges}


CASES: dict[str, Callable[[], dict[str, Any]]] = {
    **{name: partial(around_tube, around) for name, around in AROUND.items()},
    "time": seconds,
}
COLUMNS = {
    "triangles": "{faces}",
    "V laid flat": "{flat:.3g}",
    "curvature out": "{out[roughness]:.3g}",
    "JND": "{jnd_out:.3g}",
    "with it": "{within[roughness]:.3g}",
    "JND with it": "{jnd_within:.3g}",
    "places": "{within[places]}",
}


def main() -> None:
    rows = rows_of(__doc__, "mesh_feel", None, CASES)
    print(table_of("shape, radius", {name: rows[name] for name in AROUND if name in rows}, COLUMNS))


if __name__ == "__main__":
    main()
