"""Clock of a run: wall and CPU seconds of its parts."""

import time
from typing import NamedTuple, Self


class Moment(NamedTuple):
    """A reading of both clocks, or the time between two readings.

    Attributes:
        wall_s: seconds on the wall.
        cpu_s: seconds of the processor by all threads of this process.
    """

    wall_s: float
    cpu_s: float

    def __sub__(self, earlier: Self) -> "Moment":
        return Moment(self.wall_s - earlier.wall_s, self.cpu_s - earlier.cpu_s)


def now() -> Moment:
    """The current reading."""
    return Moment(time.perf_counter(), time.process_time())
