"""Checkpoint of a run, written whole after every step, so that a killed run goes on from its last step."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import AfterValidator, ConfigDict, Field, TypeAdapter, ValidationError

from optimize.descent.correction import CorrectionState, OuterIteration
from optimize.descent.driver import Iterate
from optimize.descent.targets import Target, Targets
from optimize.run_directory.key import CHANGEABLE, run_key
from optimize.settings.run_file import Run
from optimize.settings.toml_files import NotNegative, Positive
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.files import write_atomically
from relief.ground.formats import RUN_CHECKPOINT
from relief.ground.limits import DEEPEST_RELIEF_MM
from relief.ground.tensors import read_tensors, tensor_bytes
from tactile.quantities import QUANTITIES

FILE = Path(RUN_CHECKPOINT)


@dataclass(frozen=True)
class Checkpoint:
    """Where a run stands.

    Attributes:
        current: the last iterate.
        best: of the current descent.
        state: of the outer iterations.
        seconds: taken so far.
        key: of the run, as by `optimize.run_directory.key.run_key`.
        history: digest of the history up to the last iterate (`optimize.run_directory.history.History`).
    """

    current: Iterate
    best: Iterate
    state: CorrectionState
    seconds: float
    key: Mapping[str, Any] = field(default_factory=dict)
    history: str = ""


_Step = Annotated[int, Field(ge=0)]
_Values = dict[str, NotNegative]
_Each = Annotated[tuple[NotNegative, ...], Field(min_length=1)]
"""A number for each touch."""


def _not_all_zero(goal: tuple[float, ...]) -> tuple[float, ...]:
    if not any(goal):
        raise ValueError("a goal above 0 is needed")
    return goal


@dataclass(frozen=True)
class _SavedIterate:
    """The numbers of an iterate; its arrays are tensors of the file."""

    step: _Step
    values: dict[str, _Each]
    contact_fraction: Annotated[float, Field(ge=0, le=1)]
    picture_mean: NotNegative
    picture_rms: NotNegative
    fingers: NotNegative = 0.0
    broad: NotNegative = 0.0
    shape: NotNegative = 0.0


@dataclass(frozen=True)
class _SavedTarget:
    quantity: str
    goal: Annotated[tuple[NotNegative, ...], Field(min_length=1), AfterValidator(_not_all_zero)]
    tolerance: Annotated[float, Field(gt=0, lt=1)]


@dataclass(frozen=True)
class _SavedOuterIteration:
    surrogate_goals: dict[str, Positive]
    values: _Values
    verified: _Values
    relative_error: NotNegative
    steps: _Step


@dataclass(frozen=True)
class _CheckpointText:
    """The text of the file: everything but arrays."""

    seconds: NotNegative
    key: dict[str, Any]
    history: str
    targets: Annotated[tuple[_SavedTarget, ...], Field(min_length=1)]
    iterations: tuple[_SavedOuterIteration, ...]
    current: _SavedIterate
    best: _SavedIterate
    closest: _SavedIterate | None

    __pydantic_config__ = ConfigDict(extra="forbid")


_HEADER = TypeAdapter(_CheckpointText)


def check_key(settings_file: Path, settings: Run, key: Mapping[str, Any]) -> None:
    """Compare the settings of a run with the key of its checkpoint.

    Raises:
        InputError: a setting or a file is not the one that the run began with.
    """
    now, files = run_key(settings), settings.files()
    for name in sorted(now.keys() | key.keys()):
        if now.get(name) != key.get(name):
            fault = (
                f"{files[name]} is not the file that the run began with"
                if name in files
                else f"{now.get(name)}, but the run began with {key.get(name)}"
            )
            allowed = ", ".join(CHANGEABLE)
            raise stuck(f"{settings_file}: {name}: {fault}; put it back, or", f"; only {allowed} may change")


def stuck(fault: str, after: str = "") -> InputError:
    """The error of a run that cannot be resumed: the fault, and how to begin anew."""
    return InputError(
        f"{fault} begin anew (retouch.optimize, force=True or another out){after}",
        f"{fault} begin anew (retouch optimize, --force or another -o){after}",
    )


def save_checkpoint(run_dir: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint; it replaces the last one whole or not at all."""
    state = checkpoint.state
    iterates = {"current": checkpoint.current, "best": checkpoint.best, "closest": state.closest}
    tensors: dict[str, Array] = {}
    numbers: dict[str, Any] = {
        "seconds": checkpoint.seconds,
        "key": dict(checkpoint.key),
        "history": checkpoint.history,
        "targets": [
            {"quantity": target.quantity.name, "goal": target.goal.tolist(), "tolerance": target.tolerance}
            for target in state.surrogate_targets.each
        ],
        "iterations": [asdict(iteration) for iteration in state.iterations],
    }
    for name, iterate in iterates.items():
        numbers[name] = iterate and _numbers(iterate)
        if iterate is not None:
            tensors[f"{name}.heights"] = iterate.heights
            tensors |= {f"{name}.memory.{key}": value for key, value in iterate.memory.items()}
    write_atomically(run_dir / FILE, tensor_bytes(tensors, json.dumps(numbers)))


