"""Fuzzy skin for five targets: what PrusaSlicer makes of the numbers that `retouch fuzzy` finds.

python -m benchmarks.prints.fuzzy_targets [--again]      # writes results/fuzzy_targets.json

A box with sides of 40 mm and a cylinder are sliced five times for each target; fingers press on upright sides
at places that the search, which presses on computed walls, has not seen. Beside it: fuzzy skins as computed
and as PrusaSlicer draws them, by statistics of the nozzle's path along one side of the box.
"""

from __future__ import annotations

import tempfile
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import retouch
from benchmarks.shared.common import DOCS, again_given, kept, load, publish, table
from optimize.settings.skins import load_skin
from relief.ground.arrays import Array
from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts
from relief.solids.filament.beads import Beads, Role
from relief.solids.filament.fuzzy_skin import fuzzy_wall
from relief.solids.objects.swept import cylinder
from retouch.verbs.filament.slicing import sliced
from retouch.verbs.fuzzy.fuzzing import judged
from retouch.verbs.fuzzy.fuzzy_search import Wall, roughness
from retouch.verbs.solid_evaluation import read_solid

NAME, PAGE = "fuzzy_targets", DOCS / "evidence" / "fabrication.md"
TARGETS = (0.008, 0.015, 0.025, 0.035, 0.05)
SKINS = ((0.05, 0.8), (0.1, 0.8), (0.3, 0.8), (0.3, 0.3), (0.1, 1.6))
"""Thicknesses and point distances of fuzzy skins that are compared, mm."""
PROFILE = "layer_height = 0.2\nfirst_layer_height = 0.2\nnozzle_diameter = 0.4\nfuzzy_skin = none\n"
LAYER_MM, WIDTH_MM = 0.2, 0.45
LAG_MM = 0.1
"""Pitch along the wall at which paths are sampled, mm."""


def box() -> Body:
    """A box of 40 x 40 x 20 mm, faces outward."""
    corners = np.stack(np.meshgrid((0.0, 40.0), (0.0, 40.0), (0.0, 20.0), indexing="ij"), -1).reshape(-1, 3)
    squares = ((0, 2, 6, 4), (1, 5, 7, 3), (0, 4, 5, 1), (2, 3, 7, 6), (0, 1, 3, 2), (4, 6, 7, 5))
    faces = [face for a, b, c, d in squares for face in ((a, b, c), (a, c, d))]
    return Body(corners, np.array(faces))


PARTS = {"box": box, "cylinder": lambda: cylinder(20.0, 30.0)}


def with_skin(thickness_mm: float, point_distance_mm: float) -> str:
    """The profile with a fuzzy skin."""
    lengths = f"fuzzy_skin_thickness = {thickness_mm}\nfuzzy_skin_point_dist = {point_distance_mm}\n"
    return PROFILE.replace("none", "external") + lengths


def reached(part: Path, profile: Path, target: float) -> dict[str, Any]:
    """What the slices of a part have for a target."""
    with tempfile.TemporaryDirectory() as folder:
        made = retouch.fuzzy(part, profile, Path(folder) / "new.ini", roughness=target, quiet=True)
    keys = ("settings", "target", "roughness", "slices", "jnd_from_target")
    found = {key: made.as_json()[key] for key in keys}
    return found | {"slices_std": float(np.std(made.slices, ddof=1))}


def statistics(beads: Beads) -> dict[str, float]:
    """Of the paths along a side that faces -y, between points 5 mm from its ends, layers above the first.

    Mean distance of points, standard deviation of what they are moved by, and the distance along the wall at
    which the correlation of the path has fallen to a half, mm.
    """
    walls = beads.part(beads.role == Role.OUTER_WALL)
    side = float(np.median(walls.start[walls.start[:, 1] < walls.start[:, 1].min() + 1.0, 1]))
    near = (np.abs(walls.start[:, 1] - side) < 1.0) & (np.abs(walls.end[:, 1] - side) < 1.0)
    walls = walls.part(near & (walls.layer > 0))
    low, high = np.quantile(walls.start[:, 0], (0.0, 1.0)) + np.array([5.0, -5.0])
    grid = np.arange(low, high, LAG_MM)
    paths, steps, moved = [], [], []
    for layer in np.unique(walls.layer):
        points = walls.part(walls.layer == layer).start
        points = points[np.argsort(points[:, 0])]
        inside = points[(points[:, 0] > low) & (points[:, 0] < high)]
        steps.append(np.diff(inside[:, 0]))
        moved.append(inside[:, 1])
        paths.append(np.interp(grid, points[:, 0], points[:, 1]))
    return {
        "point_distance_mm": float(np.concatenate(steps).mean()),
        "moved_std_mm": float(np.concatenate(moved).std()),
        "half_correlation_mm": half_correlation(np.array(paths)),
    }


def half_correlation(paths: Array) -> float:
    """Distance at which the correlation of paths (layers, n), sampled every 0.1 mm, is a half, mm."""
    paths = paths - paths.mean()
    lags = np.arange(paths.shape[1] // 4)
    products = [float((paths[:, : paths.shape[1] - lag] * paths[:, lag:]).mean()) for lag in lags]
    return float(LAG_MM * np.interp(-0.5, -np.array(products) / products[0], lags))


def alike(part: Path, folder: Path, thickness_mm: float, point_distance_mm: float) -> dict[str, Any]:
    """A fuzzy skin as computed and as PrusaSlicer draws it."""
    text = with_skin(thickness_mm, point_distance_mm)
    (profile := folder / "skin.ini").write_text(text)
    skin = load_skin("paper")
    random = np.random.default_rng(0)
    wall, _ = fuzzy_wall(thickness_mm, point_distance_mm, WIDTH_MM, LAYER_MM, 10.0, 4, random)
    return {
        "roughness": roughness(Wall(WIDTH_MM, LAYER_MM, skin), thickness_mm, point_distance_mm),
        "slices": judged("prusa-slicer", read_solid(part), text.encode(), skin),
        "computed": statistics(wall),
        "sliced": statistics(sliced("prusa-slicer", part, profile).beads),
    }


def main() -> None:
    again = again_given(__doc__)
    with tempfile.TemporaryDirectory() as temporary:
        folder = Path(temporary)
        (profile := folder / "plain.ini").write_text(PROFILE)
        for name, make in PARTS.items():
            part = write_parts(folder / f"{name}.stl", [Part(name, make())])
            for target in TARGETS:
                kept(NAME, name, f"{target:g}", partial(reached, part, profile, target), again)
        part = folder / "box.stl"
        for pair in SKINS:
            kept(NAME, "skins", "{:g} {:g}".format(*pair), partial(alike, part, folder, *pair), again)
    publish(PAGE, "fuzzy skin", "benchmarks.prints.fuzzy_targets", report(load(NAME)))


def report(found: dict[str, Any]) -> str:
    """The table of targets."""
    rows = [
        (
            name,
            target,
            *(row["settings"][key] for key in ("fuzzy_skin_thickness", "fuzzy_skin_point_dist")),
            f"{row['roughness']:.4f}",
            f"{np.mean(row['slices']):.4f}",
            f"{row['slices_std']:.4f}",
            f"{row['jnd_from_target']:+.2f}",
        )
        for name in PARTS
        for target, row in found[name].items()
    ]
    head = ("part", "target V", "thickness, mm", "points, mm", "computed", "sliced", "spread", "JND off")
    return table(head, rows)


if __name__ == "__main__":
    main()
