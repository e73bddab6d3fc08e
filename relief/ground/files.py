"""Files: written whole or not at all, read within a limit; locks of folders, and the folder of the cache."""

import glob
import io
import logging
import os
import shutil
import tempfile
import time
import warnings
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, redirect_stdout, suppress
from functools import cache
from pathlib import Path

from relief.ground.errors import InputError
from relief.ground.lengths import shown

_log = logging.getLogger(__name__)

PARTIAL = ".partial"
"""Ending of the name of a temporary folder; the name begins with a dot."""
GROWN_BYTES = 1 << 16
"""Bytes that are read at once of a file that grows while it is read."""
UNLOCKED_S = 1.0
"""Age of a temporary folder, s, from which its writer holds a lock on it."""


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


def lock_holder(folder: Path) -> int | None:
    """Return the number of the process that holds the lock of a folder.

    Args:
        folder: The folder.

    Returns:
        The number of the process in Linux's table of locks. None if nobody holds the lock, or if the process
        cannot be seen from here: it belongs to another user or container, or the system has no such table.
    """
    with suppress(OSError):
        place = folder.stat()
        for line in Path("/proc/locks").read_text().splitlines():
            # "1: FLOCK ADVISORY WRITE 4412 fe:00:2147666 0 EOF"; who waits has "->" in place of "FLOCK".
            _, kind, _, _, process, where, *_ = line.split()
            if kind == "FLOCK" and where.endswith(f":{place.st_ino}"):
                # The table has other numbers of devices than `stat` on some file systems, as on btrfs.
                for opened in Path(f"/proc/{process}/fd").iterdir():
                    with suppress(FileNotFoundError):
                        if os.path.samestat(opened.stat(), place):
                            return int(process)
    return None


