"""Checkpoint of a run, written whole after every step, so that a killed run goes on from its last step."""

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from optimize.descent.correction import CorrectionState, OuterIteration
from optimize.descent.driver import Iterate
from optimize.descent.targets import QUANTITIES, Target, Targets
from relief.arrays import Array
from relief.errors import InputError
from relief.files import write_atomically

FILE = Path("checkpoint") / "descent.safetensors"

_NUMBERS = ("contact_fraction", "picture_mean", "picture_rms")


@dataclass(frozen=True)
class Checkpoint:
    """Where a run stands.

    Attributes:
        current: the last iterate.
        best: of the current descent.
        state: of the outer iterations.
        seconds: taken so far.
    """

    current: Iterate
    best: Iterate
    state: CorrectionState
    seconds: float


def save_checkpoint(run_dir: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint; it replaces the last one whole or not at all."""
    tensors: dict[str, Array] = {}
    state = checkpoint.state
    numbers: dict[str, str] = {
        "seconds": repr(checkpoint.seconds),
        "targets": json.dumps([[t.quantity.name, t.goal, t.tolerance] for t in state.surrogate_targets.each]),
        "iterations": json.dumps([asdict(iteration) for iteration in state.iterations]),
    }
    iterates = {"current": checkpoint.current, "best": checkpoint.best}
    if state.closest is not None:
        iterates["closest"] = state.closest
    for name, iterate in iterates.items():
        tensors[f"{name}.heights"] = np.asarray(iterate.heights, order="C")
        tensors |= {f"{name}.memory.{key}": np.asarray(v, order="C") for key, v in iterate.memory.items()}
        scalars = {key: getattr(iterate, key) for key in _NUMBERS}
        numbers[name] = json.dumps({"step": iterate.step, "values": iterate.values} | scalars)
    write_atomically(run_dir / FILE, save(tensors, metadata=numbers))


def load_checkpoint(run_dir: Path) -> Checkpoint:
    """Read the checkpoint of a run directory.

    Raises:
        InputError: there is none, or it does not read.
    """
    path = run_dir / FILE
    if not path.is_file():
        raise InputError(f"{path}: no such file; nothing to go on from")
    try:
        with safe_open(path, framework="np") as file:
            numbers = file.metadata()
            tensors = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118  # not a mapping
        iterates = {
            name: _iterate(name, json.loads(numbers[name]), tensors)
            for name in ("current", "best", "closest")
            if name in numbers
        }
        targets = [
            Target(QUANTITIES[name], float(goal), float(tolerance))
            for name, goal, tolerance in json.loads(numbers["targets"])
        ]
        state = CorrectionState(
            Targets(tuple(targets)),
            tuple(OuterIteration(**fields) for fields in json.loads(numbers["iterations"])),
            iterates.get("closest"),
        )
        return Checkpoint(iterates["current"], iterates["best"], state, float(numbers["seconds"]))
    except (SafetensorError, KeyError, TypeError, ValueError, AttributeError) as error:
        raise InputError(f"{path}: not a checkpoint: {' '.join(str(error).split())}") from error


def _iterate(name: str, numbers: dict[str, Any], tensors: dict[str, Array]) -> Iterate:
    start = f"{name}.memory."
    memory = {key.removeprefix(start): value for key, value in tensors.items() if key.startswith(start)}
    values = {quantity: float(numbers["values"][quantity]) for quantity in QUANTITIES}
    scalars = {key: float(numbers[key]) for key in _NUMBERS}
    return Iterate(int(numbers["step"]), tensors[f"{name}.heights"], values, memory=memory, **scalars)
