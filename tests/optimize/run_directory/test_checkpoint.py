"""A checkpoint gives back what was put in, bit for bit, or says in one line that it cannot."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file

from optimize.descent.correction import CorrectionState, OuterIteration
from optimize.descent.driver import Iterate
from optimize.descent.targets import Targets
from optimize.run_directory.checkpoint import FILE, Checkpoint, check_key, load_checkpoint, save_checkpoint
from optimize.run_directory.key import run_key
from optimize.settings.run_file import Run, run_from_scene
from relief.ground.errors import InputError
from relief.ground.tensors import Arrays, read_tensors, tensor_bytes


def iterate(step: int, touches: int = 1) -> Iterate:
    random = np.random.default_rng(step)
    memory = {"pressure": random.random((4, 4)), "damping": np.array(0.125)}
    return Iterate(
        step,
        heights=random.random((4, 4)),
        values={"roughness": random.random(touches), "contact_area_mm2": random.random(touches)},
        contact_fraction=random.random(),
        picture_mean=random.random(),
        picture_rms=random.random(),
        memory=memory,
        fingers=random.random(),
    )


FRESH = CorrectionState(Targets.of(0.01, roughness=0.1))
CORRECTED = CorrectionState(
    Targets.of(0.01, roughness=0.1 / 3.0, contact_area_mm2=55.0),
    (OuterIteration({"roughness": 0.1}, iterate(3).means, iterate(4).means, 0.1, 4),),
    iterate(4),
)
CHECKPOINT = Checkpoint(current=iterate(7), best=iterate(5), state=CORRECTED, seconds=12.25)


def assert_same(one: Iterate, other: Iterate) -> None:
    numbers = ("step", "contact_fraction", "picture_mean", "picture_rms", "fingers")
    assert [getattr(one, name) for name in numbers] == [getattr(other, name) for name in numbers]
    np.testing.assert_equal(one.values, other.values)
    np.testing.assert_array_equal(one.heights, other.heights)
    assert one.memory.keys() == other.memory.keys()
    for name, value in one.memory.items():
        np.testing.assert_array_equal(value, other.memory[name])
        assert value.shape == other.memory[name].shape


def test_every_touch_is_saved(tmp_path: Path) -> None:
    targets = Targets.of(0.01, roughness=[0.1 / 3.0, 0.2, 0.0])
    each = iterate(2, 3)
    save_checkpoint(tmp_path, Checkpoint(each, each, CorrectionState(targets), 1.0))
    loaded = load_checkpoint(tmp_path)
    assert_same(loaded.current, each)
    assert loaded.state.surrogate_targets == targets


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
    heights = np.arange(12.0).reshape(3, 4) / 4.0
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
    forge(tmp_path, lambda tensors, _: tensors.pop("best.heights"))
    assert "best.heights" in refused(tmp_path)


def forge(run_dir: Path, change: Callable[[Arrays, dict[str, Any]], object]) -> None:
    """Write the checkpoint anew, sealed, with something changed in its arrays or its numbers."""
    arrays, text = read_tensors(run_dir / FILE)
    numbers = json.loads(text)
    change(arrays, numbers)
    (run_dir / FILE).write_bytes(tensor_bytes(arrays, json.dumps(numbers)))


def test_any_flipped_bit_is_told(tmp_path: Path) -> None:
    save_checkpoint(tmp_path, CHECKPOINT)
    whole = (tmp_path / FILE).read_bytes()
    for place in range(0, len(whole), 11):
        flipped = bytearray(whole)
        flipped[place] ^= 1 << place % 8
        (tmp_path / FILE).write_bytes(flipped)
        assert "damaged" in refused(tmp_path)


def put(name: str, place: Any, value: object) -> Callable[[Arrays, dict[str, Any]], object]:
    """A change of one value of an array, or of the numbers of an iterate."""

    def change(arrays: Any, numbers: Any) -> None:
        (arrays if name in arrays else numbers)[name][place] = value

    return change


TWO = {"roughness": [0.1], "contact_area_mm2": [1.0]}
FORGERIES: dict[str, tuple[Callable[[Arrays, dict[str, Any]], object], str]] = {
    "heights of 500 mm": (put("current.heights", (0, 0), 500.0), "current.heights"),
    "heights below the plate": (put("best.heights", (0, 0), -0.1), "best.heights"),
    "heights that are none": (put("closest.heights", (0, 0), np.nan), "closest.heights"),
    "heights of another side": (lambda a, _: a.update({"best.heights": np.zeros((3, 3))}), "heights"),
    "heights of one dimension": (lambda a, _: a.update({"best.heights": np.zeros(3)}), "best.heights"),
    "no heights": (lambda a, _: a.update({"best.heights": np.zeros((0, 0))}), "best.heights"),
    "heights of another type": (
        lambda a, _: a.update({"best.heights": np.zeros((4, 4), np.float32)}),
        "best.heights",
    ),
    "memory without end": (put("current.memory.pressure", (1, 1), np.inf), "current.memory.pressure"),
    "a step before the first": (put("current", "step", -1), "current.step"),
    "a best step after the last": (put("best", "step", 8), "steps"),
    "a roughness that is none": (
        put("best", "values", {"roughness": [float("nan")]}),
        "best.values.roughness",
    ),
    "a quantity that is missing": (put("best", "values", {"roughness": [0.1]}), "contact_area_mm2"),
    "values of more touches": (
        put("best", "values", {"roughness": [0.1, 0.1], "contact_area_mm2": [1.0]}),
        "values",
    ),
    "more contact than plate": (put("current", "contact_fraction", 1.5), "current.contact_fraction"),
    "a goal of nothing": (lambda _, n: n["targets"][0].update(goal=[0.0]), "targets.0.goal"),
    "goals of more touches": (lambda _, n: n["targets"][0].update(goal=[0.1, 0.2]), "values"),
    "no targets": (lambda _, n: n.update(targets=[]), "targets"),
    "a quantity of no table": (lambda _, n: n["targets"][0].update(quantity="colour"), "colour"),
    "an error that is none": (
        lambda _, n: n["iterations"][0].update(relative_error=float("inf")),
        "iterations.0.relative_error",
    ),
    "an iteration after the last step": (lambda _, n: n["iterations"][0].update(steps=70), "steps"),
    "iterations without a result": (lambda _, n: n.update(closest=None), "closest"),
    "less than no time": (lambda _, n: n.update(seconds=-1.0), "seconds"),
}


@pytest.mark.parametrize("forgery", FORGERIES)
def test_numbers_out_of_range_are_told_by_their_name(tmp_path: Path, forgery: str) -> None:
    change, named = FORGERIES[forgery]
    save_checkpoint(tmp_path, CHECKPOINT)
    forge(tmp_path, change)
    line = refused(tmp_path)
    assert "not a checkpoint" in line and named in line


def settings(texture: Path, *overrides: str) -> Run:
    return run_from_scene("studio", texture, ["touch.jnd=2", *overrides])


@pytest.fixture
def own(tmp_path: Path) -> Path:
    """A texture; its content plays no part here."""
    (tmp_path / "own.npy").write_bytes(b"heights")
    return tmp_path / "own.npy"


CHANGED = {
    "touch.jnd=5": "touch.jnd",
    "touch.force_n=5": "touch.force_n",
    'look.model="fast"': "look.model",
    'verify.model="none"': "verify.model",
    "verify.resolution=32": "verify.resolution",
    "descent.tolerance=0.1": "descent.tolerance",
    'descent.method="adam"': "descent.method",
    "define.resolution=64": "define.resolution",
    "height_scale=0.5": "height_scale",
    "seed=3": "seed",
}


@pytest.mark.parametrize("change", CHANGED)
def test_a_setting_that_decides_the_run_is_refused_by_its_key(own: Path, change: str) -> None:
    key = run_key(settings(own))
    check_key(Path("run.toml"), settings(own), key)
    with pytest.raises(InputError) as caught:
        check_key(Path("run.toml"), settings(own, change), key)
    assert str(caught.value).startswith(f"run.toml: {CHANGED[change]}: ") and "force=True" in str(
        caught.value
    )


def test_a_changed_texture_is_refused_and_a_moved_one_is_not(own: Path) -> None:
    key = run_key(settings(own))
    moved = own.rename(own.with_name("moved.npy"))
    check_key(Path("run.toml"), settings(moved), key)
    moved.write_bytes(b"others")
    with pytest.raises(InputError, match=r"^run\.toml: texture: .*moved\.npy is not the file"):
        check_key(Path("run.toml"), settings(moved), key)


def test_how_far_a_run_goes_and_how_well_it_is_measured_may_change(own: Path) -> None:
    measured = ("verify.corrections=5", "verify.samples=1024", "verify.distance_cm=25")
    for change in ("descent.steps=500", *measured):
        check_key(Path("run.toml"), settings(own, change), run_key(settings(own)))
