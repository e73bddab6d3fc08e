"""Studies: many runs that one file describes, as tables, plots and pictures on one page."""

import logging
import os
from collections.abc import Callable, Iterable, Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from mitsuba_scenes.studies import PUBLISHED, bundled_studies, find_study
from relief.ground.errors import InputError
from relief.ground.progress import Progress
from retouch.laboratory.published import scoreboard
from retouch.laboratory.published.findings import load_findings
from retouch.laboratory.published.page import scoreboard_page
from retouch.laboratory.studies import engine
from retouch.laboratory.studies.document import StudyDocument, flat_rows, read_document
from retouch.laboratory.studies.page import write_files, write_study
from retouch.laboratory.studies.rough_time import RoughTime, about
from retouch.laboratory.studies.rows import expand
from retouch.laboratory.studies.study_file import load_study
from retouch.laboratory.workers.choice import runner
from retouch.verbs.progress_display import followed

_log = logging.getLogger(__name__)

MOST_SHOWN = 10
"""Most faults and failures that are printed; the page lists all."""


@dataclass(frozen=True)
class StudyTables:
    """What became of a study.

    Attributes:
        folder: of its files.
        document: every row of every table, and what is known of them.
        faults: lines about rows that cannot be computed.
        failed: lines about rows that have failed.
        done, missing: number of rows that are done, and that are neither done nor failed.
    """

    folder: Path
    document: StudyDocument
    faults: tuple[str, ...]
    failed: tuple[str, ...]
    done: int
    missing: int

    @property
    def page(self) -> Path:
        """The page."""
        return self.folder / engine.PAGE

    @property
    def complete(self) -> bool:
        """Whether no row is at fault and none has failed."""
        return not (self.faults or self.failed)

    def failures_shown(self) -> Iterator[str]:
        """Lines about the first rows that have failed, and how many more there are."""
        return _shortened(self.failed)

    def as_json(self) -> dict[str, Any]:
        """What `retouch study --json` prints."""
        files = [str(self.folder / name) for name in (engine.PAGE, engine.SPREADSHEET, engine.DOCUMENT)]
        failures = [*self.faults, *self.failed]
        rows = flat_rows(self.document)
        return {"folder": str(self.folder), "rows": rows, "failures": failures, "files": files}


def study(
    study: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    quick: bool = False,
    textures: str | os.PathLike[str] | None = None,
    given: str | os.PathLike[str] | None = None,
    again: bool = False,
    redraw: bool = False,
    workers: int | None = None,
    dask: str | None = None,
    quiet: bool | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> StudyTables:
    """Compute the rows of a study that are missing, and write its page, spreadsheet and document.

    Args:
        study: a study file (.toml), or the name of a bundled study.
        out: folder to write to; default `runs/<name of the study>`.
        quick: the study in small, by its section [quick].
        textures: folder of height maps in place of the values of each axis `texture`.
        given: the study.json of another folder, whose rows count as done.
        again: compute each row anew.
        redraw: compute nothing, draw what is there.
        workers: number of processes, of one thread each; None: one for each core.
        dask: address of the scheduler of a Dask cluster, or "local".
        quiet, progress: as in `optimize`.

    Raises:
        InputError: the file is no study, or the folder holds something else.
        KeyboardInterrupt: rows that are done stay; the same call goes on.
    """
    path = find_study(Path(study))
    out = Path("runs") / path.stem if out is None else Path(out)
    if path == PUBLISHED:
        if any(each is not None for each in (textures, given, workers, dask)):
            raise InputError("published: takes no textures, rows of others, workers or dask")
        with followed(progress, quiet):
            board = scoreboard.compute(load_findings(), out, quick, again, redraw)
            write_files(out, board, scoreboard_page(board))
        done = len(board.records)
        return StudyTables(out, board, (), (), done, len(board.tables[0].rows) - done)
    described = load_study(path)
    expanded = expand(described, quick, None if textures is None else Path(textures))
    records = None if given is None else read_document(Path(given)).records
    for line in _shortened(expanded.faults):
        _log.warning("%s", line)
    with followed(progress, quiet):
        if redraw:
            engine.check_folder(out)
            rows = engine.known(expanded, out, described.measures, records)
        else:
            rows = engine.compute(
                expanded,
                out,
                lambda work, observer: runner(work, workers, dask, observer),
                described.measures,
                records,
                again,
            )
        content = write_study(out, described, expanded, rows, quick)
    failed = [f"{out / engine.ROWS / key[:12]}: {reason}" for key, reason in rows.failures.items()]
    missing = len(expanded.rows) - len(rows.records) - len(failed)
    return StudyTables(out, content, tuple(expanded.faults), tuple(failed), len(rows.records), missing)


def _shortened(lines: Iterable[str]) -> Iterator[str]:
    """The first of many lines, and how many more there are."""
    every = list(lines)
    yield from every[:MOST_SHOWN]
    if len(every) > MOST_SHOWN:
        yield f"... and {len(every) - MOST_SHOWN} more, which the page lists"


@dataclass(frozen=True)
class ListedStudy:
    """A bundled study: its name and title, and its rough time whole and with `quick`."""

    name: str
    title: str
    whole: RoughTime
    quick: RoughTime


def listed_studies() -> list[ListedStudy]:
    """The bundled studies."""
    studies = [load_study(path) for path in bundled_studies()]
    listed = [ListedStudy(one.name, one.title, about(one, False), about(one, True)) for one in studies]
    rows = len(load_findings().finding)
    times = [RoughTime(rows * len(fingers), minutes) for _, fingers, minutes in scoreboard.FORMS.values()]
    return [*listed, ListedStudy(PUBLISHED.name, scoreboard.TITLE, *times)]


def list_studies() -> list[dict[str, Any]]:
    """The bundled studies: `name`, `title`, and number of `rows` and `minutes` here, `whole` and `quick`."""
    return [asdict(one) for one in listed_studies()]
