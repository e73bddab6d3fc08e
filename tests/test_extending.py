"""The page on extending names files and tables that are there, and one row is all that a new thing takes."""

import json
import re
import subprocess
import sys
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
import pytest
import scipy.sparse as sp
import torch
from torch import Tensor

from optimize.descent.driver import ArraySchema, Iterate
from optimize.descent.methods import METHODS, Method, MethodSettings
from optimize.descent.problem import Problem
from optimize.descent.stop_reason import StopReason
from optimize.estimates.forecast import expected_steps, rough_seconds
from optimize.runs.job import Result, resume, run
from optimize.settings.run_file import Run, run_from_scene
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.heightmap import save_heights_exr
from tests.tactile.reliefs import waves
from visual.exact.view import Pictures
from visual.looks import LOOKS, FixedSamples, LookModel, Rendering, StepView
from visual.scene import Scene

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "howto" / "extending.md").read_text(encoding="utf-8")
FILES = sorted(set(re.findall(r"`([a-z_]+/[\w./]*)`", PAGE)))
TABLES = sorted(set(re.findall(r"`([A-Z]+)` in `([\w/.]+)`", PAGE)))
SAMPLES = 32


@pytest.mark.parametrize("file", FILES)
def test_each_file_is_there(file: str) -> None:
    assert (ROOT / file).exists()


@pytest.mark.parametrize(("table", "file"), TABLES)
def test_each_table_is_in_its_file(table: str, file: str) -> None:
    assert re.search(rf"^{table}\b.* = ", (ROOT / file).read_text(encoding="utf-8"), re.MULTILINE)


def test_the_page_names_them() -> None:
    assert len(FILES) >= 20
    assert len(TABLES) >= 10


@pytest.fixture(scope="module")
def texture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("texture") / "waves.exr"
    save_heights_exr(path, waves(SAMPLES, 1.5).numpy())
    return path


def settings(texture: Path, *overrides: str) -> Run:
    """A tiny run."""
    tiny = [f"define.resolution={SAMPLES}", "descent.steps=2", "touch.model=quick", "touch.jnd=-0.5"]
    checked = ["verify.model=layer", "verify.samples=4", "verify.corrections=0", "verify.baseline=false"]
    return run_from_scene("studio", texture, [*tiny, *checked, *overrides])


class Lowering:
    """A descent method that knows one thing to do: each step lowers the relief by a tenth."""

    patience: int | None = None

    def __init__(self, problem: Problem) -> None:
        self._problem = problem

    @classmethod
    def of_run(cls, problem: Problem, steps: int, settings: MethodSettings) -> Self:
        return cls(problem)

    @staticmethod
    def checkpoint_schema(heights: Array, memory: Mapping[str, Array]) -> Mapping[str, ArraySchema]:
        return {}

    def begin(self, step: int, heights: Array, memory: dict[str, Array]) -> Iterate:
        touch = self._problem.press(heights, gradients=False)
        return Iterate(step, heights, touch.values, touch.contact_fraction, 1.0, 1.0, {})

    def advance(self, iterate: Iterate) -> Iterate:
        return self.begin(iterate.step + 1, 0.9 * iterate.heights, {})

    def reason_to_stop(self, iterate: Iterate) -> None:
        return None


