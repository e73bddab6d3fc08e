"""Subjects of a comparison: heights of a file, or the original and the result of a run directory."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

from mitsuba_scenes import find_texture
from optimize.run_directory.finished_run import FinishedRun, holds_run, result_file
from optimize.settings.run_file import Run
from relief.ground.errors import InputError
from relief.ground.lengths import Lengths
from relief.relief import Relief
from relief.surface import Repeats


@dataclass(frozen=True)
class Subject:
    """One of the two reliefs.

    Attributes:
        name: as the page calls it.
        file: of the heights.
        relief: the heights on their plate.
        run: settings of the run that the relief comes from, if any.
    """

    name: str
    file: Path
    relief: Relief
    run: Run | None

    @property
    def printer(self) -> str | None:
        """Name of the printer of the run; the relief is a print of it."""
        return None if self.run is None else self.run.print.printer

    def repeating(self, ends: tuple[bool, bool]) -> Self:
        """The same relief, repeating along y and along x or not."""
        return replace(self, relief=replace(self.relief, repeats=ends))


def read_subjects(
    first: str | Path,
    second: str | Path | None = None,
    lengths: Lengths | None = None,
    repeats: Repeats | None = None,
) -> tuple[Subject, Subject]:
    """Read both reliefs, which repeat along the same axes then; see `compare`. Raises InputError."""
    if second is None:
        folder = Path(first)
        if not (folder.is_dir() and holds_run(folder)):
            raise InputError(f"{folder}: not a run directory; a texture needs another one to compare with")
        run = FinishedRun.read(folder).repeating(repeats)
        before = Subject("original", run.settings.texture, run.original, run.settings)
        return before, _result_of(run, "result")
    paths = Path(first), Path(second)
    runs = [_run_in(path) for path in paths]
    if repeats is None:
        repeats = next((run.settings.repeats for run in runs if run is not None), None)
    one, other = (
        _subject(path, name, run, lengths, repeats) for path, name, run in zip(paths, "AB", runs, strict=True)
    )
    # What is a tile beside a plate is compared as a plate.
    both = [mine and yours for mine, yours in zip(one.relief.repeats, other.relief.repeats, strict=True)]
    ends = both[0], both[1]
    return one.repeating(ends), other.repeating(ends)


def read_subject(path: str | Path, name: str) -> Subject:
    """The result of a run, or a height map, which has its lengths in its header. Raises InputError."""
    path = Path(path)
    return _subject(path, name, _run_in(path))


def _subject(
    path: Path,
    name: str,
    run: FinishedRun | None,
    lengths: Lengths | None = None,
    repeats: Repeats | None = None,
) -> Subject:
    if run is not None:
        return _result_of(run.repeating(repeats), name)
    file = find_texture(path)
    return Subject(name, file, Relief.read(file, repeats=repeats, **(lengths or {})), None)


def _run_in(path: Path) -> FinishedRun | None:
    """The run in a folder; None of a path that is no folder. Raises InputError."""
    return FinishedRun.read(path) if path.is_dir() else None


def _result_of(run: FinishedRun, name: str) -> Subject:
    return Subject(name, result_file(run.folder), run.result, run.settings)
