"""Studies, sets and colourings of parts that are killed or meet a full disk: cases of `interruptions`.

A case has a folder of its own with everything that its command reads. After a kill every file that the
command has written is read, and the same command is repeated at once, as a user would.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
import tomllib
import zipfile
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import OpenEXR
import psutil
from numpy.typing import NDArray
from PIL import Image

from benchmarks.shared.common import ROOT, table
from relief.heightmap import load_heights, save_heights_exr
from relief.solids.export.plate_export import export_plate
from relief.solids.files.mesh import READERS, read_mesh

Array = NDArray[np.float64]

OUT = "out"
"""Folder that a command writes, in that of its case."""
SAME_MM = 1e-5
"""Largest distance, mm, of heights and vertices that count as those of the uninterrupted command."""
INTERRUPTED = 130
"""Exit status of a command that SIGTERM has ended."""
LONGEST_S = 600.0
"""Seconds after which a command counts as hanging."""
WORKERS_S = 30.0
"""Seconds within which workers have to follow the command that started them."""
SMALL = {"define.resolution": 32, "descent.steps": 2, "verify.model": "layer", "verify.samples": 4}
"""Settings of the runs."""
STUDY = """title = "Small"
base = "gravel.toml"
[set]
texture = "waves.exr"
verify.baseline = false
{settings}
[[tables]]
name = "feel"
[tables.axes]
"touch.jnd" = [-1, 1]
"""


@dataclass(frozen=True)
class Command:
    """A command whose folder is interrupted.

    Attributes:
        name: of its cases.
        arguments: as on a command line, in the folder of the case.
        results: patterns of the reliefs and meshes that it writes.
        kills, changed, full_disks: numbers of cases: kills, kills after which the texture is another one, and
            disks that are full.
    """

    name: str
    arguments: tuple[str, ...]
    results: tuple[str, ...]
    kills: int
    changed: int = 0
    full_disks: int = 0

    def started(self, place: Path) -> psutil.Popen:
        """The command in a process of its own."""
        command = [sys.executable, "-m", "retouch", *self.arguments]
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        streams = {"stdout": subprocess.DEVNULL, "stderr": subprocess.PIPE}
        return psutil.Popen(command, cwd=place, env=environment, text=True, **streams)


COMMANDS = (
    Command(
        "study",
        ("study", "study.toml", "-o", OUT, "--workers", "1", "-q"),
        ("rows/*/heights.exr",),
        kills=20,
        changed=6,
        full_disks=8,
    ),
    Command(
        "set",
        (
            *("stimuli", "waves.exr", "-o", OUT, "--jnd", "-1,1", "--plate-mm", "10", "--workers", "1", "-q"),
            *(part for key, value in SMALL.items() for part in ("--set", f"{key}={value}")),
        ),
        ("rows/*/heights.exr", "print/*.3mf"),
        kills=20,
        changed=6,
    ),
    Command("colouring", ("evaluate", "part.stl", "-o", OUT), ("*.glb",), kills=12),
)
"""The commands; workers are as many as processors that a command may take."""


@dataclass(frozen=True)
class Whole:
    """What a command writes that nobody interrupts.

    Attributes:
        seconds: that it takes.
        results: heights or vertices, mm, by the names of their files.
        files: names of all files.
        bytes: that these take on a disk.
    """

    seconds: float
    results: Mapping[str, Array]
    files: frozenset[str]
    bytes: int


def prepare(place: Path, texture: Array) -> None:
    """Write what the commands read, with heights (rows, cols) in mm."""
    settings = "\n".join(f"{key} = {json.dumps(value)}" for key, value in SMALL.items())
    (place / "study.toml").write_text(STUDY.format(settings=settings))
    save_heights_exr(place / "waves.exr", texture, 10.0)
    export_plate(place / "part.stl", texture[::2, ::2], 20.0)


def uninterrupted(command: Command, folder: Path, texture: Array, page: int) -> Whole:
    """A command from its beginning to its end; `page` is the unit of sizes on a disk, bytes."""
    with TemporaryDirectory(dir=folder) as temporary:
        place = Path(temporary)
        prepare(place, texture)
        began, process = time.perf_counter(), command.started(place)
        _, messages = process.communicate(timeout=LONGEST_S)
        if process.returncode:
            raise RuntimeError(f"{command.name}: {messages}")
        seconds, files = time.perf_counter() - began, list(_files(place / OUT))
        size = sum(-(-path.stat().st_size // page) * page for path in files)
        names = frozenset(path.relative_to(place).as_posix() for path in files)
        return Whole(seconds, _results(command, place), names, size)


def after_a_kill(
    command: Command,
    folder: Path,
    share: float,
    textures: tuple[Array, Array],
    wholes: tuple[Whole, Whole],
    politely: bool,
) -> dict[str, Any]:
    """A command killed after a share of its life, and what the same command makes of its folder.

    Args:
        command: the command.
        folder: for the folder of the case.
        share: of the seconds of the uninterrupted command.
        textures: (rows, cols) heights before and after the kill, mm.
        wholes: of the uninterrupted command with either texture.
        politely: SIGTERM in place of SIGKILL.
    """
    with TemporaryDirectory(dir=folder) as temporary:
        place = Path(temporary)
        prepare(place, textures[0])
        process = command.started(place)
        time.sleep(share * wholes[0].seconds)
        workers = list[psutil.Process]()
        with suppress(psutil.NoSuchProcess):
            workers = process.children(recursive=True)
            process.send_signal(signal.SIGTERM if politely else signal.SIGKILL)
        _, messages = process.communicate(timeout=LONGEST_S)
        row = {"share": share, "signal": "SIGTERM" if politely else "SIGKILL", "status": process.returncode}
        damaged, written = sorted(_damaged(place)), len(list(_files(place / OUT)))
        save_heights_exr(place / "waves.exr", textures[1], 10.0)
        row |= _repeated(command, place, wholes[1])
        _, left = psutil.wait_procs(workers, WORKERS_S)
        as_promised = process.returncode in (0, INTERRUPTED if politely else -signal.SIGKILL)
        lines = [line for line in messages.splitlines() if line.startswith(("retouch:", "Traceback"))]
        as_promised = as_promised and len(lines) == (process.returncode == INTERRUPTED)
        ended = {"as_promised": as_promised, "damaged": damaged, "workers_left": len(left)}
        return row | ended | ({} if as_promised else {"written": written, "told": messages.strip()})


def after_a_full_disk(
    command: Command, folder: Path, size: int, whole: Whole, texture: Array
) -> dict[str, Any]:
    """A command on a disk of so many bytes, and what the same command makes of its folder on a larger one."""
    with TemporaryDirectory(dir=folder) as temporary, ExitStack() as stack:
        place = Path(temporary)
        prepare(place, texture)
        (place / OUT).mkdir()
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", place / OUT], check=True)
        stack.callback(subprocess.run, ("umount", str(place / OUT)), check=True)
        process = command.started(place)
        _, messages = process.communicate(timeout=LONGEST_S)
        lines = messages.strip().splitlines()
        as_promised = process.returncode == 2 and "No space left on device" in lines[-1]
        row = {"bytes": size, "status": process.returncode, "told": lines, "as_promised": as_promised}
        row |= {"damaged": sorted(_damaged(place)), "workers_left": 0}
        subprocess.run(["mount", "-o", "remount,size=1g", place / OUT], check=True)
        return row | _repeated(command, place, whole)


def _repeated(command: Command, place: Path, whole: Whole) -> dict[str, Any]:
    """What the same command ends with, and the distance of its results from those wanted, mm."""
    process = command.started(place)
    _, messages = process.communicate(timeout=LONGEST_S)
    if process.returncode:
        return {"completed": False, "same": False, "distance_mm": None, "last": messages.strip()}
    results = _results(command, place)
    missing = sorted(whole.files - {path.relative_to(place).as_posix() for path in _files(place / OUT)})
    partial = sorted(path.name for path in (place / OUT).rglob("*.partial*"))
    distance = max(
        float(np.abs(results[name] - values).max()) if name in results else np.inf
        for name, values in whole.results.items()
    )
    same = distance <= SAME_MM and not missing and not partial
    row = {"completed": True, "same": same, "distance_mm": distance}
    return row if same else row | {"missing": missing, "partial": partial}


def _results(command: Command, place: Path) -> dict[str, Array]:
    """Heights or vertices, mm, by the names of the files."""
    paths = [path for pattern in command.results for path in (place / OUT).glob(pattern)]
    return {
        path.relative_to(place).as_posix(): read_mesh(path).body.vertices
        if path.suffix in READERS
        else load_heights(path)
        for path in paths
    }


def _files(folder: Path) -> Iterator[Path]:
    return (path for path in folder.rglob("*") if path.is_file())


def _read_picture(path: Path) -> None:
    with Image.open(path) as picture:
        picture.load()


def _read_zip(path: Path) -> None:
    with zipfile.ZipFile(path) as content:
        assert content.testzip() is None


def _read_lines(path: Path) -> None:
    assert path.read_text().endswith("\n")


def _read_page(path: Path) -> None:
    assert path.read_text().rstrip().endswith("</html>")


READ: Mapping[str, Callable[[Path], object]] = {
    ".csv": _read_lines,
    ".exr": lambda path: OpenEXR.File(str(path)),
    ".glb": read_mesh,
    ".html": _read_page,
    ".json": lambda path: json.loads(path.read_bytes()),
    ".png": _read_picture,
    ".stl": read_mesh,
    ".toml": lambda path: tomllib.loads(path.read_text()),
    ".3mf": _read_zip,
}
"""Readers by suffix; each raises an error for a file that is half-written."""


def _damaged(place: Path) -> Iterator[str]:
    """Names of files that do not read, but for those whose names say that they are not whole."""
    for path in _files(place / OUT):
        name = path.relative_to(place).as_posix()
        if path.suffix not in READ or ".partial" in name:
            continue
        try:
            READ[path.suffix](path)
        except Exception:  # whatever a reader raises of a damaged file
            yield name


def summary(rows: Mapping[str, Mapping[str, Any]]) -> str:
    """The table: one row for each command and kind of case."""
    lines = []
    for command in COMMANDS:
        for kind in ("SIGKILL", "SIGTERM", "another texture", "full disk"):
            cases = [row for name, row in rows.items() if name.startswith(f"{command.name}, {kind}")]
            if not cases:
                continue
            distances = [row["distance_mm"] for row in cases if row["distance_mm"] is not None]
            lines.append(
                [
                    f"{command.name}, {kind}",
                    len(cases),
                    sum(row["as_promised"] for row in cases),
                    sum(len(row["damaged"]) for row in cases),
                    sum(row["workers_left"] for row in cases),
                    sum(row["completed"] for row in cases),
                    sum(row["same"] for row in cases),
                    max(distances, default=None),
                ]
            )
    head = ("cases", "number", "status as promised", "half-written files", "workers left")
    return table((*head, "completed", "same results", "farthest, mm"), lines)