@contextmanager
def only_writer(folder: Path, held: str = "another command is writing into this folder") -> Iterator[None]:
    """Keep a folder to this writer until the block ends; the folder is made if it is missing.

    The lock is on the folder itself (``flock``), so that a killed process leaves nothing behind. The lock
    holds among threads, and among containers of one machine that share the folder. Where there are no such
    locks, as on Windows and on some network file systems, the block runs without one, as the log says.

    Args:
        folder: The folder that the block writes into.
        held: What the message says, after the name of the folder, if another writer holds it.

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
            raise InputError(f"{folder}: {held}") from None
        except (ImportError, OSError) as error:
            _log.info("%s: no lock: %s", folder, error)
        yield


@contextmanager
def partial_folder(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary folder beside ``path``, on the same file system; it is gone when the block ends.

    Folders that killed processes have left of the same ``path`` are removed: a lock dies with its process.

    Args:
        path: The final path of the file or folder; missing folders are made.

    Yields:
        The temporary folder.

    Raises:
        OSError: The folder cannot be made or written; the error names ``path``.
    """
    path = Path(path)
    with naming_errors(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        for left in path.parent.glob(f".{glob.escape(path.stem)}-*{PARTIAL}"):
            with suppress(OSError, ImportError), locked(left):
                if time.time() - left.stat().st_mtime >= UNLOCKED_S:
                    shutil.rmtree(left, ignore_errors=True)
        with (
            tempfile.TemporaryDirectory(PARTIAL, f".{path.stem}-", path.parent) as folder,
            ExitStack() as lock,
        ):
            # Without locks, as on Windows and on some network file systems, nothing is removed by others.
            with suppress(OSError, ImportError):
                lock.enter_context(locked(Path(folder)))
            yield Path(folder)


@contextmanager
def naming_errors(path: Path) -> Iterator[None]:
    """Give the OSErrors of the block, if they name no file or a temporary one, the name of a file.

    Args:
        path: The file.

    Raises:
        OSError: The block raised one.
    """
    try:
        yield
    except OSError as error:
        if error.errno is None or PARTIAL not in str(error.filename or PARTIAL):
            raise
        raise OSError(error.errno, error.strerror, os.fspath(path)) from error


def check_file_to_write(path: Path) -> None:
    """Raise InputError if no file can be written at ``path``: its folder is missing, or it is a folder."""
    missing = not path.parent.is_dir()
    if missing or path.is_dir():
        fault = f"there is no folder {path.parent}" if missing else "is a folder"
        raise InputError(f"{path}: {fault}", f"{path}: -o: {fault}")


@contextmanager
def permitted(path: Path) -> Iterator[None]:
    """Raise a PermissionError of the block, which may name a temporary file, as an InputError of ``path``."""
    try:
        yield
    except PermissionError as error:
        raise InputError(f"{path}: {error.strerror}", f"{path}: -o: {error.strerror}") from error


def remove_partial(folder: Path, older_than_s: float = 0.0) -> None:
    """Remove the temporary folders that killed processes have left in a folder, as far as possible.

    Args:
        folder: The folder; it may not exist.
        older_than_s: Least age of folders that are removed, s.
    """
    for path in partial_folders(folder):
        if time.time() - path.stat().st_mtime >= older_than_s:
            shutil.rmtree(path, ignore_errors=True)


def partial_folders(folder: Path) -> list[Path]:
    """Return the temporary folders in a folder."""
    return list(folder.glob(f".*{PARTIAL}"))


@contextmanager
def partial_file(path: str | os.PathLike[str]) -> Iterator[Path]:
    """Give a temporary path of the same name; it replaces ``path`` when the block ends without an error.

    Missing folders are made. After an error nothing is left of the temporary file, and an earlier file at
    ``path`` stays as it was.

    Args:
        path: The final place of the file.

    Yields:
        The temporary path to write to, on the same file system, with the same suffix.

    Raises:
        OSError: The folder cannot be made, or the file cannot be written; the error names ``path``.
    """
    with partial_folder(path) as folder:
        partial = folder / Path(path).name
        yield partial
        os.replace(partial, path)
        _log.info("%s: written", path)


def write_atomically(path: str | os.PathLike[str], content: bytes) -> None:
    """Write a file that appears whole or not at all.

    Args:
        path: The file; missing folders are made.
        content: All bytes of the file.

    Raises:
        OSError: The file cannot be written.
    """
    with partial_file(path) as partial:
        partial.write_bytes(content)


def read_limited(path: Path, limit: int) -> bytes:
    """Read a file that may be hostile: never more than its kind can need.

    Args:
        path: The file.
        limit: Most bytes that it may hold.

    Returns:
        All bytes of the file.

    Raises:
        InputError: The file cannot be read or is longer than ``limit``.
    """
    try:
        with path.open("rb") as file:
            # Python allocates the requested bytes at once, more than a file may have; pipes state no size.
            size = os.fstat(file.fileno()).st_size
            content = file.read(min(limit, size or limit) + 1)
            while size < len(content) <= limit and (more := file.read(GROWN_BYTES)):
                content += more
    except OSError as error:
        raise InputError(f"{path}: {error.strerror}") from error
    if len(content) > limit:
        raise InputError(f"{path}: is longer than {limit} bytes")
    return content


def cache_folder() -> Path:
    """Return the folder for results that can be computed again; it may not exist yet.

    Returns:
        The value of ``RETOUCH_CACHE``, else ``retouch`` in the user's cache folder (``XDG_CACHE_HOME``). For
        a user without a home, as in some containers, a temporary folder that goes with the process.
    """
    if chosen := os.environ.get("RETOUCH_CACHE"):
        return Path(chosen)
    try:
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "retouch"
    except RuntimeError:
        return Path(_passing_folder().name)


@cache
def _passing_folder() -> tempfile.TemporaryDirectory[str]:
    """A folder for this process alone: other users could leave false files in a shared folder."""
    return tempfile.TemporaryDirectory(prefix="retouch-")


@contextmanager
def damage_named(path: Path, kind: str) -> Iterator[None]:
    """Raise any error of another package on a hostile file as InputError, and drop its output."""
    try:
        with warnings.catch_warnings(), redirect_stdout(io.StringIO()), no_stderr():
            warnings.simplefilter("ignore")
            yield
    except InputError:
        raise
    except Exception as error:
        reason = shown(str(error) or type(error).__name__)
        raise InputError(f"{path}: damaged or not {kind}: {reason}") from error


@contextmanager
def no_stderr() -> Iterator[None]:
    """Drop what libraries in C print on stderr, where one line of the error takes its place."""
    with ExitStack() as ending:
        with suppress(OSError):  # It may be closed.
            stderr = os.dup(2)
            ending.callback(os.close, stderr)
            ending.callback(os.dup2, stderr, 2)
            os.dup2(ending.enter_context(open(os.devnull, "wb")).fileno(), 2)
        yield
