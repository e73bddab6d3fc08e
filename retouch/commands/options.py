"""Options, exit statuses and error messages that several verbs share."""

import argparse
import contextlib
import inspect
import itertools
import json
import logging
import math
import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

import retouch
from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.settings.run_options import skin_option
from relief import plate_options
from relief.ground.errors import InputError
from relief.ground.formats import UNITS
from relief.ground.limits import PATCH_SIDE_MM
from relief.ground.options import add_option, given, whole_number
from retouch.verbs.progress_display import console_on
from tactile.touch_limits import MODEL_NAMES

if TYPE_CHECKING:
    from rich.console import Console
    from rich.table import Table

    from relief.ground.lengths import Lengths

UNBOUNDED = 10_000
"""Columns of output that goes to a file or pipe: so many that no row of a table is wrapped."""

TEXTURE = (
    "height map: PNG or TIFF (grey is height), EXR, NPY or float TIFF (mm); a bundled one goes by its name, "
    "the result of a run by the run's directory"
)
"""What a texture is, in the help of every verb that takes one."""
LENGTHS = ("size_mm", "relief_mm", "height_scale")
"""Options of `add_plate`, by the names of arguments."""
CORRECTIONS = ("fill", "level")
"""Options that correct what was measured."""
MOST_WORKERS = 1024
PACKAGES = ("relief", "tactile", "visual", "surrogate", "optimize", "retouch", "mitsuba_scenes")
"""Packages whose steps `-v` reports; others report warnings only."""


def define(text: str) -> tuple[str, str]:
    """Read the `key=value` of `-D` as a pair.

    Raises:
        argparse.ArgumentTypeError: there is no `=`, or the key is no identifier.
    """
    key, equals, value = text.partition("=")
    if not (equals and key.isidentifier()):
        raise argparse.ArgumentTypeError(f"{text!r}: expected key=value, as in resolution=256")
    return key, value


def keywords(arguments: argparse.Namespace, function: Callable[..., Any]) -> dict[str, Any]:
    """The arguments that are given and that a function takes, by name; the lengths, if it takes any more."""
    parameters = inspect.signature(function).parameters
    more = LENGTHS if any(one.kind is one.VAR_KEYWORD for one in parameters.values()) else ()
    return given(arguments, *(name for name in (*parameters, *more) if hasattr(arguments, name)))


count = whole_number(1, 65536)
"""Reads a number of samples. Raises argparse.ArgumentTypeError."""
seed = whole_number(0, 2**31 - 1)
"""Reads a seed. Raises argparse.ArgumentTypeError."""


def add(place: argparse._ActionsContainer, usage: str, text: str, **settings: Any) -> None:
    """Add an argument or an option; without a placeholder and settings, an option is a switch.

    Args:
        place: parser or group.
        usage: name, and the placeholder of a value if there is one, as in `--width-mm MM`.
        text: for the help.
        settings: further ones, as of `add_argument`.
    """
    name, _, metavar = usage.partition(" ")
    if metavar:
        settings["metavar"] = metavar
    elif name.startswith("-") and not settings:
        settings["action"] = "store_true"
    place.add_argument(name, help=text, **settings)


def add_talk(parser: argparse.ArgumentParser, document: str, quiet: bool = True) -> None:
    """Add `-v`, and how else a verb talks.

    Args:
        parser: of the verb.
        document: what `--json` prints, for the help.
        quiet: whether there is `-q`.
    """
    talk = parser.add_argument_group("output")
    if quiet:
        add(talk, "-q", "print nothing but warnings and errors", dest="quiet", action="store_true")
    add(talk, "-v", "report on stderr what is done, and what is skipped", dest="verbose", action="store_true")
    text = f"print {document} as one JSON document; progress goes to stderr"
    add(talk, "--json", text)


class _Telling(logging.Handler):
    """Prints records on the stderr of the moment, above a moving line if there is one; warnings once each."""

    def __init__(self) -> None:
        super().__init__()
        self._warned: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        line = self.format(record)
        # A verb may read a file several times.
        if record.levelno < logging.WARNING or line not in self._warned:
            print(line, file=sys.stderr)
            self._warned.add(line)


