"""Touch loads what it uses: nothing to be imported, neither assembly nor solvers while the cache serves."""

import subprocess
import sys
from pathlib import Path

import pytest
import torch

import tactile
from tactile.model import ModelName

ROOT = Path(__file__).parents[2]
HEAVY = {"torch", "scipy", "skfem", "pypardiso", "safetensors", "surrogate"}


def loaded(script: str) -> set[str]:
    """Which of the heavy packages a script has loaded at its end."""
    report = f"import sys; {script}; print(*({HEAVY!r} & sys.modules.keys()))"
    process = subprocess.run(
        [sys.executable, "-c", report], cwd=ROOT, capture_output=True, text=True, check=True
    )
    return set(process.stdout.split())


def test_importing_touch_loads_nothing_heavy() -> None:
    assert loaded("import tactile; tactile.Skin(), dir(tactile)") == set()


@pytest.mark.slow
@pytest.mark.parametrize("model", ["layer", "quick", "fem"])
def test_pressing_with_a_cached_operator_builds_nothing(model: ModelName) -> None:
    tactile.press(torch.zeros(16, 16), model=model, mesh=16)  # now on disk
    script = f"import torch, tactile; tactile.press(torch.zeros(16, 16), model={model!r}, mesh=16)"
    assert loaded(script) == {"torch", "safetensors", "scipy"}


def test_completion_offers_every_public_name() -> None:
    assert set(tactile.__all__) <= set(dir(tactile))
    assert all(getattr(tactile, name) for name in tactile.__all__)
