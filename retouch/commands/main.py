"""The command `retouch`: its verbs, its exit statuses and its error messages.

Each verb is a module that parses options, calls the function of the same name of `retouch` and prints what
comes back; its docstring is its help, with values of the module in braces. The functions load at their first
use, after the cheap checks: help and refusals are instant, and a verb that renders nothing loads no Mitsuba.
"""

import argparse
import difflib
import errno
import importlib
import itertools
import os
import re
import sys
import tempfile
import traceback
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

from optimize.runs.interrupts import INTERRUPTED, interruptible, leave_interrupted
from relief.ground.errors import InputError
from retouch.commands.options import telling
from retouch.commands.streams import standard_streams
from retouch.verbs.progress_display import shown

BAD_INPUT = 2
"""Exit status of bad input, the same as argparse's for bad arguments."""
INTERNAL_ERROR = 1
"""Exit status of an error that no check foresaw."""
LONGEST_ERROR = 200
"""Most characters of such an error in the line that is printed."""
ALIKE = 0.6
"""Least similarity (difflib) of an option that is suggested."""
BROKEN_PIPE = 1
"""Exit status when the reader of the output has left, as in Python's documentation of SIGPIPE."""

USERS_OWN = frozenset(
    {
        *(errno.ENOENT, errno.EEXIST, errno.ENOTDIR, errno.EISDIR, errno.ELOOP, errno.ENAMETOOLONG),
        *(errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOSPC, errno.EDQUOT, errno.EFBIG),
    }
)
"""Error numbers of files and folders that the user can mend; any other is the program's."""

VERB_NAMES = (
    "app",
    "prepare",
    "optimize",
    "resume",
    "evaluate",
    "compare",
    "render",
    "export",
    "wrap",
    "fuzzy",
    "study",
    "stimuli",
    "palette",
    "answers",
    "scan",
    "dataset",
    "train",
    "doctor",
)
"""Verbs in the order of the help."""
VERBS = {name: importlib.import_module(f"retouch.commands.{name}") for name in VERB_NAMES}
"""Modules of the verbs by name."""

DESCRIPTION = "Changes how a surface texture feels while it keeps its look, and writes it for a 3-D printer."

EPILOG = """\
first steps:
  retouch doctor                                         is everything here?
  retouch prepare stone.jpg -o stone.png                 a height map of any picture
  retouch evaluate stone.png --relief-mm 1.2             how rough does it feel now?
  retouch optimize stone.png --relief-mm 1.2 --jnd 2     two just-noticeable differences rougher, same look

Lengths are in mm, forces in N, pressures in MPa. `retouch VERB --help` explains a verb.
"""

KEY = re.compile(r"(?:^|(?<=: ))[a-z_]\w*(?:\.\w+)*(?=: )")
"""Dotted key of a run file, or the name of an argument, in the line of an InputError."""

NEGATIVE_LIST = re.compile(r"-[\d.][^,]*,|-[xyz]$")
"""Begin of a list of numbers whose first is negative, or an axis, which argparse takes for options."""

PATIENT_THREADS = {"OMP_WAIT_POLICY": "PASSIVE", "KMP_BLOCKTIME": "0"}
"""Environment variables that make idle threads sleep. torch, Pardiso and Dr.Jit each keep a pool of threads;
pools that spin while idle take the cores from one another (docs/evidence/optimiser.md)."""


class UsageError(Exception):
    """Arguments that do not parse; the message is one line."""


