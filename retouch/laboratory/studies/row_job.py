"""Row jobs: one run of a study, computed or continued in a worker, measured and recorded."""

import errno
import os
import time
import traceback
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path

from optimize.run_directory.checkpoint import FILE as CHECKPOINT
from optimize.run_directory.finished_run import FinishedRun, finished, holds_run, read_verification
from optimize.settings.run_file import Run
from optimize.verification.verification import Verification
from relief.ground.errors import InputError
from relief.ground.files import remove_partial, write_atomically
from relief.ground.formats import RUN_HEIGHTS
from retouch.laboratory.studies.measuring.measures import MEASURES
from retouch.laboratory.studies.records import (
    FAILURE,
    FILE,
    INTERRUPTED,
    Cell,
    MeasuredColumns,
    Record,
    columns_of,
    read_record,
    record_bytes,
    write_failure,
)
from visual.backend.variants import few_threads

END_OF_ALL = frozenset({errno.ENOSPC, errno.EDQUOT, errno.EROFS, errno.EFBIG, errno.EIO})
"""Errors of the disk: no other row would fare better, so the study ends, and goes on when they are mended."""
LONGEST_REASON = 300
"""Most characters of the reason of a failure."""


@dataclass(frozen=True)
class RowJob:
    """A row to compute.

    Attributes:
        number: of the row among those of the study.
        key: of the row.
        folder: run directory of the row, which the worker must see.
        settings: of the run.
        measures: names of the measures.
    """

    number: int
    key: str
    folder: Path
    settings: Run
    measures: tuple[str, ...] = ()


def run_row(job: RowJob) -> bytes | str:
    """Compute a row, or continue it from its checkpoint, and write its record.

    Args:
        job: The job.

    Returns:
        The record as JSON, or one line that says why the row fails.

    Raises:
        InputError: The worker does not see the folder of the study.
        OSError: The disk is at fault.
    """
    from relief.ground.threads import one_torch_thread

    place = job.folder.parent
    if not place.is_dir():
        raise InputError(f"{place}: the worker sees no such folder; the workers of a study share a disk")
    try:
        # One thread for arithmetic, and of Dr.Jit as few as Mitsuba can do with.
        with one_torch_thread(), few_threads():
            content = record_bytes(_computed(job))
            write_atomically(job.folder / FILE, content)
            return content
    except OSError as error:
        if error.errno in END_OF_ALL:
            fault = f"{os.strerror(error.errno)}; when that is mended, the same command goes on"
            raise OSError(error.errno, fault, error.filename or str(job.folder)) from error
        return record_failure(job.folder, error)
    except Exception as error:  # it is the row's own, and the other rows go on
        return record_failure(job.folder, error)


def outdated(record: Record | None, measures: Sequence[str]) -> list[str]:
    """Names of the measures that a record lacks or has by another version, and that can be computed here."""
    measured = {} if record is None else record.measures
    return [
        name
        for name in measures
        if (name not in measured or measured[name].version != MEASURES[name].version)
        and MEASURES[name].obstacle() is None
    ]


def _computed(job: RowJob) -> Record:
    """The record of a row, after its run. Raises whatever goes wrong."""
    with suppress(FileNotFoundError):
        (job.folder / FAILURE).unlink()
    earlier = read_record(job.folder, job.key)
    cpu_s: Cell = None
    if (result := _done(job, earlier)) is None:
        result, cpu_s = _run(job)
        earlier = None
        if result.stop.reason == INTERRUPTED:
            raise InputError("was interrupted; the same command goes on")
    elif earlier is not None:
        cpu_s = earlier.columns.get("cpu_s")
    measures = {} if earlier is None else dict(earlier.measures)
    run = FinishedRun(job.folder, job.settings)
    for name in outdated(earlier, job.measures):
        measure = MEASURES[name]
        values = dict(measure.function(run))
        measures[name] = MeasuredColumns(version=measure.version, values=values)
    return Record(key=job.key, columns=columns_of(result) | {"cpu_s": cpu_s}, measures=measures)


def _done(job: RowJob, record: Record | None) -> Verification | None:
    """The verification of the result if the run of a row needs no more computing, else None.

    A record says that the run is done, even if the settings in the folder lack those that are new, or name
    files by places where they no longer lie.
    """
    if record is not None and (job.folder / RUN_HEIGHTS).is_file():
        return read_verification(job.folder)
    with suppress(InputError):  # settings that no version wrote, or whose files are gone: computed anew
        return finished(job.folder) if holds_run(job.folder) else None
    return None


def _run(job: RowJob) -> tuple[Verification, float | None]:
    """The verification of the result, and the processor's seconds; none of these if the run was continued."""
    # Imported here: this process may only read what is done already.
    from optimize.runs import job as runs
    from retouch.pages.run_report import publish

    remove_partial(job.folder)
    if (job.folder / CHECKPOINT).is_file():
        with suppress(InputError):  # a checkpoint that is damaged or of another version: begun anew
            return runs.resume(job.folder, publish=publish).verification, None
    began = time.process_time()
    result = runs.run(job.settings, job.folder, force=holds_run(job.folder), publish=publish)
    return result.verification, time.process_time() - began


def record_failure(folder: Path, error: Exception) -> str:
    """Write why a row fails into its folder; returns the reason in one line."""
    kind = "" if isinstance(error, InputError) else f"{type(error).__name__}: "
    reason = f"{kind}{' '.join(str(error).split())}"[:LONGEST_REASON]
    trace = "" if isinstance(error, InputError) else "".join(traceback.format_exception(error))
    write_failure(folder, reason, trace)
    return reason
