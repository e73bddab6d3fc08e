"""Two folders of runs are compared bit for bit."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.runs.same_heights import MODELS, RUNS, as_text, commands, compared, difference
from relief.heightmap import save_heights_exr

HEIGHTS = np.linspace(0.0, 1.5, 256).reshape(16, 16)


def test_equal_is_bit_for_bit() -> None:
    assert difference(HEIGHTS, HEIGHTS.copy()) == {"equal": True, "largest_mm": 0.0}
    other = HEIGHTS.copy()
    other[3, 4] = np.nextafter(other[3, 4], 2.0)
    found = difference(HEIGHTS, other)
    assert not found["equal"]
    assert 0.0 < found["largest_mm"] < 1e-15


@pytest.mark.parametrize("other", [HEIGHTS[:8], HEIGHTS.astype(np.float32), np.full((16, 16), np.nan)])
def test_other_shapes_and_no_numbers_differ(other: np.ndarray) -> None:
    assert difference(HEIGHTS, other) == {"equal": False, "largest_mm": None}


def test_each_run_is_compared_with_its_own(tmp_path: Path) -> None:
    for version in ("before", "now"):
        for case in commands():
            folder = tmp_path / version / case
            folder.mkdir(parents=True)
            off = 0.25 if (version, case) == ("now", "brick+2-fast") else 0.0
            save_heights_exr(folder / "heights.exr", HEIGHTS + off)
    rows = compared(tmp_path / "before", tmp_path / "now")
    assert len(rows) == len(RUNS) * len(MODELS) == 14
    differing = [row for row in rows if not row["equal"]]
    assert [(row["case"], row["models"]) for row in differing] == [("brick+2", "fast")]
    assert differing[0]["largest_mm"] == pytest.approx(0.25)
    assert as_text(rows).count("equal") == 13
    assert "0.25 apart" in as_text(rows)
