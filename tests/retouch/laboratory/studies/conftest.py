"""The small study that tests share: waves of 32 x 32 samples in the studio, three different rows."""

from collections.abc import Callable, Generator, Iterable
from pathlib import Path

import pytest

from retouch.laboratory.studies.row_job import RowJob
from retouch.laboratory.workers.jobs import JobResult, Runner, Work

TINY = """title = "Tiny"
base = "gravel.toml"
measures = ["pace"]
[set]
texture = "{texture}"
define.resolution = 32
verify = {{ model = "layer", samples = 4, baseline = false }}
[[tables]]
name = "feel"
[tables.axes]
"touch.jnd" = [0.5, 2]
[[tables]]
name = "steps"
set = {{ descent.tolerance = 0.002 }}
[tables.axes]
descent.steps = [1, 100]
[quick]
axes = {{ "touch.jnd" = [0.5] }}
tables = ["feel"]
"""


@pytest.fixture(scope="session")
def study_file(texture: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A study of four rows that differ in targets and steps."""
    path = tmp_path_factory.mktemp("study") / "tiny.toml"
    path.write_text(TINY.format(texture=texture))
    return path


def in_process(work: Work, observer: Callable[[RowJob, str], None]) -> Runner:
    """A runner that does one job after another here."""

    def runner(jobs: Iterable[RowJob]) -> Generator[JobResult[RowJob], None, None]:
        for job in jobs:
            observer(job, "at work")
            yield JobResult(job, work(job))

    return runner
