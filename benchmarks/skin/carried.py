"""Tiles that were steered for the default finger, as other fingers feel them."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from benchmarks.shared.checkouts import DEMO_RUNS, process
from benchmarks.shared.common import ROOT
from benchmarks.skin.experiment_plates import ROUND_SAMPLES
from benchmarks.skin.round_pressing import RoundFinger
from mitsuba_scenes import find_texture
from relief.ground.arrays import Array
from relief.ground.progress import say
from relief.heightmap import load_heights
from tactile.jnd import jnd_apart
from tactile.skin import Skin

RUN = ROOT / "mitsuba_scenes" / "gravel-tile.toml"
"""Run file of a tile; the texture and the target are replaced."""
FEW, ALL = 2, 4
"""Places along each axis of a tile for draws of the posterior, and for named fingers."""


def steered(folder: Path) -> dict[str, Path]:
    """Make each tile of the demo runs, with fast models, at 16 places; files of heights by name.

    Six runs take 90 CPU seconds.
    """
    found = {}
    for texture, jnd in DEMO_RUNS:
        say(f"{texture} {jnd:+d} JND")
        target = folder / f"{texture}{jnd:+d}"
        changes = (f"texture={find_texture(f'{texture}-tile')}", f"touch.jnd={jnd}")
        sets = [word for change in changes for word in ("--set", change)]
        process(ROOT, ("-m", "retouch", "optimize", str(RUN), *sets, "--fast", "-o", str(target)))
        found[f"{texture} {jnd:+d}"] = target / "heights.exr"
    return found


def tiles() -> dict[str, tuple[Array, Array]]:
    """Heights (n, n) mm before and after, by name, of each tile."""
    with tempfile.TemporaryDirectory() as folder:
        return {
            name: (load_heights(find_texture(f"{name.split()[0]}-tile")), load_heights(file))
            for name, file in steered(Path(folder)).items()
        }


def at_places(tile: Array, along: int) -> Array:
    """(along², n, n) mm: a tile (m, m) that repeats, around each of `along` x `along` places."""
    size = tile.shape[-1]
    index = (np.arange(ROUND_SAMPLES) - ROUND_SAMPLES // 2) % size
    shifts = [number * size // along for number in range(along)]
    return np.array(
        [tile[np.ix_((index + down) % size, (index + right) % size)] for down in shifts for right in shifts]
    )


def felt_by(skin: Skin, pairs: Mapping[str, tuple[Array, Array]], along: int) -> dict[str, list[float]]:
    """JND between before and after at each place, by the tile's name, to a round finger."""
    finger = RoundFinger(skin)
    roughness: dict[bytes, list[float]] = {}
    found = {}
    for name, pair in pairs.items():
        felt = []
        for tile in pair:
            # Two runs share their tile before.
            if tile.tobytes() not in roughness:
                roughness[tile.tobytes()] = finger.felt(at_places(tile, along))[0]["V"]
            felt.append(roughness[tile.tobytes()])
        found[name] = [jnd_apart(after, before) for before, after in zip(*felt, strict=True)]
    return found
