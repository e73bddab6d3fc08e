"""Input errors: what a user can cause and correct."""

from collections.abc import Iterator
from contextlib import contextmanager
from importlib.util import find_spec


class InputError(ValueError):
    """Bad input, in one line that names file and field; the command line prints it and exits with 2.

    A line may repeat what a hostile file holds: line breaks become spaces, and characters that a terminal
    would obey become question marks.

    Attributes:
        for_command: The line as the command prints it. It differs from ``str(error)``, which is for Python,
            where the one names an option and the other an argument of a function.
    """

    def __init__(self, line: str = "", for_command: str | None = None) -> None:
        super().__init__(_printable(line))
        self.for_command = _printable(line if for_command is None else for_command)


def _printable(line: str) -> str:
    """The text in one line of printable characters."""
    return "".join(sign if sign.isprintable() else "?" for sign in " ".join(line.splitlines()))


def option_error(name: str, fault: str, file: object = "") -> InputError:
    """The error of a value that Python takes as the argument `name`, and the command as an option."""
    prefix = f"{file}: " if file else ""
    return InputError(f"{prefix}{name}: {fault}", f"{prefix}--{name.replace('_', '-')}: {fault}")


def require_extra(extra: str, package: str, file: object) -> None:
    """Raise InputError where a file takes a package of an extra that is not installed.

    Args:
        extra: Name of the extra, an optional set of dependencies of `retouch`.
        package: Name by which Python imports the package.
        file: The file, for the message.
    """
    if find_spec(package) is None:
        raise InputError(f"{file}: needs the extra {extra}: pip install 'retouch[{extra}]'")


class PictureError(InputError):
    """A picture that is no height map, but that `retouch prepare` turns into one."""


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
        raise InputError(f"{subject}: {error}", f"{subject}: {error.for_command}") from error
