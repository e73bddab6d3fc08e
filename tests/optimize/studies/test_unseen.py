"""Changes under conditions that a descent has not seen."""

from pathlib import Path

import numpy as np
import pytest

from optimize.runs.config import run_from_scene
from optimize.studies import unseen as measure
from optimize.studies.measures import MEASURES
from optimize.studies.unseen import UNSEEN, unseen
from relief.heightmap import save_heights_exr
from tests.visual.scenes import SIDE, SIZE_MM, hills


def test_a_changed_relief_differs_everywhere_and_a_lifted_one_nowhere(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    original = hills(0.6)
    np.save(tmp_path / "hills.npy", original)
    run = run_from_scene("studio", tmp_path / "hills.npy", ["touch.jnd=1", f"define.resolution={SIDE}"])
    save_heights_exr(tmp_path / "heights.exr", 1.1 * original, SIZE_MM, 3.0)
    changed = unseen(tmp_path, run, {})
    assert changed.keys() == MEASURES["unseen"].columns.keys()
    for name in (*UNSEEN, "fine"):
        mean, rms = changed[f"change_{name}_percent"], changed[f"change_{name}_rms_percent"]
        assert mean is not None and rms is not None
        assert 1.0 < mean < rms < 30.0
    monkeypatch.setattr(measure, "UNSEEN", {"views": UNSEEN["views"]})
    save_heights_exr(tmp_path / "heights.exr", original + 0.25, SIZE_MM, 3.0)
    # In single precision the lifted heights are not quite the same.
    assert max(value for value in unseen(tmp_path, run, {}).values() if value is not None) < 0.01


def test_scenes_of_another_size_give_no_value(tmp_path: Path) -> None:
    before, after = hills(0.6), hills(0.7)
    run = run_from_scene("studio", "gravel", ["touch.jnd=1"])
    for conditions in UNSEEN.values():
        assert measure._changes_in(conditions[0], run, 2.0 * SIZE_MM, before, after) is None
