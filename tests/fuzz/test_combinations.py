"""Six whole runs with random settings: each key has an effect, or is refused in one line.

`python -m tests.fuzz.combinations --runs 2000 --log FILE` makes as many as are wanted, these among them.
"""

from collections import Counter
from pathlib import Path

import pytest

from tests.fuzz.combinations import combination, runs, verdict, write_inputs

SEED = 26
RUNS = 6


@pytest.mark.slow
def test_a_setting_has_an_effect_or_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    write_inputs(tmp_path)
    counts, number = Counter[str](), 0
    while runs(counts) < RUNS:
        case = combination(SEED, number)
        word, reason = verdict(case, tmp_path)
        assert word != "failed", f"{number}: {case}: {reason}"
        counts[word] += 1
        number += 1
    assert counts["effect"] > counts["bound"] and counts["refused"] > 0
