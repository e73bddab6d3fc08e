"""Checks of the machine: packages, libraries, cache and memory, with remedies."""

import importlib.metadata
import importlib.resources
import os
import platform
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from packaging.requirements import Requirement

from relief.ground.errors import InputError
from relief.ground.files import cache_folder
from relief.ground.progress import Progress, stage
from retouch.verbs.progress_display import followed
from tactile.sparse import has_pardiso
from visual.backend import llvm
from visual.backend.mitsuba import load
from visual.backend.variants import choose_variant, is_differentiable

OLDEST_PYTHON = (3, 11)
"""Oldest version of Python that Retouch runs on, as in its package metadata."""
MEMORY_GIB = 8.0
"""Recommended memory, GiB: assembling the finest finite elements takes this much, all else 1 GiB or less."""

WHERE = (
    "touch, pictures, descents and verification run on the processor only; a CUDA device is used by "
    "retouch train, and for pictures if -m names a cuda_ad_ variant"
)
"""What runs where, on every machine."""

INSTALL = "pip install --upgrade retouch, or in a checkout: make setup"
"""Remedy where packages are missing or of other versions."""


@dataclass(frozen=True)
class Finding:
    """The result of one check.

    Attributes:
        name: of the thing that was checked.
        ok: whether the thing is as it should be.
        detail: its version, place or fault.
        remedy: what the user can do if it is not ok.
        needed: whether an optimisation cannot run without it.
    """

    name: str
    ok: bool
    detail: str
    remedy: str = ""
    needed: bool = True


@dataclass(frozen=True)
class Diagnosis:
    """What was found on this machine.

    Attributes:
        findings: one for each check.
    """

    findings: tuple[Finding, ...]

    @property
    def ready(self) -> bool:
        """Whether everything that an optimisation needs is there."""
        return all(finding.ok for finding in self.findings if finding.needed)

    def as_json(self) -> dict[str, Any]:
        """What `retouch doctor --json` prints."""
        return {"ready": self.ready, "findings": [asdict(finding) for finding in self.findings]}


def doctor(*, quiet: bool | None = None, progress: Callable[[Progress], None] | None = None) -> Diagnosis:
    """Check everything that an optimisation uses on this machine; a fault is a finding, not an exception.

    Args:
        quiet, progress: as in `optimize`.
    """
    checks = (_python, _packages, _llvm, _variants, _pardiso, _weights, _cache, _machine)
    findings = []
    with followed(progress, quiet), stage("checking this machine", len(checks)) as advance:
        for check in checks:
            findings.append(check())
            advance()
    return Diagnosis(tuple(findings))


def _python() -> Finding:
    remedy = f"install Python {'.'.join(map(str, OLDEST_PYTHON))} or newer"
    return Finding("Python", sys.version_info >= OLDEST_PYTHON, platform.python_version(), remedy)


def _packages() -> Finding:
    """Installed versions of the packages in Retouch's metadata, compared with the supported versions."""
    try:
        texts = importlib.metadata.requires("retouch") or []
    except importlib.metadata.PackageNotFoundError:
        return Finding("packages", False, "retouch itself is not installed", INSTALL)
    present, wrong = [], []
    for requirement in map(Requirement, texts):
        if requirement.marker and not requirement.marker.evaluate({"extra": ""}):
            continue
        try:
            version = importlib.metadata.version(requirement.name)
        except importlib.metadata.PackageNotFoundError:
            wrong.append(f"{requirement.name} is missing")
            continue
        present.append(f"{requirement.name} {version}")
        if not requirement.specifier.contains(version, prereleases=True):
            wrong.append(f"{requirement.name} {version} is not supported ({requirement.specifier})")
    return Finding("packages", not wrong, "; ".join(wrong) or ", ".join(present), INSTALL)


def _llvm() -> Finding:
    """The library in use, and every other on the machine with the reason why it is refused."""
    requested = os.environ.get(llvm.VARIABLE)
    verdicts = [llvm.judge_requested(requested)] if requested else []
    verdicts += [llvm.judge(library) for library in llvm.candidates()]
    try:
        works, lines = True, [f"{llvm.prepare()} is used"]
    except llvm.LLVMMissing:
        works, lines = False, ["none works with Dr.Jit"]
    lines += [f"{verdict.library.path} refused: {verdict.fault}" for verdict in verdicts if verdict.fault]
    # The requested library is often among the candidates too.
    detail = "\n".join(dict.fromkeys(lines))
    return Finding("libLLVM", works, detail, llvm.REMEDY)


def _variants() -> Finding:
    """The Mitsuba variants that run here."""
    try:
        mitsuba = load("mitsuba")
    except InputError as error:
        return Finding("Mitsuba", False, str(error), INSTALL)
    usable = [name for name in mitsuba.variants() if _runs(name)]
    detail = f"{mitsuba.__version__}: {', '.join(usable)}"
    remedy = f"no gradients of pictures without libLLVM; {llvm.REMEDY}"
    return Finding("Mitsuba", any(map(is_differentiable, usable)), detail, remedy)


def _runs(variant: str) -> bool:
    try:
        choose_variant(colour=False, variant=variant)
    except InputError:
        return False
    return True


def _pardiso() -> Finding:
    detail = "installed" if has_pardiso() else "absent: sparse systems are solved by SuperLU, more slowly"
    return Finding("Pardiso", has_pardiso(), detail, "pip install pypardiso (x86-64 only)", needed=False)


def _weights() -> Finding:
    folder = Path(str(importlib.resources.files("surrogate"))) / "weights"
    nets = sorted(path.stem for path in folder.glob("*.safetensors"))
    detail = ", ".join(nets) or "none: the nets are not installed"
    return Finding("weights", bool(nets), detail, 'use model = "layer" and model = "exact"', needed=False)


def _cache() -> Finding:
    """The folder of cached operators, which is created when the first is written."""
    folder = cache_folder()
    existing = next(path for path in (folder, *folder.absolute().parents) if path.exists())
    writable = existing.is_dir() and os.access(existing, os.W_OK | os.X_OK)
    size = sum(path.stat().st_size for path in folder.rglob("*") if path.is_file())
    state = "writable" if writable else "not writable: operators are computed anew in every process"
    detail = f"{folder}, {size / 2**20:.1f} MiB, {state}"
    return Finding("cache", writable, detail, "set RETOUCH_CACHE to a folder you may write", needed=False)


def _machine() -> Finding:
    memory = os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE") / 2**30
    system = f"{platform.system()} on {platform.machine()}"
    detail = f"{os.cpu_count()} cores, {memory:.1f} GiB of memory, {system}\n{WHERE}"
    remedy = f"the finest finite elements take {MEMORY_GIB:.0f} GiB at their peak, everything else 1 GiB"
    return Finding("machine", memory >= MEMORY_GIB, detail, remedy, needed=False)
