"""A finished run: settings, verification, original and result of a run directory, read and checked."""

import json
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Self

from optimize.run_directory.key import REPORT, RESULT, SETTINGS, all_settings, key_of
from optimize.settings.run_file import Run, load_settings
from optimize.verification.verification import Verification
from relief.ground.errors import InputError
from relief.ground.files import read_limited
from relief.ground.formats import PLATES, RUN_CHECKPOINT, RUN_HEIGHTS
from relief.relief import Relief
from relief.surface import Repeats

MARK = b"# The settings of the run in this folder, written by retouch optimize.\n"
"""First line of run.toml, the file that a run writes first and whole: the sign of a run directory."""
LARGEST_RESULT = 1 << 24
"""Most bytes of result.json: 100 times those of a run with 64 lights."""


@dataclass(frozen=True, eq=False)
class FinishedRun:
    """A run that has left a result; a run that was interrupted may have no verification.

    Attributes:
        folder: the run directory.
        settings: of the run.
    """

    folder: Path
    settings: Run

    @classmethod
    def read(cls, folder: Path) -> Self:
        """Read a run directory; verification and reliefs are read when they are asked for.

        Raises:
            InputError: the folder holds no run, its run.toml is no run file, or the run has no result yet.
        """
        if not holds_run(folder):
            raise InputError(f"{folder}: a folder without {SETTINGS}; not a run directory")
        run = cls(folder, load_settings(folder / SETTINGS))
        result_file(folder)
        return run

    def repeating(self, repeats: Repeats | None) -> Self:
        """The same run, whose reliefs are tiles or not; as its settings say if `repeats` is None."""
        if repeats is None:
            return self
        return replace(self, settings=self.settings.model_copy(update={"repeats": repeats}))

    @cached_property
    def verification(self) -> Verification:
        """What was measured of the result. Raises InputError."""
        verification = read_verification(self.folder)
        if verification is None:
            raise InputError(f"{self.folder / RESULT}: missing or damaged; no verification of a run")
        return verification

    @cached_property
    def result(self) -> Relief:
        """The result; of a run with a printer, its print. Raises InputError."""
        return read_result(self.folder, self.settings.repeats)

    @cached_property
    def original(self) -> Relief:
        """The relief that the run began with: its design, or the print of it. Raises InputError."""
        return self.settings.relief(self.result.width_mm)


def holds_run(run_dir: Path) -> bool:
    """Whether a folder holds a run: a run.toml under its mark, or a checkpoint."""
    try:
        with (run_dir / SETTINGS).open("rb") as file:
            marked = file.read(len(MARK)) == MARK
    except OSError:
        marked = False
    return marked or (run_dir / RUN_CHECKPOINT).is_file()


def result_file(run_dir: Path) -> Path:
    """The height map that a run has left. Raises InputError if there is none."""
    file = run_dir / RUN_HEIGHTS
    if not file.is_file():
        raise InputError(f"{file}: no such file; the run has no result yet")
    return file


def read_result(run_dir: Path, repeats: Repeats | None = None) -> Relief:
    """The result in a run directory whose settings may name files that have moved.

    Args:
        run_dir: the folder.
        repeats: whether the result is a tile, as in `Relief.read`.

    Raises:
        InputError: there is no result, or its file is damaged.
    """
    return Relief.read(result_file(run_dir), repeats=repeats)


def name_of(file: Path) -> str:
    """Name of a relief by its height map: that of the folder of its run, or of the file without suffix."""
    return file.parent.name if file.name == RUN_HEIGHTS and file.parent.name else file.stem


def finished(run_dir: Path) -> Verification | None:
    """The content of result.json if resuming the run would change nothing, else None.

    A run is finished if it was not interrupted, its files are there, and run.toml, scene and texture are
    those of the result. Nothing heavy is imported.

    Raises:
        InputError: there is no run.toml, or it is no run file.
    """
    settings = load_settings(run_dir / SETTINGS)
    if not all((run_dir / name).is_file() for name in (RESULT, REPORT, RUN_HEIGHTS, *PLATES)):
        return None
    verification = read_verification(run_dir)
    if verification is None or verification.stop.reason == "interrupted":
        return None
    try:
        key = key_of(verification.settings, verification.sha256)
        return verification if key == all_settings(settings) else None
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError):
        return None


def read_verification(run_dir: Path) -> Verification | None:
    """The content of result.json; None if it is missing, damaged, or holds what may not be shown."""
    file = run_dir / RESULT
    try:
        # Reading from what is no file, such as a pipe, could wait for ever.
        stamp = file.stat() if file.is_file() else None
    except (OSError, ValueError):
        return None
    return None if stamp is None else _verification(file, stamp.st_mtime_ns, stamp.st_size)


@lru_cache(maxsize=64)
def _verification(file: Path, _written_ns: int, _size: int) -> Verification | None:
    """The content of a file as it was written at a time: those who look again need not read again."""
    try:
        return Verification.from_json(json.loads(read_limited(file, LARGEST_RESULT)))
    except (InputError, ValueError, TypeError, RecursionError):
        return None
