"""Choice of the libLLVM with which Dr.Jit compiles kernels.

Dr.Jit loads whichever libLLVM the loader finds first, and some versions abort the whole process at the first
kernel. Candidates not judged by version are probed once, in a process of their own; verdicts are kept on
disk, and the newest usable library is named in the environment before Dr.Jit is imported.
"""

import contextlib
import functools
import hashlib
import importlib.metadata
import json
import logging
import os
import platform
import signal
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

from relief.ground.files import cache_folder, write_atomically
from visual.backend.llvm_candidates import Library, candidates, find

VARIABLE = "DRJIT_LIBLLVM_PATH"
"""The environment variable from which Dr.Jit takes the path of libLLVM."""

REMEDY = "Debian and Ubuntu: apt install libllvm19 libatomic1; macOS: brew install llvm"
"""Advice to a person whose machine has no usable libLLVM, or lacks a library that Dr.Jit itself loads."""

OLDEST_MAJOR = 15
"""Oldest major version: Dr.Jit 1.5 needs opaque pointers, which LLVM has from 15 on."""

ABORTING_MAJORS = frozenset({15, 16})
"""Major versions that abort the process: they cannot select fminimum and fmaximum (Dr.Jit 1.5, AVX-512)."""

DOES_NOT_LOAD = 3
"""Exit status of a probe that cannot import Dr.Jit, whose last line says why."""

PROBE_SECONDS = 60.0
"""Longest time of a probe, s; it takes about 0.3 s on an idle machine."""

# HOME is replaced so that a kernel compiled by another libLLVM is not taken from Dr.Jit's own cache.
_PROBE = """
import os, resource, sys
resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
os.environ["HOME"] = sys.argv[1]
try:
    import drjit as dr
except (ImportError, NameError) as error:
    print(f"Dr.Jit does not load: {error.__context__ or error}", file=sys.stderr)
    sys.exit(3)
from drjit.llvm.ad import Float, UInt32
x = dr.arange(Float, 8) / 8
y = dr.minimum(x, 0.5) + dr.maximum(x, 0.25)
_, y = dr.while_loop((UInt32(0), y), lambda i, y: i < 3, lambda i, y: (i + 1, dr.minimum(1.5 * y, 2)))
expected = [min(3.375 * (min(k / 8, 0.5) + max(k / 8, 0.25)), 2) for k in range(8)]
sys.exit("wrong numbers" if any(abs(a - b) > 1e-5 for a, b in zip(y, expected)) else 0)
"""

_log = logging.getLogger(__name__)


class LLVMMissing(RuntimeError):
    """No libLLVM here works with Dr.Jit; the message is one line that says what to install."""


class _Undecided(Exception):
    """A probe without a lasting verdict on the library, for example on a busy machine."""


@dataclass(frozen=True)
class Verdict:
    """Whether Dr.Jit runs kernels with a library.

    Attributes:
        library: the candidate.
        fault: why Dr.Jit does not, in one line; empty if it does.
    """

    library: Library
    fault: str

    @property
    def usable(self) -> bool:
        """Whether Dr.Jit runs kernels with the library."""
        return not self.fault


def _known_fault(library: Library) -> str:
    """Why a version is refused without a probe, in one line; empty if it is not known to be bad."""
    if not library.version:
        return ""
    major = library.version[0]
    if major < OLDEST_MAJOR:
        return f"LLVM {major} is older than {OLDEST_MAJOR}, which Dr.Jit requires"
    if major in ABORTING_MAJORS:
        return f"LLVM {major} aborts the process at the first kernel of Dr.Jit"
    return ""