@contextlib.contextmanager
def telling(verbose: bool) -> Iterator[None]:
    """Print warnings on stderr, and the steps of Retouch's packages if `verbose`."""
    root, handler = logging.getLogger(), _Telling()
    loggers = [logging.getLogger(name) for name in PACKAGES]
    levels = [logger.level for logger in loggers]
    root.addHandler(handler)
    for logger in loggers:
        logger.setLevel(logging.INFO if verbose else logging.WARNING)
    try:
        yield
    finally:
        root.removeHandler(handler)
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


def print_json(content: Any) -> None:
    """Print one JSON document on stdout; numbers that are not finite, which JSON lacks, become null."""
    print(json.dumps(_finite(content), indent=2, default=str))


def report(arguments: argparse.Namespace, document: Any, lines: Iterable[Any]) -> int:
    """Print the document of `--json`, or else lines for a person unless `-q` is given; the status of success.

    Args:
        arguments: of the verb.
        document: as of `print_json`.
        lines: texts, tables (`TextTable`), and pairs of a word and a sentence, which make tables.
    """
    if arguments.json:
        print_json(document)
    elif not getattr(arguments, "quiet", False):
        for paired, each in itertools.groupby(lines, lambda line: isinstance(line, tuple)):
            if paired:
                console().print(lines_table(each))
                continue
            for line in each:
                if isinstance(line, str):
                    print(line)
                else:
                    console().print(table(line.columns, line.rows, line.gap))
    return 0


def _finite(content: Any) -> Any:
    if isinstance(content, dict):
        return {key: _finite(value) for key, value in content.items()}
    if isinstance(content, list | tuple):
        return [_finite(value) for value in content]
    return None if isinstance(content, float) and not math.isfinite(content) else content


def add_out(place: argparse._ActionsContainer, metavar: str, text: str, **more: Any) -> None:
    """Add `-o`, the file or folder to write; `more` as of `add_argument`."""
    place.add_argument("-o", dest="out", type=Path, metavar=metavar, help=text, **more)


def add_model(place: argparse._ActionsContainer) -> None:
    """Add `--model`."""
    text = "model of touch: layer (elastic layer, default), quick (its solver stopped after a few steps), "
    text += "net (quick with a learned net), fem (finite elements)"
    add(place, "--model", text, choices=tuple(MODEL_NAMES), default="layer")


def add_pictures(parser: argparse.ArgumentParser) -> argparse._ArgumentGroup:
    """Add `--scene`, `--samples`, `-D` and `-m` of pictures that are compared, None where not given."""
    pictures = parser.add_argument_group("the pictures")
    text = "Mitsuba scene (default: that of the run, or studio)"
    add(pictures, "--scene SCENE", text, type=Path)
    text = "samples a pixel, 4 to 65536 (default: as many as the change of the pictures needs)"
    add(pictures, "--samples N", text, type=count)
    add_mitsuba(pictures)
    return pictures


def add_plate(
    parser: argparse._ActionsContainer, size: str = f"{PATCH_SIDE_MM:g}", side: str = "side of the plate"
) -> None:
    """Add `--size-mm`, `--relief-mm` and `--height-scale`, or `--units` in its place, None where not given.

    Args:
        parser: of the verb.
        size: where the size comes from after the texture's header.
        side: what the size is of.
    """
    add_option(parser, "size_mm", plate_options.size_option(side, f"the texture's header, or {size}"), float)
    add_option(parser, "relief_mm", plate_options.relief_option("the texture's header"), float)
    scale = parser.add_mutually_exclusive_group()
    add_option(scale, "height_scale", plate_options.height_scale_option("1"), float)
    add(scale, "--units", plate_options.units_option().help, choices=tuple(UNITS), action=_Units)


class _Units(argparse.Action):
    """Keeps the unit, and the height scale that it stands for."""

    def __call__(self, _: Any, namespace: argparse.Namespace, units: Any, __: str | None = None) -> None:
        namespace.units, namespace.height_scale = units, UNITS[units]


