"""Memory that a run takes, refused where the machine has less."""

from pathlib import Path

import pytest

from optimize.runs import memory
from relief.ground.errors import InputError


@pytest.mark.parametrize(
    ("gib", "remedy"),
    [
        (32.0, "--samples 2048 makes"),
        (20.0, "--samples 1024 makes"),
        (0.1, "a wider touch.spacing_mm takes less"),
    ],
)
def test_a_texture_too_large_for_memory_is_refused_with_one_that_fits(
    gib: float, remedy: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(memory, "machine_gib", lambda: gib)
    with pytest.raises(
        InputError, match=rf"4096 x 4096 samples touched at 841 places take about 88 .*{remedy}"
    ):
        memory.check_memory_of(Path("c10.exr"), (4096, 4096), 841)
