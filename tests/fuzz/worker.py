"""Worker of the fuzzing: a process that runs one case after the other, so that imports are paid once.

A case that ends or blocks the process is known by its parent, which starts another.
"""

from __future__ import annotations

import contextlib
import os
import resource
import shutil
import sys
import tempfile
import time
import traceback
from collections.abc import Iterator
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path

from tests.fuzz.case import Case

SECONDS = 5.0
"""Most seconds of processor time that a case may take."""
MOST_BYTES = 2 << 30
"""Most memory that the process may take for a case, bytes."""
WORK = 4096 * 16
"""Most samples of all pictures of a case; a scene that asks for more is sound, and explained instead."""
LONGEST_LINE = 4000
"""Most characters of a refusal."""
ENDED = (0, 1, 3)
"""Exit statuses of a command that was not refused: 1 is a study with rows that cannot be computed, where the
command tells no traceback; 3 is a run that ended short of its target."""


@dataclass(frozen=True)
class Outcome:
    """What became of a case.

    Attributes:
        verdict: "accepted", "refused" or "failed".
        told: The refusal, or what failed, with the place in the code in its first line.
        seconds: Processor time.
        mib: Largest memory of the process, MiB.
    """

    verdict: str
    told: str
    seconds: float
    mib: float


def serve(connection: Connection, root: str) -> None:
    """Run the cases that come in, until the connection ends.

    Args:
        connection: Gives cases and takes outcomes; gives True or False and takes the sound inputs, where
            True asks to get ready for whole trainings.
        root: Folder for the files of the cases.
    """
    os.environ.setdefault("RETOUCH_CACHE", str(Path(root, "retouch-cache")))
    import torch

    torch.set_num_threads(1)
    from visual.backend import llvm

    with contextlib.suppress(llvm.LLVMMissing):
        llvm.prepare()
    # Refused allocations are errors of one case; without a bound they would end other processes.
    resource.setrlimit(resource.RLIMIT_DATA, (2 * MOST_BYTES, resource.RLIM_INFINITY))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    quiet = open(os.devnull, "w")  # noqa: SIM115  # lasts as long as the process
    os.dup2(quiet.fileno(), 1)
    os.dup2(quiet.fileno(), 2)
    with contextlib.suppress(EOFError):
        while True:
            job = connection.recv()
            if isinstance(job, Case):
                connection.send(_run(job, Path(root, "case")))
            else:
                connection.send(_bases(Path(root, "bases"), learning=job))


def _bases(folder: Path, learning: bool) -> dict[str, dict[str, bytes]] | str:
    from tests.fuzz import bases

    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    try:
        return bases.make(folder, learning)
    except Exception:
        return traceback.format_exc()


def _run(case: Case, folder: Path) -> Outcome:
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    for name, content in case.files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(content)
    # What a command leaves in the folder of temporary files is then seen, too.
    tempfile.tempdir = str(folder)
    os.chdir(folder)
    _forget_peak()
    began = time.process_time()
    try:
        verdict, told = (_command if case.command else _reader)(case, folder)
    except AssertionError as error:
        verdict, told = "failed", f"{error}\n{traceback.format_exc()}"
    except Exception as error:
        place = traceback.extract_tb(error.__traceback__)[-1]
        line = f"{type(error).__name__} in {Path(place.filename).name}:{place.lineno}"
        verdict, told = "failed", f"{line}\n{traceback.format_exc()}"
    seconds, mib = time.process_time() - began, _peak_mib()
    os.chdir(folder.parent)
    tempfile.tempdir = None
    if verdict != "failed" and seconds > SECONDS:
        verdict, told = "failed", f"takes more than {SECONDS:g} s\n{seconds:.1f} s; {told}"
    if verdict != "failed" and mib > MOST_BYTES / 2**20:
        verdict, told = "failed", f"takes more than {MOST_BYTES >> 20} MiB\n{mib:.0f} MiB; {told}"
    return Outcome(verdict, told[:LONGEST_LINE], seconds, mib)


