"""Threads of torch: touch takes one.

Two threads on two cores take 1.3 times the processor's time of one for a run, and no less time on the clock:
products of a few patches are small, and the threads wait for each other by spinning. Batches of patches side
by side, one on each core, wait for Python's lock instead: 1.1 times the time, and no less on the clock
either.
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
