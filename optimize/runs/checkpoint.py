"""A descent on disk: written whole after every step, so that a killed run goes on from its last one."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save

from optimize.descent.correction import Course, Round
from optimize.descent.driver import Iterate
from optimize.descent.problem import Targets
from relief.errors import InputError
from relief.files import write_atomically

Array = NDArray[np.float64]

FILE = Path("checkpoint") / "descent.safetensors"

_NUMBERS = ("roughness", "contact_area_mm2", "contact_fraction", "picture_mean", "picture_rms")


@dataclass(frozen=True)
class Checkpoint:
    """Where a descent stood, the best iterate of its round, where its rounds stood, and the seconds taken."""

    current: Iterate
    best: Iterate
    course: Course
    seconds: float


def save_checkpoint(run_dir: Path, checkpoint: Checkpoint) -> None:
    """Write a checkpoint; the last one is replaced whole or not at all."""
    tensors: dict[str, Array] = {}
    course = checkpoint.course
    numbers: dict[str, str] = {
        "seconds": repr(checkpoint.seconds),
        "aim": json.dumps(asdict(course.aim)),
        "rounds": json.dumps([asdict(r) for r in course.rounds]),
    }
    iterates = {"current": checkpoint.current, "best": checkpoint.best}
    if course.closest is not None:
        iterates["closest"] = course.closest
    for name, iterate in iterates.items():
        tensors[f"{name}.heights"] = np.asarray(iterate.heights, order="C")
        tensors |= {f"{name}.memory.{key}": np.asarray(v, order="C") for key, v in iterate.memory.items()}
        numbers[name] = json.dumps({"step": iterate.step} | {key: getattr(iterate, key) for key in _NUMBERS})
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
        course = Course(
            Targets(**json.loads(numbers["aim"])),
            tuple(Round(**r) for r in json.loads(numbers["rounds"])),
            iterates.get("closest"),
        )
        return Checkpoint(iterates["current"], iterates["best"], course, float(numbers["seconds"]))
    except (SafetensorError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"{path}: not a checkpoint: {' '.join(str(error).split())}") from error


def _iterate(name: str, numbers: dict[str, float], tensors: dict[str, Array]) -> Iterate:
    start = f"{name}.memory."
    memory = {key.removeprefix(start): value for key, value in tensors.items() if key.startswith(start)}
    values = {key: float(numbers[key]) for key in _NUMBERS}
    return Iterate(int(numbers["step"]), tensors[f"{name}.heights"], memory=memory, **values)
