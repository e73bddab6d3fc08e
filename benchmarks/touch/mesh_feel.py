"""Feel of meshes: tubes, fuzzy skin, a knurl, a coin's edge, and time.

python -m benchmarks.touch.mesh_feel [CASE ...]     # without names: the cases that are not in the results yet
"""

from __future__ import annotations

import sys
import tempfile
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shared.common import load, machine, save, table
from mitsuba_scenes import find_texture
from optimize.verification.solids.mesh_feel import feel_of, pressed
from relief.ground.arrays import Array
from relief.heightmap import load_heights
from relief.places import places
from relief.relief import Relief
from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts
from relief.solids.files.mesh import Mesh, read_mesh
from relief.solids.meshes.crops import Cropper
from relief.solids.meshes.mesh_places import frame_along
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
PLACES = 12
COIN_MM, REEDS = 1.75, 119
"""Thickness of a coin and the ridges on its edge, those of a quarter dollar."""


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


def fuzzy_skin(length_mm: float, rows: int, pitch_mm: float) -> Array:
    """Heights of PrusaSlicer's fuzzy skin with its defaults: 0.3 mm, a point each 0.8 mm, layers of 0.2 mm.

    The path of each layer has a point 0.6 to 1.0 mm after the last, moved by up to 0.15 mm both ways.
    """
    random = np.random.default_rng(3)
    cols, high = round(length_mm / pitch_mm), round(0.2 / pitch_mm)
    layers = []
    for _ in range(-(-rows // high)):
        at = np.cumsum(random.uniform(0.6, 1.0, round(length_mm / 0.8)))
        at *= length_mm / at[-1]
        moved = random.uniform(-0.15, 0.15, len(at))
        layers.append(np.interp(np.arange(cols) * pitch_mm, at, moved, period=length_mm))
    return 0.3 + np.repeat(layers, high, axis=0)[:rows]


def knurl(around: int, rows: int) -> tuple[Array, float]:
    """Heights of a diamond knurl, and the distance of its samples, mm.

    Grooves of 0.4 mm at 45 degrees both ways, 1 mm apart, and pyramids between them.

    Args:
        around: Diamonds around the tube.
        rows: Samples along the tube, 24 to a diamond.
    """
    row, col = np.indices((rows, 24 * around)) / 24.0
    waves = [np.abs(along % 1.0 - 0.5) * 2.0 for along in (row + col, row - col)]
    return 0.4 * np.minimum(*waves), np.sqrt(2.0) / 24.0


def touched(textured: Body, base: Body | None = None) -> dict[str, Any]:
    """What fingers get from the side of an upright tube, as pressed; over a bare tube, without curvature."""
    bare = None if base is None else Mesh(base, None, Path("base"))
    feel = feel_of(Mesh(textured, None, Path("body")), Skin(), most=PLACES, without_texture=bare)
    side = np.array([abs(crop.frame.axes[2, 2]) < 0.5 for crop in feel.crops])
    v, area = (feel.as_pressed[name][side] for name in ("roughness", "contact_area_mm2"))
    row = {"roughness": float(v.mean()), "std": float(v.std()), "places": len(v), "on_edge": feel.edges}
    return row | {"contact_area_mm2": float(area.mean())}


def around_tube(heights: Array, pitch_mm: float, every: int, tile: bool = False) -> dict[str, Any]:
    """Heights (rows, cols) around a tube, felt with and without its curvature, and the same laid flat.

    Args:
        heights: mm, which repeat along the columns, or whole tiles.
        pitch_mm: Distance of the samples, mm.
        every: Samples of the texture between those of the smooth tube.
        tile: Whether the rows repeat as well.
    """
    rows, cols = heights.shape
    body = tube(heights, pitch_mm)
    check_solid(body, "tube")
    base = refined(tube(np.zeros((-(-rows // every), cols // every)), every * pitch_mm), EDGE_MM).body
    surface = Surface((rows, cols), cols * pitch_mm, (tile, True))
    at = places(surface)
    chosen = at[np.linspace(0, len(at) - 1, min(len(at), 2 * PLACES)).astype(np.int64)]
    flat = measure_touch(Relief(heights, surface.width_mm, surface.repeats), Skin(), "layer", at=chosen)
    row: dict[str, Any] = {"radius_mm": float(cols * pitch_mm / (2.0 * np.pi)), "faces": len(body.faces)}
    row["flat"] = flat.means["roughness"]
    for kind, under in (("out", base), ("within", None)):
        row[kind] = touched(body, under)
        row[f"jnd_{kind}"] = jnd_apart(row[kind]["roughness"], row["flat"])
    return row


def gravel_tube(around: int) -> dict[str, Any]:
    """Gravel around a tube: the tile's places laid flat."""
    tile = load_heights(find_texture("gravel-tile"))[::2, ::2]
    return around_tube(np.tile(tile, (2, around)), TILE_MM / len(tile), 4, tile=True)


def coin() -> dict[str, Any]:
    """The edge of a coin with ridges of 0.15 mm, with smooth edges, and a straight bar of the same ridges.

    The finger lies across the edge, which is narrower than its patch: the shape is felt with the ridges.
    """
    wave = 0.15 * np.abs(np.sin(np.pi * np.arange(16 * REEDS) / 16.0))
    pitch = np.pi * 24.26 / len(wave)
    rows = round(COIN_MM / pitch) + 1
    row: dict[str, Any] = {"radius_mm": 24.26 / 2.0}
    for kind, heights in (("within", wave), ("smooth", 0.0 * wave)):
        body = tube(np.tile(heights, (rows, 1)), pitch)
        cropper, found = Cropper(body), []
        for angle in np.linspace(0.0, 0.1, 6):
            axis = np.array([np.cos(angle), np.sin(angle), 0.0])
            at = axis * row["radius_mm"] + (0.0, 0.0, 0.5 * COIN_MM)
            found.append(cropper.crop(frame_along(at, axis)).heights)
        v = pressed(np.stack(found), Skin(), "layer")[0]["roughness"]
        row[kind] = {"roughness": float(v.mean()), "std": float(v.std()), "places": len(v)}
        row["faces"] = len(body.faces)
    samples = round(TILE_MM / pitch)
    bar = np.zeros((samples, samples))
    bar[(samples - rows) // 2 :][:rows] = 2.85 + wave[:samples]
    row["flat"] = measure_touch(Relief(bar, TILE_MM), Skin(), "layer").means["roughness"]
    row["jnd_within"] = jnd_apart(row["within"]["roughness"], row["flat"])
    return row | {"jnd_from_smooth": jnd_apart(row["within"]["roughness"], row["smooth"]["roughness"])}


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
    **{name: lambda around=around: gravel_tube(around) for name, around in AROUND.items()},  # type: ignore[misc]
    "fuzzy skin, 16 mm": lambda: around_tube(fuzzy_skin(100.0, 200, 0.1), 0.1, 8),
    "knurl, 8.1 mm": lambda: around_tube(*knurl(36, 264), 12),
    "coin's edge, 12.1 mm": coin,
    "time": seconds,
}


def main(argv: Sequence[str] | None = None) -> None:
    saved = load("mesh_feel")
    chosen = list(sys.argv[1:] if argv is None else argv)
    for name in chosen or [name for name in CASES if name not in saved]:
        saved[name] = CASES[name]()
        print(name, saved[name], flush=True)
        save("mesh_feel", saved | {"machine": machine()})
    head = ("shape, radius", "triangles", "V laid flat", "curvature out", "JND", "with it", "JND", "places")
    rows = []
    for name in (name for name in CASES if name in saved and name != "time"):
        row = saved[name]
        out = row.get("out", {})
        cells = (out.get("roughness"), row.get("jnd_out"), row["within"]["roughness"], row["jnd_within"])
        rows.append((name, row["faces"], row["flat"], *cells, row["within"]["places"]))
    print(table(head, rows))


if __name__ == "__main__":
    main()
