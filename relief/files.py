"""Atomic files and the cache folder: a reader finds a whole file or none."""

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path


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
        OSError: The folder cannot be made, or the file cannot be moved to its place.
    """
    path = Path(path)
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(prefix=f".{path.stem}-", dir=path.parent) as folder:
        partial = Path(folder) / path.name
        yield partial
        os.replace(partial, path)


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


def cache_folder() -> Path:
    """Return the folder for results that can be computed again; it may not exist yet.

    Returns:
        The value of ``RETOUCH_CACHE``, else ``retouch`` in the user's cache folder (``XDG_CACHE_HOME``).
    """
    if chosen := os.environ.get("RETOUCH_CACHE"):
        return Path(chosen)
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "retouch"
