"""`--fast`: the fast look where it can show the scene, else exact light, told before anything is pressed."""

import logging
from pathlib import Path
from typing import Any

import pytest

from optimize.runs.preparation import steering_look
from optimize.settings.run_file import run_from_scene
from relief.ground.errors import InputError
from retouch.verbs.runs import optimize as run
from tests.tactile.reliefs import waves
from tests.visual.exact.test_view import OBLIQUE
from tests.visual.scenes import ABOVE, FLOOR, LOW, SIDE, sun, write_scene
from visual.scene import load_scene


@pytest.mark.parametrize(
    ("written", "obstacle"),
    [
        ({}, None),
        ({"rows": 2 * SIDE, "cols": 2 * SIDE}, None),
        ({"rfilter": "gaussian"}, None),
        ({"camera": OBLIQUE}, None),
        ({"camera": LOW}, "sensor: the fast look sees from at most 70 degrees off straight above"),
        ({"more": FLOOR}, "shape: the fast look knows no shape but the plate"),
        ({"max_depth": 3}, "integrator: max_depth: the fast look has direct light only"),
    ],
)
def test_other_scenes_fall_back_to_exact_light_in_one_line(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, written: dict[str, Any], obstacle: str | None
) -> None:
    path = write_scene(tmp_path, waves(SIDE, 1.0).numpy(), [sun(35)], **{"camera": ABOVE, **written})
    scene, texture = load_scene(path), tmp_path / "heights.npy"
    auto, fast, shading, exact, heights = (
        run_from_scene(path, texture, ["touch.jnd=1", f"look.model={model}"])
        for model in ("auto", "fast", "shading", "exact", "heights")
    )
    assert (steering_look(exact, scene), steering_look(heights, scene)) == ("exact", "heights")
    assert not caplog.records
    if obstacle is None:
        assert (steering_look(auto, scene), steering_look(fast, scene)) == ("fast", "fast")
        assert steering_look(shading, scene) == "shading"
        return
    with caplog.at_level(logging.WARNING):
        assert steering_look(auto, scene) == "exact"
    (record,) = caplog.records
    assert record.getMessage().startswith("steps take exact light: ")
    assert obstacle in record.getMessage()
    for refused in (fast, shading):
        with pytest.raises(InputError, match=obstacle):
            steering_look(refused, scene)


def test_a_fast_look_that_cannot_be_is_refused_before_the_skin_is_built(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = write_scene(tmp_path, waves(SIDE, 1.0).numpy(), [sun(35)], camera=LOW)
    monkeypatch.setenv("RETOUCH_CACHE", str(tmp_path / "cache"))
    skin = ["touch.jnd=1", "touch.thickness_mm=2.2", "look.model=fast"]
    with pytest.raises(InputError, match="at most 70 degrees"):
        run(run_from_scene(path, tmp_path / "heights.npy", skin), tmp_path / "out")
    assert not list((tmp_path / "cache").glob("*.safetensors"))
    assert not (tmp_path / "out").exists()