def add_repeats(parser: argparse._ActionsContainer, first: str = "") -> None:
    """Add `--repeats`, `--no-repeats` and `--repeats-along`; `repeats` is None where none is given.

    Args:
        parser: of the verb.
        first: where the value comes from before the texture's header, for the help.
    """
    one = parser.add_mutually_exclusive_group()
    text = "the relief is a tile, which goes on as itself beyond its rim, or a plate "
    text += f"(default: {first}{', or ' * bool(first)}the texture's header, or a plate)"
    add(one, "--repeats", text, action=argparse.BooleanOptionalAction)
    add(one, "--repeats-along", "the relief repeats along one axis only", dest="repeats", choices=("x", "y"))


def add_skin(parser: argparse._ActionsContainer, default: str = DEFAULT_SKIN) -> None:
    """Add `--skin`, None where not given, where the skin is `default`."""
    add_option(parser, "skin", skin_option(default))


def add_printer(parser: argparse._ActionsContainer, what: str, default: str = "none") -> None:
    """Add `--printer`, with which `what` is done, None where not given."""
    add_option(parser, "printer", plate_options.printer_option(what, default))


def check_scales(arguments: argparse.Namespace, textures: Iterable[Path]) -> None:
    """Raise InputError for a `--relief-mm` without a picture, and a `--height-scale` without a file in mm."""
    if scales := given(arguments, "relief_mm", "height_scale"):
        from relief import heightmap

        heightmap.check_scales(textures, cast("Lengths", scales))


def add_workers(parser: argparse._ActionsContainer) -> None:
    """Add `--workers` and `--dask`, None where not given."""
    text = "number of processes, of one thread each (default: one for each core)"
    add(parser, "--workers N", text, type=whole_number(1, MOST_WORKERS))
    text = 'address of the scheduler of a Dask cluster, or "local" for a cluster of --workers here'
    add(parser, "--dask ADDRESS", text)


def add_mitsuba(parser: argparse._ActionsContainer) -> None:
    """Add `-D` and `-m`, which mean what they mean in Mitsuba's own command."""
    text = "value of the scene's parameter $KEY; may be given several times (default: the scene's)"
    add(parser, "-D KEY=VALUE", text, dest="defines", type=define, action="append", default=[])
    add_variant(parser)


def add_variant(parser: argparse._ActionsContainer) -> None:
    """Add `-m`."""
    text = "Mitsuba's variant (default: the leanest that shows the scene, on the processor; scalar_rgb "
    text += "without LLVM)"
    add(parser, "-m VARIANT", text, dest="variant")


def console(width: int | None = UNBOUNDED) -> "Console":
    """The console for tables on stdout, so wide in a file or pipe; None: 80 columns, as rich has them."""
    terminal = console_on(sys.stdout)
    return terminal if terminal.is_terminal else console_on(sys.stdout, width=width)


COLUMNS: dict[str, dict[str, Any]] = {
    "": {},
    "name": {"no_wrap": True},
    "text": {"overflow": "fold"},
    "number": {"justify": "right", "no_wrap": True},
}
"""How the cells of a column are set, by its kind."""
Cell = str | tuple[str, str]
"""Text of a cell, or text and style."""


def table(
    columns: Iterable[tuple[str, str]], rows: Iterable[Sequence[Cell]], gap: int = 3, **layout: Any
) -> "Table":
    """A table for a person.

    Args:
        columns: heading and kind of each, a key of `COLUMNS`.
        rows: cells of each.
        gap: spaces between columns.
        layout: further settings of `rich.table.Table`.
    """
    from rich.table import Table
    from rich.text import Text

    rows_table = Table(box=None, padding=(0, gap, 0, 0), **{"pad_edge": False, **layout})
    for heading, kind in columns:
        rows_table.add_column(heading, **COLUMNS[kind])
    for row in rows:
        rows_table.add_row(*(Text(cell) if isinstance(cell, str) else Text(*cell) for cell in row))
    return rows_table


def lines_table(lines: Iterable[tuple[str, str]]) -> "Table":
    """A table of lines, each a word and a sentence."""
    rows = [((name, "bold"), text) for name, text in lines]
    return table((("", "name"), ("", "text")), rows, gap=2, show_header=False)


@contextlib.contextmanager
def contact_errors_name(subject: Path | str) -> Iterator[None]:
    """Raise a ContactError of the block as an InputError that starts with the subject."""
    try:
        yield
    except retouch.ContactError as error:
        raise InputError(f"{subject}: {error}") from error
