"""Mitsuba (`mi`) and Dr.Jit (`dr`), loaded at their first use, after the choice of libLLVM.

Modules of this package name both at their top: importing one of them loads neither. Attributes are asked of
Mitsuba each time, because they belong to the variant that is set.
"""

from contextlib import AbstractContextManager, nullcontext
from functools import partial
from importlib import import_module
from types import ModuleType
from typing import TYPE_CHECKING

from relief.ground.errors import InputError
from relief.ground.files import no_stderr
from relief.ground.lazy import LoadedAtFirstUse
from visual.backend import llvm


def load(name: str) -> ModuleType:
    """Import Dr.Jit or Mitsuba by its name, after the choice of libLLVM, which Dr.Jit takes at its import.

    Without a libLLVM the scalar variants render, and what Dr.Jit prints about it is dropped.

    Raises:
        InputError: the package is missing, or a library of the system that it needs.
    """
    quiet: AbstractContextManager[None] = nullcontext()
    try:
        llvm.prepare()
    except llvm.LLVMMissing:
        quiet = no_stderr()
    try:
        with quiet:
            return import_module(name)
    except (ImportError, NameError) as error:
        # Dr.Jit raises a NameError about an ImportError that names the library.
        raise InputError(f"{name} does not load: {error.__context__ or error} ({llvm.REMEDY})") from error


if TYPE_CHECKING:
    import drjit as dr
    import mitsuba as mi
else:
    dr, mi = (LoadedAtFirstUse(partial(load, name)) for name in ("drjit", "mitsuba"))

__all__ = ["dr", "mi"]
