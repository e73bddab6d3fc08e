"""Picture change under conditions that a descent has not seen: other lights, materials, views, pixels.

The scenes are variants of the studio that come with Retouch, so that results from any scene compare. All
pictures are Mitsuba's, of the original and of the result with common random numbers, and changes are
estimated as in `optimize.verification.picture_change`.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from mitsuba_scenes import find_file
from optimize.settings.run_file import Run
from optimize.verification.picture_change import change
from optimize.verification.picture_metrics import pixel_weights
from optimize.verification.verification import Verification
from relief.common.arrays import Array
from relief.common.progress import stage
from relief.heightmap import load_heights
from relief.relief import Relief
from visual.noise import Batches, batched
from visual.scene import Scene, load_scene, plate_size_mm

SAMPLES = 16
"""Samples a pixel. On results at +2 and -2 JND mean changes are then within 3 % of those by 256 samples
(docs/evidence/studies.md)."""
LIFT_STEP_MM = 0.25
"""Lifts are multiples of this, so that the pictures of an original serve many results."""
KEPT = 16
"""Scenes with pictures of an original that a process keeps: rows of a study mostly share their texture."""
REFINEMENT = 2
"""Resolution of the finer pictures in units of the run's own."""


@dataclass(frozen=True)
class Condition:
    """A scene to look at results in.

    Attributes:
        scene: name of a bundled scene.
        defines: values of its parameters.
    """

    scene: str
    defines: Mapping[str, str]


UNSEEN: Mapping[str, Sequence[Condition]] = {
    "lights": (Condition("other_lights", {}),),
    "materials": tuple(Condition("other_materials", {"material": name}) for name in ("matte", "bronze")),
    "views": (Condition("five_views", {"above": "0", "west": "0", "south": "0"}),),
    "envmap": (Condition("evening", {}),),
}
"""Scenes by what is other than in the studio; changes in several scenes are averaged."""


def unseen(run_dir: Path, run: Run, result: Verification) -> dict[str, float | None]:
    """Changes of pictures from the original to the result of a run.

    Args:
        run_dir: of the run.
        run: its settings.
        result: its verification; not needed.

    Returns:
        The columns of the measure.
    """
    own = run.relief(plate_size_mm(run.scene, run.define))
    before, after = (
        replace(own, heights=heights)
        for heights in _aligned(own.heights, load_heights(run_dir / "heights.exr"))
    )
    columns: dict[str, float | None] = {}
    with stage("looking under other conditions", len(UNSEEN) + 1) as advance:
        for name, conditions in UNSEEN.items():
            each = [_changes_in(condition, before, after) for condition in conditions]
            columns |= _columns(name, np.mean(each, axis=0))
            advance()
        resolution = REFINEMENT * max(load_scene(run.scene, run.define, relief=own).resolution)
        columns |= _columns("fine", _changes(run.scene, run.define, before, after, resolution))
        advance()
    return columns


def _columns(name: str, changes: Array) -> dict[str, float | None]:
    mean, rms = map(float, changes)
    return {f"change_{name}_percent": mean, f"change_{name}_rms_percent": rms}


def _aligned(before: Array, after: Array) -> tuple[Array, Array]:
    """The two reliefs with equal mean heights, none below 0: a plate lifted as a whole looks the same."""
    moved = after - after.mean() + before.mean()
    lift = LIFT_STEP_MM * np.ceil(max(0.0, -float(moved.min())) / LIFT_STEP_MM)
    return before + lift, moved + lift


def _changes_in(condition: Condition, before: Relief, after: Relief) -> Array:
    """Changes in a bundled scene, which fits every plate, with a pixel a height sample."""
    defines = {"resolution": str(before.surface.shape[1]), **condition.defines}
    return _changes(find_file(condition.scene, ".xml"), defines, before, after)


def _changes(
    path: Path,
    defines: Mapping[str, str],
    before: Relief,
    after: Relief,
    resolution: int | None = None,
) -> Array:
    """Mean and root mean square change of a scene's pictures, (2,), in % of the mean picture of the plate."""
    scene, one = _original(path, tuple(defines.items()), _Shown(before), resolution)
    weights = pixel_weights(scene.plate_weights(resolution), scene.weights)
    other = batched(scene, after.heights, SAMPLES, seed=1, resolution=resolution)
    measured = change(one, other, weights=weights)
    level = float((weights * one.mean).mean())
    return 100.0 / level * np.array([measured.estimate, measured.rms_less_noise])


class _Shown:
    """A relief that equals another one of the same heights, size and repeats, for the cache."""

    def __init__(self, relief: Relief) -> None:
        self.relief = relief
        self._key = relief.heights.tobytes(), relief.surface

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Shown) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


@lru_cache(maxsize=KEPT)
def _original(
    path: Path, defines: tuple[tuple[str, str], ...], shown: _Shown, resolution: int | None
) -> tuple[Scene, Batches]:
    """A scene with an original, and its pictures."""
    scene = load_scene(path, dict(defines), relief=shown.relief)
    return scene, batched(scene, shown.relief.heights, SAMPLES, seed=1, resolution=resolution)
