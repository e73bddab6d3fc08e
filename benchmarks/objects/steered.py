"""Tiles that are optimised for the curvature of the object that they are laid on, and for a plate.

python -m benchmarks.objects.steered [NAME ...] [--again]

Gravel is made two just-noticeable differences rougher once for a plate and once for each object, with the
radii of `retouch wrap --json`, and wrapped. At contact locations of the object the finger is pressed on
its shape with the unrolled texture over it, and the strain under the bare shape is taken out. The difference
between the optimised and the original texture over all places is told, with its standard error.
"""

import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch

import retouch
from benchmarks.objects.bundled import tile_of
from benchmarks.shared.common import publish, rows_of, table
from mitsuba_scenes import find_file
from optimize.settings.skins import load_skin
from optimize.verification.solids.over_object import over_object
from relief.ground.arrays import Array
from relief.solids.meshes.crops import Cropper
from relief.solids.meshes.mesh_places import spread, surface_points
from relief.solids.meshes.unrolling import Unroller
from relief.solids.objects.table import OBJECTS
from relief.solids.remeshing.smooth_surface import smooth_object
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.texture_tiles import Covering, Tile
from relief.solids.wrapping.wrapped_body import wrap
from tactile.jnd import ROUGHNESS_JND, jnd_apart
from tactile.model import touch_model
from tactile.pair_variation import roughness

RESULT, TEXTURE, TARGET_JND = "steered_objects", "gravel-tile", 2.0
PLACES, TRIED, SPACING_MM, FACES, SIDE_MM, SAMPLES = 24, 300, 2.5, 400_000, 10.0, 128
"""Places, how many are looked at, their distance in mm, triangles, and the patch with its samples."""
HEAD = ["object", "curved_x_mm", "curved_y_mm"]
HEAD += ["contact locations", "optimised flat, JND", "for the object, JND"]


def steered(run: Path, curved: dict[str, float | None]) -> Tile:
    """The tile that a descent makes for a curvature, mm by key of `[touch]`; kept in a folder."""
    if not (run / "result.json").is_file():
        settings = [f"touch.{key}={radius!r}" for key, radius in curved.items() if radius is not None]
        file = find_file(f"{TEXTURE}.toml", ".toml")
        changes = [f"touch.jnd={TARGET_JND}", "verify.baseline=false", *settings]
        retouch.optimize(retouch.load_run(file, changes), run, force=True)
    return tile_of(str(run))


def felt(heights: Array, shapes: Array) -> Array:
    """Roughness (k,) of textures (k, n, n) mm on shapes (k, n, n) mm, without the strain under the shapes."""
    model = touch_model(load_skin("paper"), SAMPLES, SIDE_MM)
    with_texture = model.press(torch.as_tensor(heights + shapes)).strain
    bare = model.press(torch.as_tensor(shapes)).strain
    return np.asarray(roughness(with_texture - bare, SIDE_MM))


def measured(name: str, folder: Path) -> dict[str, Any]:
    """Differences from the original at the places of an object."""
    thing = OBJECTS[name]
    bare = thing.make()
    original = tile_of(TEXTURE)
    settings = Settings(faces=FACES)
    wrapped = {"original": wrap(bare, [Covering(original)], settings, regions=thing.regions)}
    radii = {
        f"curved_{axis}_mm": one.radius_mm
        for axis, one in zip("xy", wrapped["original"].bending, strict=True)
    }
    for key, curved in (("plate", {}), ("object", radii)):
        tile = steered(folder / f"{'plate' if not any(curved.values()) else name}", curved)
        wrapped[key] = wrap(bare, [Covering(tile)], settings, regions=thing.regions)
    fine = smooth_object(bare, name)
    unrollers = {key: Unroller(each.body, fine) for key, each in wrapped.items()}
    cropper, points = Cropper(bare), surface_points(fine)
    values: dict[str, list[float]] = {key: [] for key in wrapped}
    for at in points.at[spread(points.at, TRIED, SPACING_MM)]:
        crops = {key: over_object(unroller, at, None, whole=True) for key, unroller in unrollers.items()}
        shape = cropper.crop(crops["original"].frame)
        if shape.on_edge or any(crop.on_edge for crop in crops.values()):
            continue
        heights = np.stack([crop.heights for crop in crops.values()])
        each = felt(heights, np.broadcast_to(shape.heights, heights.shape).copy())
        for key, value in zip(values, each, strict=True):
            values[key].append(float(value))
        if len(values["original"]) == PLACES:
            break
    return radii | {"roughness": values}


def difference(values: list[float], before: list[float]) -> tuple[float, float]:
    """Difference of the means in JND, and its standard error over the places."""
    after, first = np.array(values), np.array(before)
    error = (after / after.mean() - first / first.mean()).std(ddof=1) / np.sqrt(len(after))
    return jnd_apart(after.mean(), first.mean()), float(error / np.log(ROUGHNESS_JND))


def _line(name: str, row: dict[str, Any]) -> tuple[str, ...]:
    values = row["roughness"]
    radii = (f"{row[key]:.1f}" if row[key] is not None else "straight" for key in HEAD[1:3])
    differences = (difference(values[key], values["original"]) for key in ("plate", "object"))
    cells = (f"{off:+.2f} ± {error:.2f}" for off, error in differences)
    return (name, *radii, str(len(values["original"])), *cells)


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        measures = {name: partial(measured, name, Path(folder)) for name in sorted(OBJECTS)}
        rows = rows_of(__doc__, RESULT, "objects", measures)
    publish("objects", "steered", table(HEAD, [_line(*row) for row in rows.items()]))


if __name__ == "__main__":
    main()
