"""The small case that tests of the descent share: waves of 32 x 32 samples, in the paper's studio."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest

import tactile
from optimize.descent.problem import Problem
from optimize.descent.targets import Targets
from relief.ground.arrays import Array
from relief.heightmap import save_heights_exr
from relief.relief import Relief
from tactile.measures import TouchMeasures
from tests.tactile.reliefs import SIZE, waves
from visual.scene import Scene, load_scene

STUDIO = Path(__file__).resolve().parents[2] / "mitsuba_scenes" / "studio.xml"
SAMPLES = 32

ProblemWith = Callable[[Targets], Problem]


def with_heights(problem: Problem, heights: Array) -> Problem:
    """The same problem for a relief of other heights (rows, cols), mm."""
    return replace(problem, relief=replace(problem.relief, heights=heights))


@pytest.fixture(scope="session")
def studio() -> Path:
    """The scene file of the paper's studio."""
    return STUDIO


@pytest.fixture(scope="session")
def texture(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Waves 1.2 to 4 mm long, 1.5 mm from the lowest valley to the highest peak: some throw shadows."""
    path = tmp_path_factory.mktemp("texture") / "waves.exr"
    save_heights_exr(path, waves(SAMPLES, 1.5).numpy())
    return path


@pytest.fixture(scope="session")
def scene(texture: Path) -> Scene:
    """The studio with the waves in it."""
    return load_scene(STUDIO, {"resolution": str(SAMPLES)}, texture=texture)


@pytest.fixture(scope="session")
def problem_with(scene: Scene) -> ProblemWith:
    """The waves with a feel to reach."""
    return lambda targets: Problem(Relief(scene.heights, SIZE), tactile.Skin(), targets, scene)


@pytest.fixture(scope="session")
def original(problem_with: ProblemWith) -> TouchMeasures:
    """What the finger gets from the waves."""
    problem = problem_with(Targets())
    return problem.press(problem.heights, gradients=False)


@pytest.fixture(autouse=True)
def _patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """No stage lasts long enough to be shown, however slow the machine."""
    monkeypatch.setattr("retouch.verbs.progress_display.PATIENCE_S", 1e9)
