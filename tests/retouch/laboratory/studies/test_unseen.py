"""Changes under conditions that a descent has not seen."""

from pathlib import Path

import numpy as np
import pytest

from optimize.run_directory.finished_run import FinishedRun
from optimize.settings.run_file import run_from_scene
from relief.ground.arrays import Array
from relief.heightmap import save_heights_exr
from retouch.laboratory.studies.measuring import unseen as measure
from retouch.laboratory.studies.measuring.measures import MEASURES
from retouch.laboratory.studies.measuring.unseen import UNSEEN, in_hand, unseen
from tests.visual.scenes import SIDE, SIZE_MM, hills


@pytest.mark.slow
def test_a_changed_relief_differs_everywhere_and_a_lifted_one_nowhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    original = hills(0.6)
    np.save(tmp_path / "hills.npy", original)
    run = run_from_scene("studio", tmp_path / "hills.npy", ["touch.jnd=1", f"define.resolution={SIDE}"])
    save_heights_exr(tmp_path / "heights.exr", 1.2 * original, SIZE_MM, 3.0)
    changed = unseen(FinishedRun(tmp_path, run))
    assert changed.keys() == MEASURES["unseen"].columns.keys()
    for name in (*UNSEEN, "fine"):
        mean, rms = changed[f"change_{name}_percent"], changed[f"change_{name}_rms_percent"]
        assert mean is not None and rms is not None
        assert 1.0 < mean < rms < 40.0
    monkeypatch.setattr(measure, "UNSEEN", {"views": UNSEEN["views"]})
    save_heights_exr(tmp_path / "heights.exr", original + 0.25, SIZE_MM, 3.0)
    # In single precision the lifted heights are not quite the same.
    assert max(value for value in unseen(FinishedRun(tmp_path, run)).values() if value is not None) < 0.01


@pytest.mark.slow
def test_twenty_pictures_are_seen_as_in_the_hand(tmp_path: Path) -> None:
    original = hills(0.6)
    np.save(tmp_path / "hills.npy", original)
    run = run_from_scene("in-hand", tmp_path / "hills.npy", ["touch.jnd=1", f"define.resolution={SIDE}"])
    changes = []
    for factor in (1.0, 1.2, 1.4):
        save_heights_exr(tmp_path / "heights.exr", factor * original, SIZE_MM, 3.0)
        changed = in_hand(FinishedRun(tmp_path, run))
        assert changed.keys() == MEASURES["hand"].columns.keys()
        changes.append([changed[f"change_hand_{key}percent"] or 0.0 for key in ("", "rms_", "most_")])
    assert max(changes[0]) < 0.01
    for mean, rms, most in changes[1:]:
        assert 1.0 < mean < min(rms, most) < 40.0
    assert changes[2][0] == pytest.approx(2.0 * changes[1][0], rel=0.3)


@pytest.mark.slow
def test_a_tile_of_another_size_is_seen_as_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Scenes fit its plate, and light comes in from its neighbours: rolled, its pictures change alike."""
    monkeypatch.setattr(measure, "UNSEEN", {"lights": UNSEEN["lights"]})
    changes = []
    for shift in (0, 11):
        before, after = (np.roll(tile(height), shift, (0, 1)) for height in (0.6, 0.7))
        save_heights_exr(tmp_path / "tile.exr", before, 2.0 * SIZE_MM, 3.0)
        save_heights_exr(tmp_path / "heights.exr", after, 2.0 * SIZE_MM, 3.0)
        run = run_from_scene("studio", tmp_path / "tile.exr", ["touch.jnd=1", "repeats=true"])
        changes.append(unseen(FinishedRun(tmp_path, run))["change_lights_percent"])
    assert changes[0] is not None and changes[0] > 1.0
    assert changes[1] == pytest.approx(changes[0], rel=0.03)


def tile(height: float) -> Array:
    """Hills of a height (mm) on a period of 32 samples."""
    y, x = np.meshgrid(*[2.0 * np.pi * np.arange(32) / 32] * 2, indexing="ij")
    return np.asarray(0.25 * height * (2.0 + np.sin(x + 2.0 * y) + np.cos(3.0 * x)))
