"""Tiles steered for the measured finger, felt by finer elements and by tetrahedra of the same finger.

retouch study benchmarks/surfaces/fingers_crossed.toml -o runs/crossed
python -m benchmarks.surfaces.steered_truth runs/crossed   # by every way that is not in the results yet
python -m benchmarks.surfaces.steered_truth                # prints the table
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import torch

from benchmarks.shared.common import DOCS, load, machine, publish, save, study_given, table
from benchmarks.shared.finished_studies import Row, folder_of, rows_in
from benchmarks.skin.operators import felt
from benchmarks.skin.round_truth import TETRAHEDRA, TETRAHEDRA_PITCH_MM, TRUTH
from benchmarks.touch.round_tetrahedra import round_tetrahedra
from optimize.run_directory.finished_run import FinishedRun
from optimize.settings.skins import load_skin
from relief.ground.arrays import Array
from relief.ground.progress import say
from relief.patches import Patches, samples_of
from relief.places import places
from relief.relief import Relief
from tactile.elements.round_pad import round_pad_operator
from tactile.jnd import jnd_apart
from tactile.pressing import SkinOperator

PAGE = DOCS / "evidence" / "touch.md"
COMMAND = "benchmarks.surfaces.steered_truth FOLDER"
TILES = ("gravel-tile", "knit-tile", "leather-tile")
TILE_MM = 10.0
SKIN = load_skin("measured")
VERIFIED_MM = TILE_MM / 128
"""Pitch of the samples of the tiles, by which runs are verified."""
PLACES = 4
"""Places of a tile, evenly taken, at which every method presses."""
WAYS = (
    "verifying elements",
    "finer elements",
    "verifying elements, coarse samples",
    "tetrahedra, coarse samples",
)


def main() -> None:
    study = study_given(__doc__)
    if study is not None:
        rows = [row for row in rows_in(study) if row["texture"] in TILES and row["touch.skin"] == "measured"]
        reliefs = {f"{row['texture']} {row['touch.jnd']:+g}": _sides(study, row) for row in rows}
        jnds: dict[str, dict[str, list[float]]] = load("steered_truth").get("jnd", {})
        for way, pitch, build in operators():
            if all(way in jnds.get(name, {}) for name in reliefs):
                continue
            operator = build()
            for name, sides in reliefs.items():
                say(f"{name} by {way}")
                first, then = (
                    felt(operator, SKIN, torch.as_tensor(_patches(side, pitch))).roughness for side in sides
                )
                each = [jnd_apart(b, a) for a, b in zip(first, then, strict=True)]
                jnds.setdefault(name, {})[way] = each
            save("steered_truth", {"jnd": jnds, "machine": machine()})
    publish(PAGE, "truth", COMMAND, as_text(load("steered_truth")["jnd"]))


def operators() -> Iterator[tuple[str, float, Callable[[], SkinOperator]]]:
    """Name, pitch of the samples, mm, and operator of each way to press."""
    assert SKIN.patch_mm is not None
    size = SKIN.patch_mm
    fine, coarse = samples_of(size, VERIFIED_MM), round(size / TETRAHEDRA_PITCH_MM)
    yield WAYS[0], VERIFIED_MM, lambda: round_pad_operator(SKIN, fine, size)
    yield WAYS[1], VERIFIED_MM, lambda: round_pad_operator(SKIN, fine, size, mesh=TRUTH)
    yield WAYS[2], TETRAHEDRA_PITCH_MM, lambda: round_pad_operator(SKIN, coarse, size)
    yield WAYS[3], TETRAHEDRA_PITCH_MM, lambda: round_tetrahedra(SKIN, coarse, size, TETRAHEDRA)


def _sides(study: Path, row: Row) -> tuple[Relief, Relief]:
    """Original and result of a row."""
    run = FinishedRun.read(folder_of(study, row))
    return run.original, run.result


def _patches(relief: Relief, pitch_mm: float) -> Array:
    """(k, n, n) mm below the finger at the places."""
    at = places(relief.surface)
    some = at[np.linspace(0, len(at) - 1, PLACES).round().astype(int)]
    assert SKIN.patch_mm is not None
    patches = Patches(relief.surface, some, samples_of(SKIN.patch_mm, pitch_mm), SKIN.patch_mm)
    return np.asarray(patches.within_reach(relief.heights))


def as_text(jnds: dict[str, dict[str, list[float]]]) -> str:
    """Mean and range of JND over the places by each way, and the largest distance of two ways at a place."""
    pairs = [(WAYS[0], WAYS[1]), (WAYS[2], WAYS[3])]
    # A pair that is still to be computed is left out.
    pairs = [pair for pair in pairs if all(way in by_way for by_way in jnds.values() for way in pair)]
    lines: list[list[Any]] = []
    for name, by_way in jnds.items():
        every = [by_way[way] for pair in pairs for way in pair]
        means = [f"{np.mean(each):+.2f} ({min(each):+.2f} to {max(each):+.2f})" for each in every]
        apart = [float(np.abs(np.subtract(by_way[one], by_way[other])).max()) for one, other in pairs]
        lines.append([name, *means, *(f"{each:.2f}" for each in apart)])
    ways = [way for pair in pairs for way in pair]
    return table(("tile", *ways, *(f"farthest apart: {other}" for _, other in pairs)), lines)


if __name__ == "__main__":
    main()
