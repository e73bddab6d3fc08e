"""Subjects of a comparison: heights of a file, or the original and the result of a run directory."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

from mitsuba_scenes import find_texture
from optimize.run_directory import results
from optimize.run_directory.key import SETTINGS
from optimize.settings.run_file import Run, load_settings
from relief.ground.errors import InputError
from relief.ground.formats import RUN_HEIGHTS
from relief.relief import Relief
from relief.surface import Repeats

RESULT = RUN_HEIGHTS
"""File of a run directory that holds its result."""


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

    def repeating(self, ends: tuple[bool, bool]) -> Self:
        """The same relief, repeating along y and along x or not."""
        return replace(self, relief=replace(self.relief, repeats=ends))


def read_subjects(
    first: str | Path,
    second: str | Path | None,
    lengths: Mapping[str, float | None],
    repeats: Repeats | None,
) -> tuple[Subject, Subject]:
    """Read both reliefs, which repeat along the same axes then; see `compare`. Raises InputError."""
    if second is None:
        folder = Path(first)
        run = _run_in(folder)
        if run is None:
            raise InputError(f"{folder}: not a run directory; a texture needs another one to compare with")
        repeats = run.repeats if repeats is None else repeats
        own = {key: getattr(run, key) for key in lengths}
        # The result of a run with a printer is a print, the file of the original is not.
        name = "original" if run.print.described is None else "design"
        before = Subject(name, run.texture, _read(run.texture, own, repeats), run)
        return before, _result_of(folder, run, "result", repeats)
    paths = Path(first), Path(second)
    runs = [_run_in(path) for path in paths]
    if repeats is None:
        repeats = next((run.repeats for run in runs if run is not None), None)
    one, other = (
        _subject(path, name, lengths, run, repeats) for path, name, run in zip(paths, "AB", runs, strict=True)
    )
    # What is a tile beside a plate is compared as a plate.
    both = [mine and yours for mine, yours in zip(one.relief.repeats, other.relief.repeats, strict=True)]
    ends = both[0], both[1]
    return one.repeating(ends), other.repeating(ends)


def read_subject(path: str | Path, name: str) -> Subject:
    """The result of a run, or a height map, which has its lengths in its header. Raises InputError."""
    path = Path(path)
    lengths = dict.fromkeys(("size_mm", "relief_mm", "height_scale"))
    return _subject(path, name, lengths, _run_in(path), None)


def _subject(
    path: Path, name: str, lengths: Mapping[str, float | None], run: Run | None, repeats: Repeats | None
) -> Subject:
    if path.is_dir():
        if run is None:
            raise InputError(f"{path}: a folder without {SETTINGS}; not a run directory")
        return _result_of(path, run, name, repeats)
    file = find_texture(path)
    return Subject(name, file, _read(file, lengths, repeats), None)


def _run_in(folder: Path) -> Run | None:
    """The settings of the run in a folder; None if there is no run."""
    return load_settings(folder / SETTINGS) if folder.is_dir() and results.holds_run(folder) else None


def _result_of(folder: Path, run: Run, name: str, repeats: Repeats | None) -> Subject:
    file = folder / RESULT
    if not file.is_file():
        raise InputError(f"{file}: no such file; the run has no result yet")
    return Subject(name, file, Relief.read(file, repeats=repeats), run)


def _read(file: Path, lengths: Mapping[str, float | None], repeats: Repeats | None) -> Relief:
    """The relief of a height map with these lengths. Raises InputError."""
    size_mm, relief_mm, height_scale = (lengths[key] for key in ("size_mm", "relief_mm", "height_scale"))
    return Relief.read(file, size_mm=size_mm, relief_mm=relief_mm, height_scale=height_scale, repeats=repeats)
