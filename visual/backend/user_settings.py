"""Settings of Mitsuba and Dr.Jit that belong to the user of the Python interface, put back after every call.

A change of Mitsuba's variant takes 0.1 CPU seconds, so that only the outermost call puts anything back: what
the call calls in turn, such as the steps of a descent, finds the variant of its scene as it was left.
"""

import sys
import warnings
from contextlib import ContextDecorator, ExitStack
from importlib import import_module
from inspect import isfunction
from typing import Any, TypeVar

FEWEST_THREADS = 2
"""Least number of Dr.Jit's threads: with a single one Mitsuba 3.9 waits for ever for EXR files."""

_Made = TypeVar("_Made")


class _KeptSettings(ContextDecorator):
    """Block or function after which the variant, the threads and the log level are what they were before.

    Only the outermost block of the process puts them back, as Mitsuba has one variant for all threads. A user
    who had set no variant has that of the last scene afterwards.
    """

    def __init__(self) -> None:
        self._depth, self._undo = 0, ExitStack()

    def __enter__(self) -> None:
        self._depth += 1
        # What is not loaded yet has no settings of a user.
        mi, dr = sys.modules.get("mitsuba"), sys.modules.get("drjit")
        if self._depth == 1 and mi and mi.variant():
            self._undo.callback(mi.set_log_level, mi.logger().log_level())
            self._undo.callback(use, mi.variant())
        if self._depth == 1 and dr:
            self._undo.callback(dr.set_thread_count, dr.thread_count())
            require_threads(dr)

    def __exit__(self, *_: object) -> None:
        self._depth -= 1
        if not self._depth:
            self._undo.close()


user_settings_kept = _KeptSettings()
"""Context and decorator: the user's settings are put back at the end of the outermost one."""


def require_threads(dr: Any) -> None:
    """Give Dr.Jit at least `FEWEST_THREADS` threads."""
    dr.set_thread_count(max(FEWEST_THREADS, dr.thread_count()))


def use(name: str) -> None:
    """Set a variant of Mitsuba, should another be set."""
    mi: Any = import_module("mitsuba")
    if mi.variant() == name:
        return
    with warnings.catch_warnings():
        # Every change of the variant loads Mitsuba's integrators anew, and Dr.Jit counts the functions that
        # are compiled by it: after some hundred changes, as in a study, it warns of more than 1000.
        warnings.filterwarnings("ignore", "The AST-transforming decorator", RuntimeWarning)
        mi.set_variant(name)


def keeping_user_settings(made: type[_Made]) -> type[_Made]:
    """A class whose public methods, and whose making, keep the user's settings."""
    for name, value in list(vars(made).items()):
        if isfunction(value) and (name == "__init__" or not name.startswith("_")):
            setattr(made, name, user_settings_kept(value))
    return made


def function_of_retouch(value: Any) -> Any:
    """A function of the package `retouch` that keeps the user's settings; what is no function, as it is."""
    if not isfunction(value):
        return value
    kept = user_settings_kept(value)
    kept.__module__ = "retouch"  # Pickles name a function by its module.
    return kept