class _Parser(argparse.ArgumentParser):
    """A parser that raises its error, so that `main` prints it in one line like every other bad input."""

    def __init__(self, **settings: Any) -> None:
        layout = argparse.RawDescriptionHelpFormatter
        super().__init__(formatter_class=layout, allow_abbrev=False, **settings)

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message.removeprefix('argument ')} (see {self.prog} --help)")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command.

    Args:
        argv: arguments without the name of the program; those of the process by default.

    Returns:
        The exit status: 0 for success, 2 for bad input (explained in one line on stderr), 1 if the reader of
        the output has left or for an error of the program itself (one line names the file of its traceback),
        130 if interrupted, or one that the help of the verb lists.

    Raises:
        SystemExit: by argparse, for `--help` and `--version`.
    """
    for name, value in PATIENT_THREADS.items():
        os.environ.setdefault(name, value)
    # Readers of files lead descriptor 2 to nowhere meanwhile; an interrupt is reported all the same.
    with standard_streams(), open(os.dup(2), "wb") as stderr:
        return _main(sys.argv[1:] if argv is None else argv, stderr.fileno())


def _main(argv: Sequence[str], stderr: int) -> int:
    """Run the command on streams that are ready; see `main`."""
    arguments = argparse.Namespace(verb=None)

    def leave() -> NoReturn:
        leave_interrupted(_after_interrupt(arguments), stderr)

    try:
        with interruptible(leave=leave) as interrupted:
            try:
                arguments = parse(argv)
            finally:
                # The help is printed by now, and may not fit; the interpreter would say so in its own words.
                sys.stdout.flush()
            run: Callable[[argparse.Namespace], int] = VERBS[arguments.verb].run
            with telling(getattr(arguments, "verbose", False)), shown(getattr(arguments, "quiet", False)):
                status = run(arguments)
            sys.stdout.flush()
        if interrupted() and status != INTERRUPTED:
            raise KeyboardInterrupt
    except InputError as error:
        return _refuse(_by_options(error.for_command, arguments.options))
    except UsageError as error:
        return _refuse(str(error))
    except BrokenPipeError:
        return BROKEN_PIPE
    except OSError as error:
        if error.errno not in USERS_OWN:
            return _internal(error)
        file = error.filename2 or error.filename
        return _refuse(f"{file}: {error.strerror}" if file else str(error.strerror))
    except KeyboardInterrupt:
        print(f"retouch: interrupted{_after_interrupt(arguments)}", file=sys.stderr)
        return INTERRUPTED
    except Exception as error:
        return _internal(error)
    return status


def parse(argv: Sequence[str]) -> argparse.Namespace:
    """Parse arguments.

    Returns:
        The arguments by name; `verb` is the name of the verb, `options` are the options that were given, by
        the keys or the arguments that they set.

    Raises:
        UsageError: an unknown verb or option, or a bad value.
    """
    if argv and not argv[0].startswith("-") and argv[0] not in VERBS:
        near = difflib.get_close_matches(argv[0], VERBS, n=1, cutoff=ALIKE)
        raise UsageError(f"{argv[0]}: no such verb" + (f"; the nearest is {near[0]}" if near else ""))
    _refuse_empty(argv)
    argv = _lists_joined(argv)
    parser = _Parser(prog="retouch", description=DESCRIPTION, epilog=EPILOG)
    parser.add_argument("--version", action=_Version, nargs=0, help="show the version and exit")
    verbs = parser.add_subparsers(dest="verb", metavar="VERB", required=True)
    parsers = {}
    for name, verb in VERBS.items():
        parsers[name] = verbs.add_parser(name, **texts_of(verb))
        # Options of other verbs are asked for only where the verb does not come first.
        if not argv or argv[0] not in (*VERBS.keys() - {name}, "-h", "--help", "--version"):
            verb.add_arguments(parsers[name])
    if not argv or argv[0] not in VERBS:
        return parser.parse_args(argv)
    parser = parsers[argv[0]]
    # Files may stand on both sides of an option.
    arguments, unknown = parser.parse_known_intermixed_args(argv[1:], argparse.Namespace(verb=argv[0]))
    if unknown:
        parser.error(_unknown(unknown[0], parser))
    arguments.options = _given_options(parser, arguments, argv[1:])
    return arguments


def texts_of(verb: ModuleType) -> dict[str, Any]:
    """What the help says of a verb: the docstring of its module, whose examples and all below stand last."""
    first, rest = (verb.__doc__ or "\n\n").format(**vars(verb)).split("\n\n", 1)
    description, *examples = re.split(r"\n(?=examples?:)", rest, maxsplit=1)
    help_ = first.partition(": ")[2].removesuffix(".")
    return {"help": help_, "description": description, "epilog": "".join(examples)}


def _refuse_empty(argv: Sequence[str]) -> None:
    """Raise UsageError for an argument or value of an option that is an empty text, which names nothing."""
    for before, argument in itertools.pairwise(["", *argv]):
        option, equals, value = argument.partition("=")
        if not argument or (option.startswith("--") and equals and not value):
            option = option or (before if before.startswith("-") else "an argument")
            raise UsageError(f"{option}: empty; leave it out, or name something")


def _given_options(
    parser: argparse.ArgumentParser, arguments: argparse.Namespace, argv: Sequence[str]
) -> dict[str, str]:
    """Options that were given, by the names of their arguments, and those of dotted keys by these keys.

    Options of files are left out: a file may have the name of an argument.
    """
    typed = {argument.partition("=")[0] for argument in argv}
    options: dict[str, str] = {}
    for action in parser._actions:
        names = typed.intersection(action.option_strings)
        if names and action.type is not Path:
            options[action.dest] = max(names, key=len)
    options |= {f"define.{key}": f"-D {key}" for key, _ in getattr(arguments, "defines", ())}
    settings = getattr(arguments, "settings", ())
    return options | {setting.partition("=")[0].strip(): f"--set {setting}" for setting in settings}


def _by_options(line: str, options: Mapping[str, str]) -> str:
    """What is wrong with a key, with the option that set the key in its place if one did."""
    for key in KEY.finditer(line):
        option = options.get(key[0]) or options.get(key[0].rpartition(".")[2])
        if option is not None:
            return f"{line[: key.start()]}{option}{line[key.end() :]}"
    return line


def _after_interrupt(arguments: argparse.Namespace) -> str:
    """How to go on after an interrupt, as the end of a line; empty where nothing is known."""
    verb = VERBS.get(arguments.verb)
    sentence: Callable[[argparse.Namespace], str] | None = getattr(verb, "after_interrupt", None)
    after: str = getattr(verb, "AFTER_INTERRUPT", "")
    return after if sentence is None else sentence(arguments)


def _lists_joined(argv: Sequence[str]) -> list[str]:
    """The arguments with `--option -1,2` as `--option=-1,2`, and `--option -z` as `--option=-z`."""
    joined: list[str] = []
    for argument in argv:
        if NEGATIVE_LIST.match(argument) and joined and joined[-1].startswith("--"):
            joined[-1] += f"={argument}"
        else:
            joined.append(argument)
    return joined


def _unknown(argument: str, parser: argparse.ArgumentParser) -> str:
    """What is wrong with an argument that a verb does not know, with the nearest option."""
    name = argument.partition("=")[0]
    if not name.startswith("-"):
        return f"{argument}: one argument too many"
    options = [option for action in parser._actions for option in action.option_strings]
    by_words = {option.lstrip("-"): option for option in options}
    near = difflib.get_close_matches(name.lstrip("-"), by_words, 1, ALIKE)
    return f"{name}: no such option" + (f"; the nearest is {by_words[near[0]]}" if near else "")


class _Version(argparse.Action):
    """Prints the version and exits."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        # Imported here: it takes an eighth of the time of `--help`.
        from importlib import metadata

        try:
            version = metadata.version("retouch")
        except metadata.PackageNotFoundError:
            version = "(not installed)"
        print(f"retouch {version}")
        parser.exit()


def _refuse(message: str) -> int:
    print("retouch:", " ".join(message.split()), file=sys.stderr)
    return BAD_INPUT


def _internal(error: Exception) -> int:
    """Write the traceback of an error of the program itself to a file, and say where in one line."""
    try:
        # The cache can be the very place that is full or locked.
        file, name = tempfile.mkstemp(prefix="retouch-error-", suffix=".txt")
        with os.fdopen(file, "w", encoding="utf-8", errors="backslashreplace") as log:
            traceback.print_exception(error, file=log)
        place = f"; the traceback is in {name}; please report it"
    except OSError:
        place = "; its traceback could not be written"
    _refuse(f"internal error: {type(error).__name__}: {str(error)[:LONGEST_ERROR]}{place}")
    return INTERNAL_ERROR
