"""The engine of studies: rows that are missing are computed, and every row is put into its tables."""

import logging
import shutil
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Self

from optimize.estimates.forecast import FOLDER_MIB, PIXEL_MIB, SAMPLE_MIB
from optimize.run_directory.finished_run import holds_run
from optimize.runs.checks import faults_of
from relief.ground.errors import InputError
from relief.ground.files import only_writer, partial_folders, remove_partial
from relief.ground.formatting import duration
from relief.ground.progress import Stage, say, stage
from retouch.laboratory.studies.measuring.measures import MEASURES
from retouch.laboratory.studies.records import Record, parse_record, read_failure, read_record, write_failure
from retouch.laboratory.studies.row_job import RowJob, outdated, record_failure, run_row
from retouch.laboratory.studies.rows import Expanded, StudyRow
from retouch.laboratory.studies.study_file import text_of
from retouch.laboratory.workers.jobs import GIVEN_UP, Runner, Work

_log = logging.getLogger(__name__)

ROWS = "rows"
"""Folder of the run directories of a study."""
DOCUMENT, SPREADSHEET, PAGE = "study.json", "rows.csv", "index.html"
"""Files of a study: everything in compact form, its rows for a spreadsheet, and the page."""
ROW_MB = FOLDER_MIB + SAMPLE_MIB * 128**2 + PIXEL_MIB * 4 * 128**2
"""About how many MiB a run of 128 x 128 samples and four pictures takes."""

MakeRunner = Callable[[Work, Callable[[RowJob, str], None]], Runner]
"""From the work and an observer of stages to a runner."""


@dataclass
class Rows:
    """What is known of the rows of a study.

    Attributes:
        records: of the rows that are done, by key.
        failures: why rows have failed, by key.
    """

    records: dict[str, Record] = field(default_factory=dict)
    failures: dict[str, str] = field(default_factory=dict)


def row_folder(out: Path, row: StudyRow) -> Path:
    """The run directory of a row."""
    return out / ROWS / row.short


def check_folder(out: Path) -> None:
    """Check that a study may be written into a folder, which need not exist. Raises InputError."""
    if out.exists() and not out.is_dir():
        raise InputError(f"{out}: is a file; a study writes a folder")
    own = {out / ROWS, out / DOCUMENT, *partial_folders(out)}
    if out.is_dir() and any(out.iterdir()) and own.isdisjoint(out.iterdir()):
        raise InputError(f"{out}: holds files that are not a study's; choose another -o")


def known(
    expanded: Expanded,
    out: Path,
    measures: Sequence[str] = (),
    given: Mapping[str, Record] | None = None,
) -> Rows:
    """What is known of the rows without computing any; arguments as of `compute`."""
    rows = Rows()
    for key, row in expanded.rows.items():
        folder = row_folder(out, row)
        record = read_record(folder, key) or (given or {}).get(key)
        if record is not None and not outdated(record, measures):
            rows.records[key] = record
        elif why := read_failure(folder):
            rows.failures[key] = why
    return rows


def compute(
    expanded: Expanded,
    out: Path,
    make_runner: MakeRunner,
    measures: Sequence[str] = (),
    given: Mapping[str, Record] | None = None,
    again: bool = False,
    what: str = "rows of the study",
) -> Rows:
    """Compute the rows of a study that are missing.

    Args:
        expanded: the rows of the study.
        out: folder of the study.
        make_runner: of the runner of rows.
        measures: names of the measures.
        given: records by key that come from elsewhere, such as a committed document.
        again: compute each row anew; earlier runs of the rows are removed.
        what: the rows in words, for the progress.

    Raises:
        InputError: the folder holds other files, or another command computes in it.
        OSError: the disk is at fault; the same command goes on.
        KeyboardInterrupt: rows that are done stay; the same command goes on.
    """
    check_folder(out)
    with only_writer(out / ROWS):
        remove_partial(out)
        if again:
            # Now, so that after an interrupt the same rows are still to be computed.
            for row in expanded.rows.values():
                shutil.rmtree(row_folder(out, row), ignore_errors=True)
        records = known(expanded, out, measures, None if again else given).records
        missing = [row for key, row in expanded.rows.items() if key not in records]
        # A run that has begun was checked then, perhaps by a version that accepted more.
        unchecked = (row for row in missing if not holds_run(row_folder(out, row)))
        faults = faults_of({row.key: row.settings for row in unchecked})
        jobs = [
            RowJob(number, row.key, row_folder(out, row), row.settings, tuple(measures))
            for number, row in enumerate(missing)
            if row.key not in faults
        ]
        for name in measures if jobs else ():
            if obstacle := MEASURES[name].obstacle():
                _log.warning("no measure %s: %s", name, obstacle)
        _announce(len(expanded.rows), len(jobs), out)
        with stage(what, len(missing)) as advance, _Pass(missing, records, advance) as work:
            work.refuse(faults, out)
            failed = work.through(jobs, make_runner)
            work.through(failed, make_runner, last=True)
    return Rows(records, work.failures)


