"""history.jsonl of a run directory: what every step came to."""

import hashlib
import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from optimize.descent.driver import Iterate, StepRecord, record_of
from optimize.descent.targets import Targets
from optimize.run_directory.checkpoint import stuck
from relief.ground.arrays import Array
from relief.ground.files import naming_errors, read_limited, write_atomically
from relief.ground.formats import RUN_HISTORY
from tactile.quantities import QUANTITIES

HISTORY = RUN_HISTORY
PARTS = ("fingers", "broad", "shape")
"""Terms of the cost of an iterate beside the rms of its pictures, each a key of its own where it counts."""
LARGEST_HISTORY = 1 << 28
"""Most bytes of a history: 100,000 steps, the most of a run, take a fifth."""


class History:
    """history.jsonl: one line a step, appended; on resuming, read back up to the step `after`.

    Attributes:
        targets: surrogate targets of the current outer iteration.
        iteration: its number, from 0.
        rows: content of the file.

    Raises:
        InputError: a line is not a step, or `digest` is given and the rows have another.
    """

    def __init__(
        self, run_dir: Path, targets: Targets, iteration: int, after: int, digest: str | None = None
    ) -> None:
        self._path, self.targets, self.iteration = run_dir / HISTORY, targets, iteration
        self._digest = hashlib.sha256()
        self.rows: list[dict[str, Any]] = []
        if self._path.is_file():
            # A kill may have cut the last line short; its step is not in the checkpoint, written after it.
            whole = read_limited(self._path, LARGEST_HISTORY).splitlines(keepends=True)
            lines = [line for line in whole if line.endswith(b"\n")]
            try:
                rows = [json.loads(line) for line in lines]
                self.rows = [row for row in rows if row["step"] <= after]
            except (ValueError, TypeError, LookupError, RecursionError) as error:
                raise stuck(f"{self._path}: not a history of steps;") from error
        content = "".join(map(_line, self.rows)).encode()
        self._digest.update(content)
        if digest not in (None, self.digest):
            raise stuck(f"{self._path}: not the history of the checkpoint;")
        if self._path.is_file():
            write_atomically(self._path, content)

    @property
    def digest(self) -> str:
        """SHA-256 of the rows."""
        return self._digest.hexdigest()

    def trace(self) -> list[StepRecord]:
        """Records of the steps of this outer iteration."""
        return [
            record_of(
                self.targets,
                _values(row),
                math.hypot(row["picture_rms_percent"], *(row.get(f"{part}_percent", 0.0) for part in PARTS)),
            )
            for row in self.rows
            if row["step"] > 0 and row["round"] == self.iteration
        ]

    def add(self, iterate: Iterate, seconds: float) -> None:
        """Append an iterate."""
        places = {name: each.tolist() for name, each in iterate.values.items() if each.size > 1}
        row: dict[str, Any] = {
            "step": iterate.step,
            "round": self.iteration,
            **iterate.means,
            **by_prefix("target", self.targets.goals()),
            "picture_mean_percent": iterate.picture_mean,
            "picture_rms_percent": iterate.picture_rms,
            **{f"{part}_percent": own for part in PARTS if (own := getattr(iterate, part))},
            **{f"energy_{name}": energy for name, energy in iterate.energies.items()},
            "seconds": seconds,
            **({"places": places} if places else {}),
        }
        self.rows.append(row)
        self._digest.update(_line(row).encode())
        with naming_errors(self._path), self._path.open("a", encoding="utf-8") as file:
            file.write(_line(row))


def _line(row: Mapping[str, Any]) -> str:
    return json.dumps(row) + "\n"


def _values(row: Mapping[str, Any]) -> dict[str, Array]:
    """The values of touch of a row, (k,) over the touches."""
    numbers = row.get("places") or {name: [row[name]] for name in QUANTITIES}
    return {name: np.array(each) for name, each in numbers.items()}


def by_prefix(prefix: str, values: Mapping[str, float]) -> dict[str, float | None]:
    """A key `prefix_name` for every quantity of the table, None where there is no value."""
    return {f"{prefix}_{name}": values.get(name) for name in QUANTITIES}
