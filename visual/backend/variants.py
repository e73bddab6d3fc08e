"""Variants of Mitsuba: which one renders, and whether its pictures have gradients."""

import difflib
import sys
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache
from types import ModuleType

from relief.ground.errors import InputError
from visual.backend import llvm
from visual.backend.mitsuba import dr, mi

WITHOUT_LLVM = "scalar_rgb"
"""Variant that needs no libLLVM; its pictures have three channels, those of grey scenes too."""
UNTESTED = "; not tested on any CUDA device"
"""Note on variants for such devices."""
FEWEST_THREADS = 2
"""Least number of Dr.Jit's threads: with a single one Mitsuba 3.9 waits for ever for EXR files."""


@dataclass(frozen=True)
class Variant:
    """A variant of Mitsuba.

    Attributes:
        name: of the variant.
        reason: why it was chosen, in one line.
    """

    name: str
    reason: str


def is_differentiable(name: str) -> bool:
    """Whether pictures of the variant called `name` have gradients: spectra and polarised light have none."""
    return name.endswith(("_ad_mono", "_ad_rgb"))


def choose_variant(colour: bool, variant: str | None = None) -> Variant:
    """The variant for a scene, without setting it.

    The processor renders. A CUDA device is taken only if the user names a variant for it, because no test has
    run on one. Without a usable libLLVM the choice is `scalar_rgb`, which gives pictures without gradients.

    Args:
        colour: whether any material or light of the scene is not grey.
        variant: the user's own choice, which wins.

    Raises:
        InputError: Mitsuba does not have the user's variant, or this machine cannot run it.
    """
    missing = ""
    try:
        llvm.prepare()
    except llvm.LLVMMissing as error:
        missing = str(error)
    if variant is not None:
        return _requested(variant, missing)
    channels = "rgb" if colour else "mono"
    reason = "a material or a light has colour" if colour else "every material and light is grey"
    if missing:
        return Variant(WITHOUT_LLVM, f"pictures only, without gradients: {missing}")
    return Variant(f"llvm_ad_{channels}", reason)


def has_cuda() -> bool:
    """Whether Dr.Jit can compute on a CUDA device of this machine."""
    return bool(dr.has_backend(dr.JitBackend.CUDA))


def _requested(name: str, missing: str) -> Variant:
    """The user's own choice, checked; `missing` says why libLLVM is missing, empty if there is one."""
    names = mi.variants()
    if name not in names:
        nearest = difflib.get_close_matches(name, names, n=1, cutoff=0.0)
        raise InputError(f"variant: {name!r} is not a variant of Mitsuba; the nearest is {nearest[0]!r}")
    if name.startswith("llvm_") and missing:
        raise InputError(f"variant: {name!r} cannot run here: {missing}")
    if name.startswith("cuda_") and not has_cuda():
        raise InputError(f"variant: {name!r} cannot run here: there is no usable CUDA device")
    return Variant(name, "asked for" + UNTESTED * name.startswith("cuda_"))


def load_mitsuba(colour: bool, variant: str | None = None) -> ModuleType:
    """The module `mitsuba` with the variant of `choose_variant` set; arguments and errors are the same."""
    chosen = choose_variant(colour, variant)
    _require_threads()
    use(chosen.name)
    return sys.modules["mitsuba"]


@cache
def _require_threads() -> None:
    """Give Dr.Jit at least `FEWEST_THREADS` threads, once."""
    if dr.thread_count() < FEWEST_THREADS:
        dr.set_thread_count(FEWEST_THREADS)


@contextmanager
def few_threads() -> Iterator[None]:
    """Give Dr.Jit `FEWEST_THREADS` threads in the block, for processes that share the cores of a machine."""
    before = dr.thread_count()
    dr.set_thread_count(FEWEST_THREADS)
    try:
        yield
    finally:
        dr.set_thread_count(before)


def use(name: str) -> None:
    """Set again the variant in which a scene was loaded, should another be set."""
    if mi.variant() == name:
        return
    with warnings.catch_warnings():
        # Every change of the variant loads Mitsuba's integrators anew, and Dr.Jit counts the functions that
        # are compiled by it: after some hundred changes, as in a study, it warns of more than 1000.
        warnings.filterwarnings("ignore", "The AST-transforming decorator", RuntimeWarning)
        mi.set_variant(name)


def require_gradients() -> None:
    """Raise `InputError` if the variant that `load_mitsuba` has set gives no gradients."""
    name = mi.variant()
    missing = without_gradients("None" if name is None else name)
    if missing:
        raise InputError(missing)


def without_gradients(name: str) -> str | None:
    """Why pictures of a variant have no gradients, and the remedy, in one line; None if they have."""
    if is_differentiable(name):
        return None
    try:
        llvm.prepare()
    except llvm.LLVMMissing as missing:
        return f"variant: {name} has no gradients of pictures: {missing}"
    return f"variant: {name} has no gradients of pictures; name no variant, or llvm_ad_mono"
