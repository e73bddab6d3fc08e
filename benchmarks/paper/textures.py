"""The bundled textures, runs on them that are kept, and pictures for the figures."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

from mitsuba_scenes import FOLDER, find_texture
from optimize.run_directory.key import RESULT
from optimize.settings.run_file import run_from_scene
from optimize.verification.picture_metrics import mean_change
from relief.ground.arrays import Array
from relief.heightmap import load_heights
from retouch.verbs.runs import optimize as run
from visual.scene import Scene, load_scene

RUNS = Path("runs/paper")
SAMPLES = 64
"""Samples a pixel of pictures that change by tens of per cent."""


def heights(name: str, relief_mm: float | None = None) -> Array:
    """Heights (128, 128) of a bundled texture in mm, by default with the relief of its file."""
    return load_heights(FOLDER / "textures" / f"{name}.png", relief_mm=relief_mm)


@cache
def scene(name: str) -> Scene:
    """The studio with a bundled texture in it."""
    return load_scene("studio", texture=find_texture(name))


def change_percent(name: str, after: Array) -> float:
    """Mean change of the pictures of a bundled texture, in % of their mean, with common random numbers."""
    studio = scene(name)
    one, other = (
        studio.render(relief, samples=SAMPLES, seed=1).numpy() for relief in (studio.heights, after)
    )
    return 100.0 * mean_change(one, other) / float(one.mean())


def optimised(name: str, overrides: list[str], label: str) -> Path:
    """The run directory of a run by the fast models, kept from an earlier call if there is one."""
    folder = RUNS / f"{name}-{label}"
    if not (folder / RESULT).is_file():
        settings = ["look.model=fast", "touch.model=quick", "verify.baseline=false", *overrides]
        run(run_from_scene("studio", name, settings), folder, force=True, quiet=True)
    return folder


def result(folder: Path) -> dict[str, Any]:
    """The content of result.json."""
    content: dict[str, Any] = json.loads((folder / RESULT).read_text())
    return content
