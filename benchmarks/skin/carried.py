"""Results that were steered for the default finger, as other fingers feel them."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from benchmarks.shared.checkouts import DEMO_RUNS, process
from benchmarks.shared.common import ROOT
from benchmarks.skin.round_pressing import RoundFinger
from benchmarks.skin.round_stimuli import mirrored
from mitsuba_scenes import find_texture
from relief.common.arrays import Array
from relief.common.progress import say
from relief.heightmap import load_heights
from tactile.jnd import jnd_apart
from tactile.skin import Skin


def steered() -> dict[str, tuple[Array, Array]]:
    """Heights (n, n) mm before and after, by name, of each demo run with fast models: 60 CPU seconds."""
    found = {}
    with tempfile.TemporaryDirectory() as folder:
        for texture, jnd in DEMO_RUNS:
            say(f"{texture} {jnd:+d} JND")
            target = Path(folder) / f"{texture}{jnd:+d}"
            file = ROOT / "mitsuba_scenes" / f"{texture}.toml"
            process(
                ROOT,
                ("-m", "retouch", "optimize", str(file), "--set", f"touch.jnd={jnd}", "--fast", "-o", str(target)),
            )
            found[f"{texture} {jnd:+d}"] = (
                load_heights(find_texture(texture)),
                load_heights(target / "heights.exr"),
            )
    return found


def felt_by(skin: Skin, plates: Mapping[str, tuple[Array, Array]]) -> dict[str, float]:
    """JND between before and after, by name, to a round finger at the plate's middle.

    The plates, 10 mm a side, go on as their mirror images.
    """
    before_and_after = np.stack([mirrored(heights) for pair in plates.values() for heights in pair])
    felt, _ = RoundFinger(skin).felt(before_and_after)
    return {
        name: jnd_apart(felt["V"][2 * number + 1], felt["V"][2 * number]) for number, name in enumerate(plates)
    }