class _Pass:
    """Passes through rows that are missing, and what is shown of them meanwhile."""

    def __init__(self, missing: Sequence[StudyRow], records: dict[str, Record], advance: Stage) -> None:
        self._missing, self._records, self._advance = missing, records, advance
        self._done = 0
        self.failures: dict[str, str] = {}
        self._stages: dict[int, str] = {}
        self._began: dict[int, float] = {}
        self._shown = ExitStack()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._shown.close()

    def through(self, jobs: Sequence[RowJob], make_runner: MakeRunner, last: bool = False) -> list[RowJob]:
        """Compute rows; returns those that failed and are worth another try."""
        failed = list[RowJob]()
        if not jobs:
            return failed
        # Closing ends the workers before this function returns or raises.
        with closing(make_runner(run_row, self._begun)(jobs)) as results:
            for result in results:
                job, content = result.job, result.content
                if isinstance(content, bytes):
                    self._records[job.key] = parse_record(content)
                    self.failures.pop(job.key, None)
                    outcome = "done"
                else:
                    self.failures[job.key], outcome = content, f"failed: {content}"
                    if content == GIVEN_UP:
                        write_failure(job.folder, content)
                    elif not last:
                        failed.append(job)
                        outcome += "; tried once more at the end"
                self._over(job, outcome, job not in failed)
        return failed

    def refuse(self, faults: Mapping[str, InputError], out: Path) -> None:
        """Record the rows that cannot run, and say why."""
        for row in self._missing:
            if (fault := faults.get(row.key)) is not None:
                self.failures[row.key] = record_failure(row_folder(out, row), fault)
                self._tell(row, f"failed: {self.failures[row.key]}")

    def _begun(self, job: RowJob, name: str) -> None:
        """Show the stage of a row that its worker has begun."""
        self._began.setdefault(job.number, time.monotonic())
        self._stages[job.number] = name
        self._show()

    def _over(self, job: RowJob, outcome: str, finally_: bool) -> None:
        """Say how a row ended."""
        self._stages.pop(job.number, None)
        began = self._began.pop(job.number, None)
        took = "" if began is None else f", {duration(time.monotonic() - began)}"
        self._show()
        self._tell(self._missing[job.number], f"{outcome}{took}", finally_)

    def _tell(self, row: StudyRow, outcome: str, finally_: bool = True) -> None:
        """Say what became of a row, and count it if that is final."""
        self._done += finally_
        if finally_:
            self._advance()
        say(f"{self._done} of {len(self._missing)}: {text_of(row.labels)}: {outcome}")

    def _show(self) -> None:
        self._shown.close()
        if self._stages:
            under_way = (f"{text_of(self._missing[n].labels)}: {name}" for n, name in self._stages.items())
            self._shown.enter_context(stage("; ".join(under_way)))


def _announce(count: int, missing: int, out: Path) -> None:
    """Say how many rows are to be computed, and about how much disk they take."""
    need, free = missing * ROW_MB, shutil.disk_usage(out).free / 2**20
    if missing:
        say(f"{missing} of {count} rows to compute, about {need:.0f} MiB in {out}; {free:.0f} MiB are free")
    if need > free:
        _log.warning("%s: the rows may take %.0f MiB, %.0f MiB are free", out, need, free)
