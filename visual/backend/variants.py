"""Which Mitsuba variant renders, and whether its renders have gradients."""

import difflib
from dataclasses import dataclass
from functools import cache
from types import ModuleType

from relief.errors import InputError
from visual.backend import llvm

WITHOUT_LLVM = "scalar_rgb"
"""The variant that needs no libLLVM; its pictures have three channels, grey scenes too."""
FEWEST_THREADS = 2
"""Of Dr.Jit, also on a machine with one core."""


@dataclass(frozen=True)
class Variant:
    """A Mitsuba variant: its name, whether its renders have gradients, and in one line why it was chosen."""

    name: str
    differentiable: bool
    reason: str


def is_differentiable(name: str) -> bool:
    """Whether renders of the variant called `name` have gradients."""
    return "_ad_" in name


def choose_variant(colour: bool, variant: str | None = None) -> Variant:
    """The variant for a scene, without setting it.

    `colour` says whether any material or light of the scene is not grey; `variant` is the user's own choice
    and wins. A CUDA device is taken where there is one, else the processor. With neither such a device nor a
    libLLVM that works the choice is `scalar_rgb`, which gives pictures and no gradients.
    Raises `InputError` for a variant that Mitsuba does not have or that cannot run on this machine.
    """
    missing = ""
    try:
        llvm.prepare()
    except llvm.LLVMMissing as error:
        missing = str(error)
    if variant is not None:
        return _asked(variant, missing)
    channels = "rgb" if colour else "mono"
    reason = "a material or a light has colour" if colour else "every material and light is grey"
    if has_cuda():
        return Variant(f"cuda_ad_{channels}", True, f"{reason}; on the CUDA device")
    if missing:
        return Variant(WITHOUT_LLVM, False, f"pictures only, without gradients: {missing}")
    return Variant(f"llvm_ad_{channels}", True, reason)


def has_cuda() -> bool:
    """Whether Dr.Jit can compute on a CUDA device of this machine."""
    # Only after libLLVM has been chosen.
    import drjit

    return bool(drjit.has_backend(drjit.JitBackend.CUDA))


def _asked(name: str, missing: str) -> Variant:
    """The user's own choice, checked; `missing` is the line about libLLVM, empty if there is one."""
    # Only after libLLVM has been chosen.
    import mitsuba

    known = mitsuba.variants()
    if name not in known:
        nearest = difflib.get_close_matches(name, known, n=1, cutoff=0.0)
        raise InputError(f"variant: {name!r} is not a variant of Mitsuba; the nearest is {nearest[0]!r}")
    if name.startswith("llvm_") and missing:
        raise InputError(f"variant: {name!r} cannot run here: {missing}")
    if name.startswith("cuda_") and not has_cuda():
        raise InputError(f"variant: {name!r} cannot run here: there is no usable CUDA device")
    return Variant(name, is_differentiable(name), "asked for")


def load_mitsuba(colour: bool, variant: str | None = None) -> ModuleType:
    """The module `mitsuba` with the variant of `choose_variant` set; raises what that raises."""
    chosen = choose_variant(colour, variant)
    import mitsuba

    _have_threads()
    use(chosen.name)
    module: ModuleType = mitsuba
    return module


@cache
def _have_threads() -> None:
    """With a single thread Mitsuba 3.9 waits for ever for the EXR files that it reads; looked at once."""
    import drjit

    if drjit.thread_count() < FEWEST_THREADS:
        drjit.set_thread_count(FEWEST_THREADS)


def use(name: str) -> None:
    """Set a variant that ran before, for a scene loaded in it, should another have been set since."""
    import mitsuba

    if mitsuba.variant() != name:
        mitsuba.set_variant(name)


def require_gradients() -> None:
    """Raise `InputError` if the variant that `load_mitsuba` has set gives no gradients."""
    import mitsuba

    name = mitsuba.variant()
    missing = without_gradients("None" if name is None else name)
    if missing:
        raise InputError(missing)


def without_gradients(name: str) -> str | None:
    """Why renders of the variant called `name` have no gradients and what to do about it, in one line; None
    if they have."""
    if is_differentiable(name):
        return None
    try:
        llvm.prepare()
    except llvm.LLVMMissing as missing:
        return f"variant: {name} has no gradients of pictures: {missing}"
    return f"variant: {name} has no gradients of pictures; leave -m out or choose llvm_ad_mono"
