"""What several verbs share: options, where they print, errors of touch told with their file."""

import argparse
import contextlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

UNBOUNDED = 10_000
"""Columns of output that is no terminal: a line of a table stays one line."""


def define(text: str) -> tuple[str, str]:
    """``key=value`` of ``-D`` as a pair. Raises ArgumentTypeError."""
    key, equals, value = text.partition("=")
    if not (equals and key.isidentifier()):
        raise argparse.ArgumentTypeError(f"{text!r}: expected key=value, as in resolution=256")
    return key, value


def count(text: str) -> int:
    """A number of samples, from 1 to 65536. Raises ArgumentTypeError."""
    return whole_number(1, 65536)(text)


def seed(text: str) -> int:
    """A seed, from 0 to 2**31 - 1. Raises ArgumentTypeError."""
    return whole_number(0, 2**31 - 1)(text)


def whole_number(lowest: int, highest: int) -> Callable[[str], int]:
    """What reads a number in a range, both ends included, and raises ArgumentTypeError for anything else."""

    def read(text: str) -> int:
        if not (text.isdecimal() and lowest <= int(text) <= highest):
            raise argparse.ArgumentTypeError(f"{text!r} is not a whole number from {lowest} to {highest}")
        return int(text)

    return read


def add_plate(parser: argparse._ActionsContainer, size_default: str, relief_default: str) -> None:
    """``--size-mm`` and ``--relief-mm``; None where not given. The texts say what holds then."""
    parser.add_argument(
        "--size-mm", type=float, metavar="MM", help=f"side of the plate (default: {size_default})"
    )
    parser.add_argument(
        "--relief-mm",
        type=float,
        metavar="MM",
        help=f"height of white above black in the texture (default: {relief_default})",
    )


def add_mitsuba(parser: argparse._ActionsContainer) -> None:
    """``-D`` and ``-m``, as Mitsuba's own command has them."""
    parser.add_argument(
        "-D",
        dest="defines",
        type=define,
        action="append",
        default=[],
        metavar="KEY=VALUE",
        help="a value for the scene's $KEY; may be given several times",
    )
    parser.add_argument(
        "-m",
        dest="variant",
        metavar="VARIANT",
        help="Mitsuba's variant (default: the leanest that shows the scene; scalar_rgb without LLVM)",
    )


def console() -> "Console":
    """Where tables go."""
    from rich.console import Console

    there = Console(highlight=False)
    return there if there.is_terminal else Console(highlight=False, width=UNBOUNDED)


@contextlib.contextmanager
def contact_of(subject: Path | str) -> Iterator[None]:
    """A contact that does not converge in the block, as an InputError that names the file."""
    import tactile
    from relief.errors import InputError

    try:
        yield
    except tactile.ContactError as error:
        raise InputError(f"{subject}: {error}") from error
