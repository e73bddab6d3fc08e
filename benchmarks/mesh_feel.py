"""Feel of meshes: plates against their height maps, tubes by radius, a slicer's fuzzy skin and a knurl.

python -m benchmarks.mesh_feel
"""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.common import machine, save
from mitsuba_scenes import find_texture
from optimize.descent.touch_measures import measure_touch
from optimize.meshes.feel import feel_of
from relief.arrays import Array
from relief.body import Body
from relief.export.plate import plate_mesh
from relief.heightmap import load_heights
from relief.meshes import Mesh, check_solid
from relief.meshes.unrolling import fine_enough
from tactile import jnd_apart
from tactile.skin import Skin

PLATE_MM, TILE_MM = 25.0, 10.0
AROUND = (20, 10, 6, 4)
"""Tiles around the tubes: radii of 32, 16, 9.5 and 6.4 mm."""
PLACES = 12


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


def knurl(shape: tuple[int, int], pitch_mm: float) -> Array:
    """Heights of a diamond knurl: pyramids of 1.6 mm between grooves of 0.5 mm at 45 degrees both ways."""
    rows, cols = np.indices(shape) * pitch_mm
    waves = [np.abs((along / 1.6) % 1.0 - 0.5) * 2.0 for along in (rows + cols, rows - cols)]
    return 0.1 + 0.5 * np.minimum(*waves)


def felt(textured: Body, base: Body | None = None) -> dict[str, Any]:
    """What fingers get from a body, with CPU seconds."""
    start = time.process_time()
    bare = None if base is None else Mesh(base, None, Path("base"))
    feel = feel_of(Mesh(textured, None, Path("body")), Skin(), most=PLACES, without_texture=bare)
    v = feel.values["roughness"]
    numbers = {"roughness": float(v.mean()), "std": float(v.std()), "places": len(v), "on_edge": feel.edges}
    numbers["contact_area_mm2"] = feel.means["contact_area_mm2"]
    return numbers | {"cpu_s": time.process_time() - start}


def plates() -> list[dict[str, Any]]:
    """Plates of 25 mm by their files and by their height maps."""
    rows = []
    for name in ("gravel", "brick"):
        tile = load_heights(find_texture(f"{name}-tile"))
        side = round(PLATE_MM / TILE_MM * len(tile))
        heights = np.tile(tile, (3, 3))[:side, :side]
        body = plate_mesh(heights, PLATE_MM)
        start = time.process_time()
        check_solid(body, name)
        checked = time.process_time() - start
        start = time.process_time()
        feel = feel_of(Mesh(body, None, Path(name)), Skin())
        cpu = time.process_time() - start
        plate = measure_touch(heights, PLATE_MM, Skin(), "layer").means["roughness"]
        mean = feel.means["roughness"]
        row = {"texture": name, "faces": len(body.faces), "plate": plate, "mesh": mean}
        row |= {"jnd": jnd_apart(mean, plate), "places": len(feel.crops)}
        row |= {"check_cpu_s": checked, "cpu_s": cpu}
        rows.append(row)
        print(row, flush=True)
    return rows


def tubes() -> list[dict[str, Any]]:
    """Gravel around tubes, with the curvature taken out and as part of what is felt."""
    tile = load_heights(find_texture("gravel-tile"))[::2, ::2]
    pitch = TILE_MM / len(tile)
    expected = measure_touch(tile, TILE_MM, Skin(), "layer", repeats=(True, True)).means["roughness"]
    rows = []
    for around in AROUND:
        heights = np.tile(tile, (2, around))
        # The smooth tube under it, of fewer samples.
        body, base = tube(heights, pitch), tube(np.zeros((32, 16 * around)), 4.0 * pitch)
        base = fine_enough(base, "base")
        out, within = felt(body, base), felt(body)
        row: dict[str, Any] = {"radius_mm": around * TILE_MM / (2.0 * np.pi), "tile": expected}
        row |= {"out": out, "within": within}
        row |= {"jnd_out": jnd_apart(out["roughness"], expected)}
        row |= {"jnd_within": jnd_apart(within["roughness"], expected)}
        rows.append(row)
        print(row, flush=True)
    return rows


def examples() -> list[dict[str, Any]]:
    """A slicer's fuzzy skin and a knurl, on tubes of 16 and 8 mm radius, and on the flat."""
    pitch, rows = 0.1, []
    for name, heights in {
        "fuzzy skin, radius 16 mm": fuzzy_skin(100.0, 200, pitch),
        "knurl, radius 8 mm": knurl((200, 512), pitch),
    }.items():
        base = fine_enough(tube(np.zeros((24, heights.shape[1] // 8)), 8 * pitch), "base")
        body = tube(heights, pitch)
        check_solid(body, name)
        row = {"name": name, "out": felt(body, base), "within": felt(body)}
        rows.append(row)
        print(row, flush=True)
    return rows


def main() -> None:
    content = {"plates": plates(), "examples": examples(), "tubes": tubes()}
    print(save("mesh_feel", {**content, "machine": machine()}))


if __name__ == "__main__":
    main()
