"""Options, exit statuses and error messages that several verbs share."""

import argparse
import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

from relief.errors import InputError

if TYPE_CHECKING:
    from rich.console import Console

INTERRUPTED = 130
"""Exit status after Ctrl-C: 128 + SIGINT, as shells count."""

UNBOUNDED = 10_000
"""Columns of output that goes to a file or pipe: so many that no row of a table is wrapped."""

RELIEF_DEFAULT = "none; required for PNG and TIFF; EXR and NPY hold mm"
"""Default of `--relief-mm` in the help of a verb that takes nothing but textures."""


def define(text: str) -> tuple[str, str]:
    """Read the `key=value` of `-D` as a pair.

    Raises:
        argparse.ArgumentTypeError: there is no `=`, or the key is no identifier.
    """
    key, equals, value = text.partition("=")
    if not (equals and key.isidentifier()):
        raise argparse.ArgumentTypeError(f"{text!r}: expected key=value, as in resolution=256")
    return key, value


def count(text: str) -> int:
    """Read a number of samples, 1 to 65536. Raises argparse.ArgumentTypeError."""
    return whole_number(1, 65536)(text)


def seed(text: str) -> int:
    """Read a seed, 0 to 2**31 - 1. Raises argparse.ArgumentTypeError."""
    return whole_number(0, 2**31 - 1)(text)


def whole_number(lowest: int, highest: int) -> Callable[[str], int]:
    """A function that reads a whole number from `lowest` to `highest`, both included.

    The function raises argparse.ArgumentTypeError for any other text.
    """

    def read(text: str) -> int:
        if not (text.isdecimal() and lowest <= int(text) <= highest):
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from {lowest} to {highest}")
        return int(text)

    return read


def add_plate(parser: argparse._ActionsContainer, size_default: str, relief_default: str) -> None:
    """Add `--size-mm` and `--relief-mm`, None where not given; the texts name the default in the help."""
    parser.add_argument(
        "--size-mm", type=float, metavar="MM", help=f"side of the plate, mm (default: {size_default})"
    )
    parser.add_argument(
        "--relief-mm",
        type=float,
        metavar="MM",
        help=f"height of white above black in the texture, mm (default: {relief_default})",
    )


def add_mitsuba(parser: argparse._ActionsContainer) -> None:
    """Add `-D` and `-m`, which mean what they mean in Mitsuba's own command."""
    parser.add_argument(
        "-D",
        dest="defines",
        type=define,
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="value of the scene's parameter $KEY; may be given several times (default: the scene's)",
    )
    add_variant(parser)


def add_variant(parser: argparse._ActionsContainer) -> None:
    """Add `-m`."""
    parser.add_argument(
        "-m",
        dest="variant",
        metavar="VARIANT",
        help="Mitsuba's variant (default: the leanest that shows the scene; scalar_rgb without LLVM)",
    )


def console() -> "Console":
    """The console for tables on stdout."""
    from rich.console import Console

    terminal = Console(highlight=False)
    return terminal if terminal.is_terminal else Console(highlight=False, width=UNBOUNDED)


@contextlib.contextmanager
def contact_errors_name(subject: Path | str) -> Iterator[None]:
    """Raise a ContactError of the block as an InputError that starts with the subject."""
    import tactile

    try:
        yield
    except tactile.ContactError as error:
        raise InputError(f"{subject}: {error}") from error
