"""Threads of torch: touch takes one.

A run with two threads on two cores takes 1.3 times the CPU seconds of one thread, and no less time on the
clock: products of a few patches are small, and the threads wait for each other by spinning. Batches of
patches in parallel, one on each core, wait for Python's lock: 1.1 times the CPU seconds, and no less time on
the clock.
"""

from collections.abc import Iterator
from contextlib import contextmanager

import torch


@contextmanager
def one_torch_thread() -> Iterator[None]:
    """Let torch take one thread."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)
