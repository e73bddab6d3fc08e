"""A checkpoint gives back what was put in, bit for bit, or says in one line that it cannot."""

from pathlib import Path

import numpy as np
import pytest
from safetensors import safe_open
from safetensors.numpy import load_file, save_file

from optimize.descent.correction import CorrectionState, OuterIteration
from optimize.descent.driver import Iterate
from optimize.descent.targets import Targets
from optimize.runs.checkpoint import FILE, Checkpoint, load_checkpoint, save_checkpoint
from relief.errors import InputError


def iterate(step: int) -> Iterate:
    random = np.random.default_rng(step)
    memory = {"pressure": random.random((4, 4)), "damping": np.array(0.125)}
    return Iterate(
        step,
        heights=random.random((4, 4)),
        values={"roughness": random.random(), "contact_area_mm2": random.random()},
        contact_fraction=random.random(),
        picture_mean=random.random(),
        picture_rms=random.random(),
        memory=memory,
    )


FRESH = CorrectionState(Targets.of(0.01, roughness=0.1))
CORRECTED = CorrectionState(
    Targets.of(0.01, roughness=0.1 / 3.0, contact_area_mm2=55.0),
    (OuterIteration({"roughness": 0.1}, iterate(3).values, iterate(4).values, 0.1, 4),),
    iterate(4),
)
CHECKPOINT = Checkpoint(current=iterate(7), best=iterate(5), state=CORRECTED, seconds=12.25)


def assert_same(one: Iterate, other: Iterate) -> None:
    numbers = ("step", "values", "contact_fraction", "picture_mean", "picture_rms")
    assert [getattr(one, name) for name in numbers] == [getattr(other, name) for name in numbers]
    np.testing.assert_array_equal(one.heights, other.heights)
    assert one.memory.keys() == other.memory.keys()
    for name, value in one.memory.items():
        np.testing.assert_array_equal(value, other.memory[name])
        assert value.shape == other.memory[name].shape


def test_what_is_saved_is_loaded(tmp_path: Path) -> None:
    save_checkpoint(tmp_path, CHECKPOINT)
    loaded = load_checkpoint(tmp_path)
    assert_same(loaded.current, CHECKPOINT.current)
    assert_same(loaded.best, CHECKPOINT.best)
    assert loaded.seconds == CHECKPOINT.seconds
    assert loaded.state.surrogate_targets == CORRECTED.surrogate_targets
    assert loaded.state.iterations == CORRECTED.iterations
    assert loaded.state.closest is not None and CORRECTED.closest is not None
    assert_same(loaded.state.closest, CORRECTED.closest)


def test_the_state_of_a_run_that_was_never_verified_is_loaded(tmp_path: Path) -> None:
    save_checkpoint(tmp_path, Checkpoint(iterate(1), iterate(1), FRESH, 1.0))
    assert load_checkpoint(tmp_path).state == FRESH


def test_it_does_not_mind_how_arrays_lie_in_memory(tmp_path: Path) -> None:
    heights = np.arange(12.0).reshape(3, 4)
    memory = {"pressure": heights[::-1, ::2]}
    turned = Iterate(1, heights.T, iterate(1).values, 0.5, 1.0, 1.0, memory)
    save_checkpoint(tmp_path, Checkpoint(turned, turned, FRESH, 0.0))
    assert_same(load_checkpoint(tmp_path).current, turned)


def test_the_last_one_is_replaced_and_nothing_else_is_left(tmp_path: Path) -> None:
    save_checkpoint(tmp_path, Checkpoint(iterate(1), iterate(1), FRESH, 1.0))
    save_checkpoint(tmp_path, CHECKPOINT)
    assert load_checkpoint(tmp_path).current.step == 7
    assert [p.relative_to(tmp_path) for p in tmp_path.rglob("*") if p.is_file()] == [FILE]


def test_a_write_that_fails_leaves_the_last_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    save_checkpoint(tmp_path, CHECKPOINT)

    def full(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.replace", full)
    with pytest.raises(OSError, match="No space"):
        save_checkpoint(tmp_path, Checkpoint(iterate(8), iterate(8), FRESH, 13.0))
    assert load_checkpoint(tmp_path).current.step == 7
    assert [p.relative_to(tmp_path) for p in tmp_path.rglob("*") if p.is_file()] == [FILE]


def refused(run_dir: Path) -> str:
    with pytest.raises(InputError) as caught:
        load_checkpoint(run_dir)
    (line,) = str(caught.value).splitlines()
    assert line.startswith(f"{run_dir / FILE}: ")
    return line


def test_a_folder_without_one_is_told(tmp_path: Path) -> None:
    assert "no such file" in refused(tmp_path)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.99])
def test_a_file_cut_short_is_told(tmp_path: Path, share: float) -> None:
    save_checkpoint(tmp_path, CHECKPOINT)
    content = (tmp_path / FILE).read_bytes()
    (tmp_path / FILE).write_bytes(content[: int(share * len(content))])
    assert "not a checkpoint" in refused(tmp_path)


@pytest.mark.parametrize("content", [b"\0" * 100, b"\xff" * 100, b"not a checkpoint\nat all\n", b"{}"])
def test_garbage_is_told(tmp_path: Path, content: bytes) -> None:
    (tmp_path / FILE).parent.mkdir()
    (tmp_path / FILE).write_bytes(content)
    assert "not a checkpoint" in refused(tmp_path)


NUMBERS = '{"step": 1, "roughness": 0.1}'
BAD_NUMBERS = [
    None,
    {},
    {"seconds": "1.0"},
    {"seconds": "1.0", "current": "7", "best": "7"},
    {"seconds": "1.0", "current": "[]", "best": "[]"},
    {"seconds": "1.0", "current": "{", "best": "{"},
    {"seconds": "1.0", "current": NUMBERS, "best": NUMBERS},
]


@pytest.mark.parametrize("numbers", BAD_NUMBERS)
def test_numbers_that_are_missing_or_none_are_told(tmp_path: Path, numbers: dict[str, str] | None) -> None:
    save_checkpoint(tmp_path, CHECKPOINT)
    save_file(load_file(tmp_path / FILE), tmp_path / FILE, metadata=numbers)
    assert "not a checkpoint" in refused(tmp_path)


def test_heights_that_are_missing_are_told(tmp_path: Path) -> None:
    save_checkpoint(tmp_path, CHECKPOINT)
    path = tmp_path / FILE
    with safe_open(path, framework="np") as file:
        numbers = file.metadata()
    tensors = load_file(path)
    del tensors["best.heights"]
    save_file(tensors, path, metadata=numbers)
    assert "best.heights" in refused(tmp_path)