def _numbers(iterate: Iterate) -> dict[str, Any]:
    """What `_SavedIterate` holds, of JSON types."""
    numbers = {key: getattr(iterate, key) for key in _SavedIterate.__annotations__}
    return numbers | {"values": {name: each.tolist() for name, each in iterate.values.items()}}


def load_checkpoint(run_dir: Path) -> Checkpoint:
    """Read the checkpoint of a run directory.

    Raises:
        InputError: there is none, it is damaged, or a number in it is out of range.
    """
    path = run_dir / FILE
    if not path.is_file():
        raise stuck(f"{path}: no such file; nothing to go on from;")
    try:
        tensors, text = read_tensors(path)
    except InputError as error:
        raise stuck(f"{error}; not a checkpoint of this version;") from error
    try:
        header = _HEADER.validate_json(text)
        current, best = (_iterate(name, getattr(header, name), tensors) for name in ("current", "best"))
        closest = None if header.closest is None else _iterate("closest", header.closest, tensors)
        targets = tuple(Target(QUANTITIES[t.quantity], t.goal, t.tolerance) for t in header.targets)
        iterates = {"current": current, "best": best} | ({} if closest is None else {"closest": closest})
        touches = {len(each) for iterate in iterates.values() for each in iterate.values.values()}
        if len(touches | {target.goal.size for target in targets}) > 1:
            raise ValueError("values: are not of the same touches")
        iterations = tuple(OuterIteration(**asdict(iteration)) for iteration in header.iterations)
        steps = [0, *(iteration.steps for iteration in iterations), current.step]
        if steps != sorted(steps) or max(best.step, closest.step if closest else 0) > current.step:
            raise ValueError("steps: are not in order")
        if (closest is None) != (not iterations):
            raise ValueError("closest: does not fit the iterations")
        if len({iterate.heights.shape for iterate in iterates.values()}) > 1:
            raise ValueError("heights: differ in shape")
    except ValidationError as error:
        fault = error.errors(include_url=False)[0]
        place = ".".join(str(part) for part in fault["loc"])
        raise InputError(f"{path}: not a checkpoint: {place}: {fault['msg']}") from error
    except (KeyError, ValueError) as error:
        raise InputError(f"{path}: not a checkpoint: {' '.join(str(error).split())}") from error
    state = CorrectionState(Targets(targets), iterations, closest)
    return Checkpoint(current, best, state, header.seconds, header.key, header.history)


def _iterate(name: str, numbers: _SavedIterate, tensors: Mapping[str, Array]) -> Iterate:
    start = f"{name}.memory."
    heights = tensors[f"{name}.heights"]
    memory = {key.removeprefix(start): value for key, value in tensors.items() if key.startswith(start)}
    for key, array in tensors.items():
        if array.dtype != np.float64 or not np.isfinite(array).all():
            raise ValueError(f"{key}: not every value is a finite number")
    if heights.ndim != 2 or not heights.size or heights.min() < 0.0 or heights.max() > DEEPEST_RELIEF_MM:
        raise ValueError(f"{name}.heights: are not a relief of 0 to {DEEPEST_RELIEF_MM:g} mm")
    values = {quantity: np.array(numbers.values[quantity]) for quantity in QUANTITIES}
    return Iterate(**vars(numbers) | {"values": values}, heights=heights, memory=memory)
