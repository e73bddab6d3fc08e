"""Median CPU seconds of a piece of work."""

import statistics
import time
from collections.abc import Callable


def median_cpu(work: Callable[[], object]) -> float:
    """Median CPU seconds of three calls, after one to warm up."""
    work()
    seconds = []
    for _ in range(3):
        began = time.process_time()
        work()
        seconds.append(time.process_time() - began)
    return statistics.median(seconds)
