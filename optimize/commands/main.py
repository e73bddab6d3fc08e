"""The command `retouch`: its verbs, and how what goes wrong is told.

Nothing heavy is imported before a verb runs: `retouch --help` is instant, and a verb that only touches never
loads Mitsuba.
"""

import argparse
import difflib
import errno
import importlib.metadata
import os
import sys
from collections.abc import Callable, Sequence
from typing import NoReturn

from optimize.commands import dataset, doctor, evaluate, export, optimize, render, resume, train

BAD_INPUT = 2
INTERRUPTED = 130
"""128 + SIGINT, as shells count."""
BROKEN_PIPE = 1
"""Whoever read our output has left; rich and Python's documentation have the same."""

USERS_OWN = frozenset(
    {
        *(errno.ENOENT, errno.EEXIST, errno.ENOTDIR, errno.EISDIR, errno.ELOOP, errno.ENAMETOOLONG),
        *(errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOSPC, errno.EDQUOT),
    }
)
"""Faults of files and folders that the user can mend; every other OSError is ours and shows its traceback."""

VERBS = {
    "optimize": optimize,
    "resume": resume,
    "evaluate": evaluate,
    "render": render,
    "export": export,
    "dataset": dataset,
    "train": train,
    "doctor": doctor,
}

DESCRIPTION = "Changes how a surface texture feels while it keeps its look, and writes it for a 3-D printer."

EPILOG = """\
first steps:
  retouch doctor                                   is everything here?
  retouch evaluate stone.png --relief-mm 1.2       how rough does it feel now?
  retouch optimize mitsuba_scenes/gravel.toml      two just-noticeable differences rougher, same look

Lengths are mm, forces N, pressures MPa. `retouch VERB --help` tells the rest.
"""


PATIENT_THREADS = {"OMP_WAIT_POLICY": "PASSIVE", "KMP_BLOCKTIME": "0"}
"""torch, Pardiso and Dr.Jit each keep a pool of threads. Left to spin while they wait, beside other work on
two cores, a step took 14 s instead of 1.8 s; on idle cores sleeping costs nothing that was measurable."""


class UsageError(Exception):
    """Arguments that are none; the message is one line."""


class _Parser(argparse.ArgumentParser):
    """Leaves it to `main` to say what is wrong, in one line as for every other bad input."""

    def error(self, message: str) -> NoReturn:
        raise UsageError(f"{message.removeprefix('argument ')} (see {self.prog} --help)")


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command with these arguments (those of the process by default); returns the exit status.

    0: done. 2: bad input, told in one line on stderr. 130: interrupted. A verb may add its own, told by its
    help. ``--help`` and ``--version`` raise SystemExit, as is argparse's way.
    """
    argv = sys.argv[1:] if argv is None else argv
    for name, value in PATIENT_THREADS.items():
        os.environ.setdefault(name, value)
    try:
        arguments = parse(argv)
    except UsageError as error:
        return _refuse(str(error))
    # Only now, because torch comes with it.
    from relief.errors import InputError

    try:
        run: Callable[[argparse.Namespace], int] = VERBS[arguments.verb].run
        status = run(arguments)
        sys.stdout.flush()
    except InputError as error:
        return _refuse(str(error))
    except BrokenPipeError:
        # The interpreter flushes stdout once more at its end, and would complain.
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return BROKEN_PIPE
    except OSError as error:
        if error.errno not in USERS_OWN:
            raise
        file = error.filename2 or error.filename
        return _refuse(f"{file}: {error.strerror}" if file else str(error.strerror))
    except KeyboardInterrupt:
        return INTERRUPTED
    return status


def parse(argv: Sequence[str]) -> argparse.Namespace:
    """The arguments by name, the verb as ``verb``. Raises UsageError."""
    if argv and not argv[0].startswith("-") and argv[0] not in VERBS:
        nearest = difflib.get_close_matches(argv[0], VERBS, n=1, cutoff=0.0)[0]
        raise UsageError(f"{argv[0]}: no such verb; the nearest is {nearest}")
    parser = _Parser(
        prog="retouch",
        description=DESCRIPTION,
        epilog=EPILOG,
        formatter_class=argparse.RawDescriptionHelpFormatter,
        allow_abbrev=False,
    )
    parser.add_argument("--version", action="version", version=f"retouch {_version()}")
    verbs = parser.add_subparsers(dest="verb", metavar="VERB", required=True)
    for name, verb in VERBS.items():
        verb.add_arguments(
            verbs.add_parser(
                name,
                help=verb.HELP,
                description=verb.DESCRIPTION,
                epilog=verb.EPILOG,
                formatter_class=argparse.RawDescriptionHelpFormatter,
                allow_abbrev=False,
            )
        )
    return parser.parse_args(argv)


def _version() -> str:
    try:
        return importlib.metadata.version("retouch")
    except importlib.metadata.PackageNotFoundError:
        return "(not installed)"


def _refuse(message: str) -> int:
    print("retouch:", " ".join(message.split()), file=sys.stderr)
    return BAD_INPUT
