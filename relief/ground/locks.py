"""Locks on folders: one writer at a time. A lock dies with the process that holds it."""

import logging
import os
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

from relief.ground.errors import InputError

_log = logging.getLogger(__name__)


@contextmanager
def locked(folder: Path, *, wait: bool = False) -> Iterator[None]:
    """Hold the lock of a folder (``flock``) until the block ends.

    Args:
        folder: The folder, which exists.
        wait: Whether to wait until another process has let go of the lock.

    Raises:
        BlockingIOError: Another process holds the lock, and nobody waits.
        ImportError, OSError: There are no such locks, as on Windows and on some network file systems.
    """
    import fcntl  # Windows has none.

    descriptor = os.open(folder, os.O_RDONLY)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
        yield
    finally:
        os.close(descriptor)


@contextmanager
def only_writer(folder: Path) -> Iterator[None]:
    """Keep a folder to this writer until the block ends; the folder is made if it is missing.

    The lock is on the folder itself (``flock``), so that a killed process leaves nothing behind. The lock
    holds among threads, and among containers of one machine that share the folder. Where there are no such
    locks, as on Windows and on some network file systems, the block runs without one, as the log says.

    Args:
        folder: The folder that the block writes into.

    Raises:
        InputError: The folder is a file, or another writer holds it.
        OSError: The folder cannot be made.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise InputError(f"{folder}: is a file, not a folder") from None
    with ExitStack() as lock:
        try:
            lock.enter_context(locked(folder))
        except BlockingIOError:
            raise InputError(f"{folder}: another command is writing into this folder") from None
        except (ImportError, OSError) as error:
            _log.info("%s: no lock: %s", folder, error)
        yield
