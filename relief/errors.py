"""Input errors: what a user can cause and correct."""

from collections.abc import Iterator
from contextlib import contextmanager


class InputError(ValueError):
    """Bad input, in one line that names file and field; the command line prints it and exits with 2."""


@contextmanager
def naming(subject: object) -> Iterator[None]:
    """Put a file's name before every InputError of the block, which names a field alone.

    Args:
        subject: The file, or another name for what was read.

    Raises:
        InputError: The block raised one; the message now begins with ``subject``.
    """
    try:
        yield
    except InputError as error:
        raise InputError(f"{subject}: {error}") from error
