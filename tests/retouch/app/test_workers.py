"""A worker that dies is replaced; one that is closed ends at once."""

import asyncio
import os
import signal
import time

import pytest

from relief.common.errors import InputError
from retouch.app.computing.worker import Superseded, Worker


def process(worker: Worker) -> int:
    assert worker._pool is not None
    (only,) = worker._pool._processes
    return only


def test_a_killed_worker_is_replaced_and_a_closed_one_is_not() -> None:
    async def doing() -> None:
        worker = Worker()
        first = await worker(os.getpid)
        sleeping = asyncio.ensure_future(worker(time.sleep, 0.3))
        await asyncio.sleep(0.1)
        os.kill(first, signal.SIGKILL)
        await sleeping
        assert process(worker) != first
        lasting = asyncio.ensure_future(worker(time.sleep, 60))
        await asyncio.sleep(0.1)
        worker.close()
        with pytest.raises(Superseded):
            await lasting

    asyncio.run(doing())


def test_a_computation_that_kills_its_worker_twice_is_told() -> None:
    async def doing() -> None:
        worker = Worker()
        try:
            with pytest.raises(InputError, match="died twice"):
                await worker(os._exit, 1)
        finally:
            worker.close()

    asyncio.run(doing())
