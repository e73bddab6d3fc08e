"""Variants of Mitsuba: which one renders, and whether its pictures have gradients."""

import difflib
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from types import ModuleType

from relief.ground.errors import InputError
from visual.backend import llvm
from visual.backend.mitsuba import dr, mi
from visual.backend.user_settings import FEWEST_THREADS, require_threads, user_settings_kept
from visual.backend.user_settings import use as use

WITHOUT_LLVM, SPECTRAL_WITHOUT_LLVM = "scalar_rgb", "scalar_spectral"
"""Variants that need no libLLVM; their pictures have three channels, those of grey scenes too."""
SPECTRA = "blackbody", "regular", "irregular"
"""Plugins of spectra that Mitsuba evaluates at wavelengths only: variants without wavelengths raise an error.
Spectra written as `<spectrum value="400:0.1, ...">` and those of type d65 become colours where need be."""
_KINDS = "blackbody, regular or irregular"


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


def choose_variant(colour: bool, variant: str | None = None, spectral: bool = False) -> Variant:
    """The variant for a scene, without setting it.

    The processor renders. A CUDA device is taken only if the user names a variant for it, because the tests
    of every day run without one. Without a usable libLLVM the choice is `scalar_rgb`, which gives pictures
    without gradients.

    Args:
        colour: whether any material or light of the scene is not grey.
        variant: the user's own choice, which wins.
        spectral: whether the scene holds one of `SPECTRA`.

    Raises:
        InputError: Mitsuba does not have the user's variant, this machine cannot run it, or it cannot show
            the scene's spectra.
    """
    missing = ""
    try:
        llvm.prepare()
    except llvm.LLVMMissing as error:
        missing = str(error)
    if variant is not None:
        return _requested(variant, missing, spectral)
    if spectral:
        reason = f"a spectrum of type {_KINDS} takes wavelengths"
        return Variant(SPECTRAL_WITHOUT_LLVM if missing else "llvm_ad_spectral", reason)
    channels = "rgb" if colour else "mono"
    reason = "a material or a light has colour" if colour else "every material and light is grey"
    if missing:
        return Variant(WITHOUT_LLVM, f"pictures only, without gradients: {missing}")
    return Variant(f"llvm_ad_{channels}", reason)


def has_cuda() -> bool:
    """Whether Dr.Jit can compute on a CUDA device of this machine."""
    return bool(dr.has_backend(dr.JitBackend.CUDA))


def _requested(name: str, missing: str, spectral: bool) -> Variant:
    """The user's own choice, checked; `missing` says why libLLVM is missing, empty if there is one."""
    names = mi.variants()
    if name not in names:
        nearest = difflib.get_close_matches(name, names, n=1, cutoff=0.0)
        raise InputError(f"variant: {name!r} is not a variant of Mitsuba; the nearest is {nearest[0]!r}")
    if name.startswith("llvm_") and missing:
        raise InputError(f"variant: {name!r} cannot run here: {missing}")
    if name.startswith("cuda_") and not has_cuda():
        raise InputError(f"variant: {name!r} cannot run here: there is no usable CUDA device")
    if spectral and "spectral" not in name:
        raise InputError(f"variant: {name!r} shows no spectrum of type {_KINDS}; name no variant")
    return Variant(name, "asked for")


def load_mitsuba(colour: bool, variant: str | None = None, spectral: bool = False) -> ModuleType:
    """The module `mitsuba` with the variant of `choose_variant` set; arguments and errors are the same.

    From here on Mitsuba logs errors alone.
    """
    chosen = choose_variant(colour, variant, spectral)
    require_threads(dr)
    use(chosen.name)
    mi.set_log_level(mi.LogLevel.Error)
    return sys.modules["mitsuba"]


@contextmanager
def few_threads() -> Iterator[None]:
    """Give Dr.Jit `FEWEST_THREADS` threads in the block, for processes that share the cores of a machine."""
    before = dr.thread_count()
    with user_settings_kept:
        dr.set_thread_count(FEWEST_THREADS)
        try:
            yield
        finally:
            dr.set_thread_count(before)


@contextmanager
def spectra_refused() -> Iterator[None]:
    """Raise `InputError` where Mitsuba asks a spectrum for one number, which variants with wavelengths do."""
    try:
        yield
    except RuntimeError as error:
        if "eval_1()" not in str(error.__cause__ or error):
            raise
        reason = "a parameter that is one number, such as alpha or roughness, takes no spectrum"
        raise InputError(f"variant: {mi.variant()}: {reason}; write it as <float>") from error


def require_gradients(spectral: bool = False) -> None:
    """Raise `InputError` if the variant that `load_mitsuba` has set gives no gradients."""
    name = mi.variant()
    missing = without_gradients("None" if name is None else name, spectral)
    if missing:
        raise InputError(missing)


def without_gradients(name: str, spectral: bool = False) -> str | None:
    """Why pictures of a variant have no gradients, and the remedy, in one line; None if they have.

    Args:
        name: of the variant.
        spectral: whether the scene holds one of `SPECTRA`.
    """
    if is_differentiable(name):
        return None
    if spectral:
        reason = f"has no gradients of pictures, and a spectrum of type {_KINDS} takes such a variant"
        return f"variant: {name} {reason}; write the spectrum as <rgb>"
    try:
        llvm.prepare()
    except llvm.LLVMMissing as missing:
        return f"variant: {name} has no gradients of pictures: {missing}"
    return f"variant: {name} has no gradients of pictures; name no variant, or llvm_ad_mono"
