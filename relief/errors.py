"""The error that a user can cause and mend."""

from collections.abc import Iterator
from contextlib import contextmanager


class InputError(ValueError):
    """Bad input: one line that names the file and the field. The command line prints it and exits with 2."""


@contextmanager
def naming(subject: object) -> Iterator[None]:
    """Put the name of a file before the InputErrors of the block, which name a field alone."""
    try:
        yield
    except InputError as error:
        raise InputError(f"{subject}: {error}") from error