@pytest.mark.slow
def test_a_descent_method_is_a_class_and_a_row(
    texture: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with pytest.raises(InputError, match=r"descent\.method: Input should be 'gauss-newton', "):
        settings(texture, "descent.method=lowering")
    row = Method(f"{__name__}:Lowering", frozenset({"descent.steps"}), seconds=lambda effort: 1e4)
    monkeypatch.setitem(METHODS, "lowering", row)
    lowering = settings(texture, "descent.method=lowering")
    assert expected_steps(lowering) == 2 and rough_seconds(lowering) > 1e4
    with pytest.raises(InputError, match=r"look\.masking: lowering has no weights by contrast; gauss-newton"):
        settings(texture, "descent.method=lowering", "look.masking=1")
    result = run(lowering, tmp_path / "out")
    number = result.summary["stop"]["best_step"]
    assert number > 0 and result.summary["settings"]["descent"]["method"] == "lowering"
    np.testing.assert_allclose(result.heights, 0.9**number * waves(SAMPLES, 1.5).numpy(), atol=1e-6)
    assert result.summary["touch"]["verified_roughness"] < result.summary["touch"]["initial_roughness"]
    again = resume(tmp_path / "out")
    np.testing.assert_array_equal(again.heights, result.heights)


@dataclass(frozen=True)
class SlopeView:
    """The slope of each sample toward the next as every picture, with constant Jacobians."""

    shape: tuple[int, int]
    conditions: int = 1
    overhead: bool = True

    @property
    def differences(self) -> sp.csr_matrix:
        samples = np.arange(self.shape[0] * self.shape[1]).reshape(self.shape)
        forward = sp.identity(samples.size, format="csr")[np.roll(samples, -1, axis=1).ravel()]
        return sp.csr_matrix(forward - sp.identity(samples.size))

    def evaluate(self, heights: Array, jacobian: bool = True, edges: bool = True) -> Pictures:
        slopes = 1.0 + (self.differences @ heights.ravel()).reshape(self.shape)
        pictures = np.stack([slopes] * self.conditions)
        return Pictures(pictures, (self.differences,) * self.conditions if jacobian else ())


class SlopeLook:
    """Slopes of the relief as a look."""

    def __init__(self, scene: Scene) -> None:
        self._view = SlopeView(scene.surface.shape, len(scene.conditions))

    def check(self) -> None:
        """Every scene has slopes."""

    def pictures(self, heights: Tensor, rendering: Rendering) -> Tensor:
        slopes = 1.0 + torch.roll(heights, -1, -1) - heights
        return torch.stack([slopes] * self._view.conditions, dim=-3)

    def views(self, samples: FixedSamples) -> tuple[StepView, ...]:
        return (self._view,)

    def plate_weights(self, pictures: Array) -> Array:
        return np.ones_like(pictures)


def slopes_changed(result: Result) -> float:
    view = SlopeView((SAMPLES, SAMPLES))
    before, after = (view.evaluate(h).pictures for h in (waves(SAMPLES, 1.5).numpy(), result.heights))
    return float(np.square(after - before).mean())


@pytest.mark.slow
def test_a_look_is_a_class_and_a_row(texture: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match=r"look\.model: Input should be 'exact', "):
        settings(texture, "look.model=slopes")
    monkeypatch.setitem(LOOKS, "slopes", LookModel(f"{__name__}:SlopeLook", step_s=1e-5))
    results = {
        look: run(settings(texture, f"look.model={look}"), tmp_path / look) for look in ("slopes", "heights")
    }
    assert results["slopes"].summary["look"]["model"] == "slopes"
    for result in results.values():
        assert result.stop in (StopReason.CONVERGED, StopReason.STEP_LIMIT)
    assert 0.0 < slopes_changed(results["slopes"]) < slopes_changed(results["heights"])
    by_adam = run(settings(texture, "look.model=slopes", "descent.method=adam"), tmp_path / "adam")
    assert by_adam.summary["stop"]["steps"] == 2


def retouch(folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """The command in a process with one more quantity, because run files get their keys when imported."""
    command = [sys.executable, "-m", "tests.one_quantity_more", *arguments, "-o", str(folder)]
    return subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)


@pytest.mark.slow
@pytest.mark.parametrize(
    "target",
    [
        ("--mean-gap-scale", "0.97"),
        ("--set=touch.mean_gap_mm_map={map}",),
        ("--feel-of", "{other}", "--feel-of-quantity", "gap"),
    ],
    ids=["number", "a map", "feel of another"],
)
def test_a_quantity_is_a_row(texture: Path, tmp_path: Path, target: tuple[str, ...]) -> None:
    save_heights_exr(tmp_path / "other.exr", waves(SAMPLES, 1.45).numpy())
    np.save(tmp_path / "map.npy", np.full((SAMPLES, SAMPLES), 0.1))
    files = {"other": tmp_path / "other.exr", "map": tmp_path / "map.npy"}
    options = [option.format_map(files) for option in target]
    tiny = ["touch.model=quick", "look.model=fast", "verify.model=layer", "verify.samples=4"]
    arguments = ["optimize", str(texture), *options, "-D", f"resolution={SAMPLES}", "--no-baseline"]
    done = retouch(tmp_path / "out", *arguments, *(f"--set={each}" for each in tiny))
    assert done.returncode == 0, done.stderr
    touch = json.loads((tmp_path / "out" / "result.json").read_text())["touch"]
    assert touch["target_mean_gap_mm"] == pytest.approx(touch["mean_gap_mm"], rel=0.01)
    assert touch["initial_mean_gap_mm"] != pytest.approx(touch["mean_gap_mm"], rel=0.01)
    report = (tmp_path / "out" / "report.html").read_text()
    assert "Mean gap" in report and "The mean distance of the skin from the plate." in report
    assert "mean gap" in done.stdout


@pytest.mark.slow
def test_a_quantity_is_compared(texture: Path, tmp_path: Path) -> None:
    save_heights_exr(tmp_path / "other.exr", waves(SAMPLES, 1.45).numpy())
    done = retouch(tmp_path / "page.html", "compare", str(texture), str(tmp_path / "other.exr"), "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["first"]["mean_gap_mm"] > 0.0
    page = (tmp_path / "page.html").read_text()
    assert "Mean gap" in page and "The mean distance of the skin from the plate." in page