def _probe(library: Library) -> str:
    """Compile and run a kernel in a process of its own.

    Returns:
        The fault, in one line; empty if the library works.

    Raises:
        _Undecided: the probe takes longer than `PROBE_SECONDS`, is killed from outside, or cannot import
            Dr.Jit, as where a library of the system is missing.
    """
    try:
        with tempfile.TemporaryDirectory() as home:
            process = subprocess.run(
                [sys.executable, "-P", "-c", _PROBE, home],
                env=os.environ | {VARIABLE: str(library.path)},
                capture_output=True,
                text=True,
                errors="replace",
                timeout=PROBE_SECONDS,
                check=False,
            )
    except subprocess.TimeoutExpired as expired:
        raise _Undecided(f"its probe took longer than {PROBE_SECONDS:.0f} s") from expired
    if process.returncode == 0:
        return ""
    if -process.returncode in (signal.SIGKILL, signal.SIGTERM, signal.SIGINT):
        raise _Undecided("its probe was killed")
    lines = process.stderr.strip().splitlines() or ["no message"]
    if process.returncode == DOES_NOT_LOAD:
        raise _Undecided(lines[-1])
    # An abort says why in its first line; a Python traceback in its last.
    line = lines[0] if process.returncode < 0 else lines[-1]
    return f"its probe ended with status {process.returncode}: {line[:160]}"


@functools.cache
def _processor() -> str:
    """Short name of this processor and its instruction sets, for home folders that several machines share."""
    fields = {"model name", "flags", "Features", "CPU implementer", "CPU part"}
    lines = [platform.machine()]
    with contextlib.suppress(OSError), open("/proc/cpuinfo", encoding="utf-8") as info:
        for line in info:
            if not line.strip():
                break
            if line.partition(":")[0].strip() in fields:
                lines.append(line.strip())
    return hashlib.sha256("\n".join(lines).encode()).hexdigest()[:16]


def _key(library: Library) -> str:
    """Key of a verdict, which changes whenever the result of a probe may change."""
    stat = library.path.stat()
    drjit = importlib.metadata.version("drjit")
    return "|".join((str(library.path), str(stat.st_size), str(stat.st_mtime_ns), drjit, _processor()))


def _remembered(memory: Path) -> dict[str, str]:
    """Faults by key, empty for a usable library; no entries from a file that is missing or damaged."""
    try:
        content = json.loads(memory.read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return {}
    if not isinstance(content, dict):
        return {}
    return {key: fault for key, fault in content.items() if isinstance(fault, str)}


def _remember(memory: Path, key: str, fault: str) -> None:
    """Add one answer; a cache folder that cannot be written only costs the next process a probe."""
    with contextlib.suppress(OSError):
        write_atomically(memory, json.dumps(_remembered(memory) | {key: fault}, indent=1).encode())


def judge(library: Library) -> Verdict:
    """The verdict on a library: by its version, from disk, or by a probe."""
    if fault := _known_fault(library):
        return Verdict(library, fault)
    memory = cache_folder() / "llvm.json"
    key = _key(library)
    remembered = _remembered(memory).get(key)
    if remembered is not None:
        return Verdict(library, remembered)
    try:
        fault = _probe(library)
    except _Undecided as undecided:
        return Verdict(library, str(undecided))
    _remember(memory, key, fault)
    return Verdict(library, fault)


def judge_requested(name: str) -> Verdict:
    """The verdict on a value of `VARIABLE`: a path, or the bare name of a library that the loader knows."""
    library = find(name)
    if not library.path.is_file():
        return Verdict(library, "there is no such file")
    return judge(library)


@functools.cache
def _choose(requested: str | None) -> Path:
    """Path of the requested library if usable, else of the newest usable one."""
    if requested:
        verdict = judge_requested(requested)
        if verdict.usable:
            return verdict.library.path
        _log.warning("%s: %s is not used: %s", VARIABLE, requested, verdict.fault)
    for library in candidates():
        if judge(library).usable:
            _log.info("%s: this libLLVM compiles for Dr.Jit", library.path)
            return library.path
    raise LLVMMissing(f"no libLLVM on this machine works with Dr.Jit ({REMEDY})")


def prepare() -> Path:
    """Choose libLLVM and name it in the environment; call before anything imports Dr.Jit or Mitsuba.

    A library the user names in DRJIT_LIBLLVM_PATH wins if it works; if not, one line is logged and the
    newest usable library is taken.

    Returns:
        Path of the library.

    Raises:
        LLVMMissing: this machine has no usable library.
    """
    path = _choose(os.environ.get(VARIABLE))
    os.environ[VARIABLE] = str(path)
    return path


def main() -> int:
    """Print the chosen path; status 1 and one line on stderr if no library fits."""
    try:
        print(prepare())
    except LLVMMissing as missing:
        print(missing, file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
