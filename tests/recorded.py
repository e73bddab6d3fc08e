"""Truths that take long to compute, recorded once in `tests/truths/` and read by the tests.

A truth comes from code other than the tested one: Mitsuba's renders, finite differences of them, finer
finite elements. Its file has the value, its standard error, a digest of what was computed (the scene, its
heights, the settings), and the versions of Mitsuba and Dr.Jit that computed it. A truth of another digest or
of other versions is missing, and its test fails. `make truths` computes every truth anew. A new value that
agrees with the recorded one leaves it; one that differs by more than their standard errors is refused without
a reason, which is then written into the file.
"""

import hashlib
import json
import re
from collections.abc import Callable
from dataclasses import dataclass
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from PIL import Image

from relief.ground.arrays import Array

if TYPE_CHECKING:
    from visual.scene import Scene

FOLDER = Path(__file__).parent / "truths"
LIBRARIES = ("mitsuba", "drjit")
"""Libraries whose versions a truth depends on."""
RESOLUTION = 1e-6
"""Difference of two numbers of an array below which they have one digest: arithmetic differs by machine."""
SOLVERS_ERROR = 1e-6
"""Relative error of a solution of finite elements by sparse factors and of the contact upon it."""
NUMBER = re.compile(r"[-+]?\d*\.?\d+(?:[eE][-+]?\d+)?")


@dataclass(frozen=True)
class Truth:
    """A value that is known within an error.

    Attributes:
        mean: the value; any shape.
        standard_error: of each number of `mean`; the same shape.
    """

    mean: Array
    standard_error: Array

    @property
    def relative_error(self) -> float:
        """Norm of the standard error over that of the value."""
        return float(np.linalg.norm(self.standard_error) / np.linalg.norm(self.mean))

    def error(self, other: Array) -> float:
        """Distance of another value from this one, relative to the size of this one."""
        return float(np.linalg.norm(other - self.mean) / np.linalg.norm(self.mean))

    def agrees(self, other: "Truth") -> bool:
        """Whether two truths differ by no more than their standard errors together."""
        allowed = np.linalg.norm([self.standard_error, other.standard_error])
        return self.mean.shape == other.mean.shape and bool(
            np.linalg.norm(other.mean - self.mean) <= allowed + RESOLUTION * np.linalg.norm(self.mean)
        )


def over_seeds(values: Any) -> Truth:
    """The mean over the first axis, one value for each seed, and its standard error."""
    values = np.asarray(values, dtype=np.float64)
    return Truth(values.mean(0), values.std(0, ddof=1) / np.sqrt(len(values)))


def solved(values: Any) -> Truth:
    """A value without noise, known as well as its equations are solved."""
    values = np.asarray(values, dtype=np.float64)
    return Truth(values, SOLVERS_ERROR * np.abs(values).max() * np.ones_like(values))


def files_of(scene: "Scene") -> dict[str, Any]:
    """What a digest needs of a scene: all files in the folder of its file, and its variant."""
    return {path.name: _content(path) for path in sorted(scene.file.parent.iterdir()) if path.is_file()} | {
        "variant": scene.variant,
        "heights": np.asarray(scene.heights),
    }


def _content(path: Path) -> Any:
    match path.suffix:
        case ".npy":
            return np.load(path)
        case ".png":
            return np.asarray(Image.open(path), dtype=np.float64)
        case ".exr":
            import OpenEXR

            with OpenEXR.File(str(path)) as file:
                return [np.asarray(channel.pixels) for channel in file.channels().values()]
        case _:
            return path.read_text(encoding="utf-8")


def digest(value: Any) -> str:
    """A digest of numbers, arrays, texts, and lists and dictionaries of them, the same on every machine."""
    return hashlib.sha256(_canonical(value)).hexdigest()


def _canonical(value: Any) -> bytes:
    match value:
        case dict():
            return b"{" + b",".join(_canonical([key, value[key]]) for key in sorted(value)) + b"}"
        case list() | tuple():
            return b"[" + b",".join(map(_canonical, value)) + b"]"
        case str():
            return NUMBER.sub(lambda number: f"{float(number[0]):.6g}", value).encode()
        case _:
            array = np.asarray(value, dtype=np.float64)
            return repr(array.shape).encode() + np.rint(array / RESOLUTION).astype(np.int64).tobytes()


class Truths:
    """The recorded truths of one test.

    Args:
        test: the test's identifier in pytest.
        recording: whether truths are computed and written, and not read.
        reason: why a value may be replaced that disagrees with the new one; empty if it may not.
    """

    def __init__(self, test: str, recording: bool, reason: str) -> None:
        self._test, self._recording, self._reason = test, recording, reason

    def __call__(self, inputs: Any, compute: Callable[[], Truth]) -> Truth:
        """The recorded truth, or where truths are recorded that which `compute` gives.

        Args:
            inputs: what the value depends on, for `digest`.
            compute: computes the truth.

        Raises:
            pytest.fail.Exception: there is no truth of these inputs and versions, or, where truths are
                recorded, one that disagrees.
        """
        path = FOLDER / f"{self._name}.json"
        key = {"inputs": digest(inputs), **{name: version(name) for name in LIBRARIES}}
        known = json.loads(path.read_text(encoding="utf-8")) if path.is_file() else {}
        if not self._recording:
            if {name: known.get(name) for name in key} != key:
                pytest.fail(f"no truth of these inputs and versions in {path.name}; `make truths` records it")
            return _read(known)
        found, reasons = compute(), list(known.get("replaced", []))
        same = known.get("inputs") == key["inputs"]
        if same and _read(known).agrees(found):
            # Sums in another order change the last digits.
            found = _read(known)
        elif same:
            if not self._reason:
                pytest.fail(
                    f"{path.name}: the new value disagrees with the recorded one; --accept REASON replaces it"
                )
            reasons.append(self._reason)
        # A test is held to what the file says, digits and all.
        written = {"test": self._test, **key, "replaced": reasons} | _written(found)
        path.parent.mkdir(exist_ok=True)
        path.write_text(_lines(written), encoding="utf-8")
        return _read(written)

    @property
    def _name(self) -> str:
        """The test's identifier as a name of a file."""
        return re.sub(r"[^\w.]+", "-", re.sub(r"^tests/|\.py|(?<=[/:])test_", "", self._test)).strip("-")


def _written(truth: Truth) -> dict[str, Any]:
    return {"mean": _rounded(truth.mean, 8), "standard_error": _rounded(truth.standard_error, 3)}


def _rounded(array: Array, digits: int) -> Any:
    return np.vectorize(lambda number: float(f"{number:.{digits}g}"), otypes=[float])(array).tolist()


def _read(known: dict[str, Any]) -> Truth:
    return Truth(np.array(known["mean"]), np.array(known["standard_error"]))


def _lines(value: dict[str, Any]) -> str:
    """JSON with a line for each row of an array."""
    text = json.dumps(value, indent=1)
    return re.sub(r"\[\s+([-+\d.e,\s]+?)\s+\]", lambda row: "[" + " ".join(row[1].split()) + "]", text) + "\n"
