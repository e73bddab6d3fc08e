"""Picture change under conditions that a descent has not seen: other lights, materials, views, pixels.

The measure `hand` looks at a result as one who turns it in the hand: twenty pictures from four sides.

The scenes are variants of the studio that come with Retouch, so that results from any scene compare. All
pictures are Mitsuba's, of the original and of the result with common random numbers, and changes are
estimated as in `optimize.verification.picture_change`.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np

from mitsuba_scenes import find_file
from optimize.run_directory.finished_run import FinishedRun
from optimize.verification.jod import jod, jod_obstacle
from optimize.verification.picture_change import change
from optimize.verification.picture_metrics import pixel_weights, pixels_per_degree
from relief.ground.arrays import Array
from relief.ground.progress import stage
from relief.relief import Relief
from visual.picture_noise import Batches, batched
from visual.scene import Scene, load_scene

SAMPLES = 16
"""Samples a pixel. On results at +2 and -2 JND mean changes are then within 3 % of those by 256 samples
(docs/evidence/paper.md)."""
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
IN_HAND = (Condition("in-hand-unseen", {}), Condition("in-hand-window", {}))
"""Scenes of the measure `hand`: sixteen pictures under lamps, four under a sky; all count alike."""


def unseen(run: FinishedRun) -> dict[str, float | None]:
    """Changes of pictures from the original to the result of a run.

    Returns:
        The columns of the measure.
    """
    before, after, settings = run.original, run.result.heights, run.settings
    columns: dict[str, float | None] = {}
    with stage("looking under other conditions", len(UNSEEN) + 1) as advance:
        for name, conditions in UNSEEN.items():
            each = [_changes_in(condition, before, after) for condition in conditions]
            columns |= _columns(name, np.mean(each, axis=0))
            advance()
        resolution = REFINEMENT * max(load_scene(settings.scene, settings.define, relief=before).resolution)
        columns |= _columns("fine", _changes(settings.scene, settings.define, before, after, resolution))
        advance()
    return columns


def in_hand(run: FinishedRun) -> dict[str, float | None]:
    """Changes of twenty pictures of a finished run from the sides of `IN_HAND`.

    Returns:
        The columns of the measure; those of JOD are empty where its package is missing.
    """
    before, after, settings = run.original, run.result.heights, run.settings
    changes, eyes = list[tuple[float, float, float]](), list[float]()
    with stage("looking at it as if in the hand", len(IN_HAND)) as advance:
        for condition in IN_HAND:
            scene, one, other = _seen(*_fitted(condition, before), before, after)
            weights = scene.plate_weights()
            for number in range(len(scene.conditions)):
                only = slice(number, number + 1)
                alone, other_alone = (replace(each, pictures=each.pictures[:, only]) for each in (one, other))
                measured = change(alone, other_alone, weights=weights[only])
                level = float((weights[only] * alone.mean).mean())
                changes.append((measured.estimate, measured.square, level))
            if jod_obstacle() is None:
                eyes += [
                    jod(
                        shown,
                        changed,
                        scene.white,
                        pixels_per_degree(float(fine), settings.verify.distance_cm),
                    )
                    for shown, changed, fine in zip(one.mean, other.mean, scene.pixels_per_mm(), strict=True)
                ]
            advance()
    means, squares, levels = np.array(changes).T
    return {
        "change_hand_percent": 100.0 * float(means.mean() / levels.mean()),
        "change_hand_rms_percent": 100.0 * math.sqrt(max(0.0, squares.mean())) / float(levels.mean()),
        "change_hand_most_percent": 100.0 * float((means / levels).max()),
        "jod_hand": float(np.mean(eyes)) if eyes else None,
        "jod_hand_worst": min(eyes, default=None),
    }


def _columns(name: str, changes: Array) -> dict[str, float | None]:
    mean, rms = map(float, changes)
    return {f"change_{name}_percent": mean, f"change_{name}_rms_percent": rms}


def _fitted(condition: Condition, before: Relief) -> tuple[Path, Mapping[str, str]]:
    """A bundled scene, which fits every plate, with a pixel a height sample: its file and its parameters."""
    defines = {"resolution": str(before.surface.shape[1]), **condition.defines}
    return find_file(condition.scene, ".xml"), defines


def _changes_in(condition: Condition, before: Relief, after: Array) -> Array:
    """Changes in a bundled scene."""
    return _changes(*_fitted(condition, before), before, after)


def _changes(
    path: Path,
    defines: Mapping[str, str],
    before: Relief,
    after: Array,
    resolution: int | None = None,
) -> Array:
    """Mean and root mean square change of a scene's pictures, (2,), in % of the mean picture of the plate."""
    scene, one, other = _seen(path, defines, before, after, resolution)
    weights = pixel_weights(scene.plate_weights(resolution), scene.weights)
    measured = change(one, other, weights=weights)
    level = float((weights * one.mean).mean())
    return 100.0 / level * np.array([measured.estimate, measured.rms_less_noise])


def _seen(
    path: Path, defines: Mapping[str, str], before: Relief, after: Array, resolution: int | None = None
) -> tuple[Scene, Batches, Batches]:
    """A scene with its pictures of both reliefs."""
    scene, one = _original(path, tuple(defines.items()), _HashedRelief(before), resolution)
    return scene, one, batched(scene, scene.levelled(after), SAMPLES, seed=1, resolution=resolution)


class _HashedRelief:
    """A relief that equals another one of the same heights, size and repeats, for the cache."""

    def __init__(self, relief: Relief) -> None:
        self.relief = relief
        self._key = relief.heights.tobytes(), relief.surface

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _HashedRelief) and self._key == other._key

    def __hash__(self) -> int:
        return hash(self._key)


@lru_cache(maxsize=KEPT)
def _original(
    path: Path, defines: tuple[tuple[str, str], ...], shown: _HashedRelief, resolution: int | None
) -> tuple[Scene, Batches]:
    """A scene with an original, and its pictures."""
    scene = load_scene(path, dict(defines), relief=shown.relief)
    return scene, batched(scene, shown.relief.heights, SAMPLES, seed=1, resolution=resolution)
