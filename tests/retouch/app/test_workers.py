"""A worker that dies is replaced; one that is closed ends at once."""

import asyncio
import os
import signal
import threading
from pathlib import Path

import pytest

from relief.ground.errors import InputError
from retouch.app.computing.worker import Superseded, Worker
from tests.retouch.app.worker_works import half_sent, until_there


def process(worker: Worker) -> int:
    assert worker._pool is not None
    (only,) = worker._pool._processes
    return only


async def there(file: Path) -> None:
    while not file.exists():
        await asyncio.sleep(0.01)


def test_a_killed_worker_is_replaced_and_a_closed_one_is_not(tmp_path: Path) -> None:
    begun, end, never = tmp_path / "begun", tmp_path / "end", tmp_path / "never"

    async def doing() -> None:
        worker = Worker()
        first = await worker(os.getpid)
        killed = asyncio.ensure_future(worker(until_there, begun, end))
        await there(begun)
        begun.unlink()
        os.kill(first, signal.SIGKILL)
        await there(begun)
        end.touch()
        await killed
        assert process(worker) != first
        begun.unlink()
        lasting = asyncio.ensure_future(worker(until_there, begun, never))
        await there(begun)
        worker.close()
        with pytest.raises(Superseded):
            await lasting

    asyncio.run(doing())


@pytest.mark.parametrize("killed", [True, False], ids=["killed", "closed"])
def test_a_worker_that_ends_while_it_sends_keeps_nobody_waiting(tmp_path: Path, killed: bool) -> None:
    begun = tmp_path / "begun"

    async def doing() -> None:
        worker = Worker()
        sending = asyncio.ensure_future(worker(half_sent, begun))
        for _ in range(2 if killed else 1):
            await there(begun)
            begun.unlink()
            if killed:
                os.kill(process(worker), signal.SIGKILL)
        if not killed:
            closing = threading.Thread(target=worker.close, daemon=True)
            closing.start()
            await asyncio.to_thread(closing.join, 60.0)
            assert not closing.is_alive()
        with pytest.raises(InputError if killed else Superseded):
            await asyncio.wait_for(sending, 60.0)
        worker.close()

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
