"""Python in processes of their own: what they print, seconds and memory."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from benchmarks.shared.common import ROOT


@dataclass(frozen=True)
class Ended:
    """A process that has ended.

    Attributes:
        status: exit status; negative: the number of the signal that ended it.
        out, err: what it printed.
        wall_s, cpu_s: seconds.
        peak_gb: most memory, GB.
    """

    status: int
    out: str
    err: str
    wall_s: float
    cpu_s: float
    peak_gb: float


def process(
    arguments: Sequence[str],
    statuses: Sequence[int] | None = None,
    most: tuple[int, int] | None = None,
    folder: Path = ROOT,
) -> Ended:
    """Run Python with these arguments and the code of this checkout.

    Args:
        arguments: of Python.
        statuses: exit statuses that are expected; None: every one.
        most: CPU seconds after which it is ended, and the memory that it can have, GB.
        folder: in which it runs.

    Raises:
        RuntimeError: the exit status is another.
    """
    began = time.perf_counter()
    limit = None if most is None else partial(_limit, *most)
    with tempfile.TemporaryFile("w+") as out, tempfile.TemporaryFile("w+") as err:
        given: dict[str, Any] = {"cwd": folder, "env": os.environ | {"PYTHONPATH": str(ROOT)}}
        command = [sys.executable, *arguments]
        child = subprocess.Popen(command, stdout=out, stderr=err, preexec_fn=limit, **given)
        _, code, usage = os.wait4(child.pid, 0)
        wall_s, status = time.perf_counter() - began, os.waitstatus_to_exitcode(code)
        child.returncode = status
        out.seek(0)
        err.seek(0)
        spent = wall_s, usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1e6
        ended = Ended(status, out.read(), err.read(), *spent)
    if statuses is not None and status not in statuses:
        raise RuntimeError(f"{' '.join(arguments)}: exit status {status}\n{ended.err}")
    return ended


def _limit(most_cpu_s: int, most_gb: int) -> None:
    """Limit the CPU time and the memory of the process."""
    resource.setrlimit(resource.RLIMIT_CPU, (most_cpu_s, most_cpu_s))
    resource.setrlimit(resource.RLIMIT_DATA, (most_gb * 10**9, most_gb * 10**9))