def _reader(case: Case, folder: Path) -> tuple[str, str]:
    from relief.ground.errors import InputError
    from tests.fuzz.readers import READERS

    before = _names(folder)
    try:
        READERS[case.kind](folder, case.arguments)
        verdict, told = "accepted", ""
    except InputError as error:
        verdict, told = "refused", str(error)
        assert "\n" not in told, "the refusal has several lines"
        assert len(told) < LONGEST_LINE, "the refusal is too long"
    # A cache that was missing or damaged is written anew.
    left = {name for name in _names(folder) - before if case.kind != "caches" or name.endswith(".partial")}
    assert not left, f"left: {sorted(left)[0]}"
    return verdict, told


def _command(case: Case, folder: Path) -> tuple[str, str]:
    from retouch.commands.main import main
    from tests.fuzz.readers import check_results

    command = [*case.command]
    if command[0] == "render" and "--explain" not in command and _work(folder) > WORK:
        command.append("--explain")
    before = _names(folder)
    with tempfile.TemporaryDirectory(dir=folder.parent) as streams:
        out, err = Path(streams, "out"), Path(streams, "err")
        with _into(1, out), _into(2, err):
            try:
                status = main(command)
            finally:
                sys.stdout.flush()
                sys.stderr.flush()
        printed, told = (path.read_text(encoding="utf-8", errors="replace") for path in (out, err))
    if status == 2:
        lines = told.splitlines()
        assert lines and lines[-1].startswith("retouch: "), "the refusal is not told"
        assert sum(line.startswith("retouch: ") for line in lines) == 1, "the refusal has several lines"
        left = {name for name in _names(folder) - before if not _belongs(name, case)}
        assert not left, f"left after a refusal: {sorted(left)[0]}"
        return "refused", lines[-1]
    if status == 1 and "the traceback is in " in told:
        log = next(folder.glob("retouch-error-*.txt")).read_text(encoding="utf-8")
        raise AssertionError(f"{_last_place(log)}\n{told}\n{log}")
    assert status in ENDED, f"status {status}\n{told}"
    check_results(folder, printed)
    return "accepted", told


def _last_place(log: str) -> str:
    """The last line of a traceback, and the place in the code before it."""
    lines = log.strip().splitlines()
    place = next((line.strip() for line in reversed(lines) if line.strip().startswith("File ")), "")
    name, _, rest = place.partition('", line ')
    return f"{lines[-1].partition(':')[0]} in {Path(name).name}:{rest.partition(',')[0]}"


def _belongs(name: str, case: Case) -> bool:
    """Whether a file may be there after a refusal: a run that had begun keeps what is needed to go on."""
    return case.command[0] in ("resume", "train") and not name.endswith(".partial")


def _work(folder: Path) -> int:
    """Samples of all pictures of the scene in a folder; 0 if the scene is refused."""
    from relief.ground.errors import InputError
    from visual.needs import needs_of
    from visual.scene_file.check import check_scene
    from visual.scene_file.describe import describe

    try:
        description = describe(check_scene(folder / "scene.xml"))
    except InputError:
        return 0
    needs = needs_of(description)
    camera = description.cameras[needs.cameras[0]]
    return camera.rows * camera.cols * max(4, camera.samples) * needs.passes * max(1, needs.max_depth or 16)


@contextlib.contextmanager
def _into(number: int, path: Path) -> Iterator[None]:
    """Write what goes to a file descriptor into a file."""
    kept = os.dup(number)
    try:
        with path.open("wb") as file:
            os.dup2(file.fileno(), number)
        yield
    finally:
        os.dup2(kept, number)
        os.close(kept)


def _names(folder: Path) -> set[str]:
    return {str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file()}


def _forget_peak() -> None:
    """Begin the measurement of the largest memory anew, where the system allows that."""
    with contextlib.suppress(OSError):
        Path("/proc/self/clear_refs").write_text("5")


def _peak_mib() -> float:
    with contextlib.suppress(OSError, StopIteration, ValueError):
        lines = Path("/proc/self/status").read_text().splitlines()
        return int(next(line for line in lines if line.startswith("VmHWM:")).split()[1]) / 1024
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
