"""Jobs, their results, and the runners that take the one and give the other."""

from collections.abc import Callable, Generator, Iterable
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

TRIES = 3
"""Most times that a job is tried when its worker dies."""
GIVEN_UP = f"its worker died {TRIES} times"
"""Reason of a job that is abandoned."""


class Job(Protocol):
    """A job, which can be sent to another process.

    Attributes:
        number: Number of the job, unlike that of any other.
    """

    @property
    def number(self) -> int: ...


AnyJob = TypeVar("AnyJob", bound=Job)

Work = Callable[[Any], bytes | str]
"""A function that does a job and returns its result, or one line that says why there is none.

Function and job can be sent to another process.
"""


@dataclass(frozen=True)
class JobResult(Generic[AnyJob]):
    """Result of a job.

    Attributes:
        job: The job.
        content: The result, or one line that says why there is none.
    """

    job: AnyJob
    content: bytes | str


JobResults = Generator[JobResult[AnyJob], None, None]
"""Results in any order; closing the generator ends the workers."""


Runner = Callable[[Iterable[Any]], JobResults[Any]]
"""A function that does jobs and yields their results in any order, each job exactly once."""


class WorkerError(RuntimeError):
    """An error of the program in a worker; the message is the worker's traceback."""
