"""Threads: work in parts side by side, each part on one thread of torch.

Two threads of torch on two cores take 1.3 times the processor's time for a run, and no less time on the
clock, because its products are small and its threads wait for each other by spinning. Parts side by side do
not wait.
"""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import TypeVar

import torch

Part = TypeVar("Part")
Result = TypeVar("Result")


@contextmanager
def one_torch_thread() -> Iterator[None]:
    """Let torch take one thread."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def side_by_side(function: Callable[[Part], Result], parts: Sequence[Part]) -> Iterator[Result]:
    """Results of a function for some parts, in their order; as many at a time as torch has threads.

    The function must change nothing that another part sees. Progress is told by the thread that takes the
    results, and not from within the function if there are several parts.
    """
    threads = min(torch.get_num_threads(), len(parts))
    with one_torch_thread():
        if threads < 2:
            yield from map(function, parts)
            return
        with ThreadPoolExecutor(threads, initializer=torch.set_num_threads, initargs=(1,)) as pool:
            # What has not begun when the taker gives up is cancelled by `map`.
            yield from pool.map(function, parts)
