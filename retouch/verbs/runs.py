"""Runs from beginning to end, with their progress shown and their report written."""

from collections.abc import Callable
from pathlib import Path

from optimize.estimates.forecast import Forecast
from optimize.estimates.forecast import forecast as forecast_of
from optimize.run_directory.directory import check_vacant
from optimize.runs import job
from optimize.runs.job import Result
from optimize.settings.run_file import Run, load_run
from relief.ground.progress import Progress
from retouch.pages.run_report import publish
from retouch.verbs.progress_display import followed


def optimize(
    run: Run | str | Path,
    out: Path | str | None = None,
    *,
    variant: str | None = None,
    force: bool = False,
    quiet: bool | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Result:
    """Optimise one texture and write its run directory, with the report.

    Args:
        run: a run, or the path of a run file.
        out: the run directory; default `runs/<name of the run file or texture>`.
        variant: Mitsuba's.
        force: replace an earlier run in `out`.
        quiet: False shows progress on stderr, True nothing; None, a bar in a notebook and nothing elsewhere.
        progress: called with the progress of the run, in place of showing it.

    Raises:
        InputError: what is wrong with the input, in one line; nothing is written then.
        KeyboardInterrupt: before there was a result. Heights and plates of the best relief are written, and
            `resume` goes on; before the descent begins nothing is, and `out` is as it was.
    """
    with followed(progress, quiet):
        return job.run(run, out, variant=variant, force=force, publish=publish)


def resume(
    run_dir: Path | str,
    *,
    variant: str | None = None,
    quiet: bool | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Result:
    """Go on with a run from its checkpoint; ends as the uninterrupted run would, within tolerance.

    Args:
        run_dir: the run directory.
        variant, quiet, progress: as in `optimize`.

    Raises:
        InputError: the directory holds no run or no sound checkpoint; or scene, texture, or a setting other
            than those of `optimize.run_directory.key.CHANGEABLE` has changed since the run began.
    """
    with followed(progress, quiet):
        return job.resume(run_dir, variant=variant, publish=publish)


def forecast(
    run: Run | str | Path,
    out: Path | str,
    *,
    variant: str | None = None,
    force: bool = False,
    quiet: bool | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> Forecast:
    """Check a run as its beginning would, and estimate its time and memory; write nothing.

    Arguments are as in `optimize`. Raises InputError as `optimize` does, or if there is no room on the disk.
    """
    out, settings = Path(out), run if isinstance(run, Run) else load_run(run)
    with followed(progress, quiet):
        check_vacant(out, force)
        return forecast_of(settings, out, variant)
