"""What steps see stands beside what is verified."""

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from optimize.settings.run_file import Run, run_from_scene
from optimize.verification.picture_change import Certainty
from optimize.verification.picture_metrics import look
from optimize.verification.steps_seen import StepsSeen
from optimize.verification.verification import PictureChange
from relief.ground.errors import InputError
from tests.visual.scenes import hills, sky, write_scene
from visual.picture_noise import Batches
from visual.scene import Scene, load_scene


@pytest.fixture(scope="module")
def run(studio: Path, texture: Path) -> Callable[..., Run]:
    return lambda *settings: run_from_scene(studio, texture, ["touch.jnd=1", *settings])


@pytest.fixture(scope="module")
def seen(run: Callable[..., Run], scene: Scene) -> StepsSeen:
    of_run = StepsSeen.of(run(), scene, "exact")
    assert of_run is not None
    return of_run


PICTURED: Any = SimpleNamespace(
    white=1.0,
    weights=np.ones(1),
    plate_weights=lambda: np.ones((1, 16, 16)),
    pixels_per_mm=lambda: np.ones(1),
)
"""What `look` asks of a scene."""


def verified(percent: float, certainty: Certainty = Certainty.KNOWN) -> PictureChange:
    """A verified change of so many percent."""
    before = np.full((4, 1, 16, 16), 0.5)
    of_pictures = look(Batches(before, 64), Batches((1.0 + 0.01 * percent) * before, 64), PICTURED)
    noise = of_pictures.noise.model_copy(update={"certainty": certainty.name.lower()})
    return of_pictures.model_copy(update={"noise": noise})


@pytest.mark.slow
def test_what_steps_see_of_a_change_is_what_pictures_show(seen: StepsSeen, scene: Scene) -> None:
    assert seen.bias.shape == (len(scene.conditions),) and seen.bias.max() < 0.03
    assert seen.change_percent(scene.heights) == 0.0
    lower = 0.9 * scene.heights
    shown = [scene.render(relief, samples=512, seed=1).numpy() for relief in (scene.heights, lower)]
    percent = 100.0 * np.abs(shown[1] - shown[0]).mean() / shown[0].mean()
    assert seen.change_percent(lower) == pytest.approx(percent, rel=0.06)


@pytest.mark.parametrize(
    ("settings", "look"),
    [
        (("descent.method=scaling",), "exact"),
        (("look.model=heights",), "heights"),
        (("descent.method=adam", "look.samples=4"), "exact"),
    ],
)
def test_where_steps_look_at_no_such_pictures_there_are_no_numbers(
    run: Callable[..., Run], scene: Scene, settings: tuple[str, ...], look: str
) -> None:
    assert StepsSeen.of(run(*settings), scene, look) is None


@pytest.mark.parametrize(
    ("saw", "came", "certainty", "line"),
    [
        (1.4, 9.8, Certainty.KNOWN, True),
        (1.4, 9.8, Certainty.COARSE, True),
        (1.4, 9.8, Certainty.WITHIN_NOISE, False),
        (0.3, 1.2, Certainty.KNOWN, False),
        (4.0, 5.5, Certainty.KNOWN, False),
        (9.8, 1.4, Certainty.KNOWN, False),
        (0.0, 0.0, Certainty.SAME, False),
    ],
)
def test_a_much_larger_verified_change_has_a_line(
    seen: StepsSeen, saw: float, came: float, certainty: Certainty, line: bool
) -> None:
    note = seen.note(saw, verified(came, certainty))
    assert (note is not None) == line
    if note is not None:
        assert "changed by 9.8 %, but steps saw 1.4 %: likely" in note


def test_the_likely_reason_is_the_bias_or_else_the_bounces(seen: StepsSeen, scene: Scene) -> None:
    bouncing = replace(scene.needs, direct=False)

    def note(bias: float, direct: bool) -> str:
        with pytest.MonkeyPatch.context() as patch:
            patch.setattr(scene, "needs", scene.needs if direct else bouncing)
            return replace(seen, bias=np.array([bias])).note(1.0, verified(5.0)) or ""

    assert "bounces" in note(0.01, direct=False)
    assert "bounces" not in note(0.01, direct=True) + note(0.07, direct=False)
    assert "highlight" in note(0.07, direct=False)


def test_black_pictures_divide_nothing() -> None:
    black = Batches(np.zeros((4, 1, 16, 16)), 64)
    of_pictures = look(black, black, PICTURED)
    assert of_pictures.change_percent == of_pictures.mean_change_percent_of_mean == 0.0
    assert of_pictures.noise.certainty == "same"
    lit = Batches(black.pictures + 0.1, 64)
    assert look(black, lit, PICTURED).change_percent_of_white > 5.0


def test_black_pictures_of_steps_are_refused(run: Callable[..., Run], tmp_path: Path) -> None:
    matte = '<bsdf type="twosided"><bsdf type="diffuse"/></bsdf>'
    below = '<scale x="4" y="4"/><lookat origin="0, 0, -20" target="0, 0, 0" up="0, 1, 0"/>'
    scene = load_scene(write_scene(tmp_path, hills(), [sky()], material=matte, camera=below))
    with pytest.raises(InputError, match="the pictures by which steps steer are black"):
        StepsSeen.of(run(), scene, "exact")
