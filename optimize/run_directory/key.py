"""Key of a run: what decides its result. A run goes on, and counts as finished, under its own key only."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from optimize.settings.run_file import Run, load_run
from relief.common.errors import InputError
from relief.common.files import read_limited
from relief.common.formats import PLATES
from relief.common.nesting import flattened
from tactile.quantities import mapped_quantities

SETTINGS = "run.toml"
RESULT = "result.json"
REPORT = "report.html"
LARGEST_RESULT = 1 << 24
"""Most bytes of result.json: 100 times those of a run with 64 lights."""
LARGEST_NUMBER = 1e300
"""Largest number of result.json; NaN, which Python's reader of JSON takes, is not within."""
FILES = (
    *("scene", "texture"),
    *(f"touch.{quantity.map_keys.file}" for quantity in mapped_quantities()),
    "touch.feel_of",
)
"""Settings that name a file, but for the masks of regions. Files may be moved, but not changed, before a run
is resumed (`Run.files`)."""
NAMES = ("touch.skin",)
"""Settings that only name what other settings spell out."""
CHANGEABLE = (
    *("descent.steps", "verify.corrections", "verify.samples"),
    *("verify.distance_cm", "verify.baseline", "verify.jod"),
)
"""Settings that may be changed before a run is resumed: how far the run goes, and how well it is measured."""


def described(settings: Run) -> dict[str, Any]:
    """The settings of a run and the SHA-256 of its files, as result.json has them."""
    files = {name: hashlib.sha256(file.read_bytes()).hexdigest() for name, file in settings.files().items()}
    return {"settings": settings.model_dump(mode="json"), "sha256": files}


def run_key(settings: Run) -> dict[str, Any]:
    """Everything that decides a run: its settings by dotted key, with the SHA-256 of a file for its place."""
    return {name: value for name, value in all_settings(settings).items() if name not in CHANGEABLE}


def all_settings(settings: Run) -> dict[str, Any]:
    """The settings of a run by dotted key, with the SHA-256 of a file for its place."""
    return _key(described(settings))


def finished(run_dir: Path) -> dict[str, Any] | None:
    """The content of result.json if resuming the run would change nothing, else None.

    A run is finished if it was not interrupted, its files are there, and run.toml, scene and texture are
    those of the result. Nothing heavy is imported.

    Raises:
        InputError: there is no run.toml, or it is no run file.
    """
    settings = load_run(run_dir / SETTINGS)
    if not all((run_dir / name).is_file() for name in (RESULT, REPORT, "heights.exr", *PLATES)):
        return None
    if (result := read_result(run_dir)) is None:
        return None
    try:
        same = _key(result) == _key(described(settings))
        return result if same and result["stop"]["reason"] != "interrupted" else None
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError):
        return None


def read_result(run_dir: Path) -> dict[str, Any] | None:
    """The content of result.json; None if it is missing, damaged, or holds what may not be shown."""
    try:
        result = json.loads(read_limited(run_dir / RESULT, LARGEST_RESULT))
        return result if isinstance(result, dict) and all(map(_sound, _values(result))) else None
    except (InputError, ValueError, TypeError, RecursionError):
        return None


def _values(content: Any) -> Iterator[str | float | None]:
    """Every text, number, truth value and null of a JSON document, but not the names of its members."""
    if isinstance(content, list | dict):
        for value in content.values() if isinstance(content, dict) else content:
            yield from _values(value)
    else:
        yield content


def _sound(value: str | float | None) -> bool:
    """Whether a value may be shown: a text without control characters, a number that is one."""
    if isinstance(value, str):
        return value.isprintable()
    return value is None or abs(value) <= LARGEST_NUMBER


def _key(description: Mapping[str, Any]) -> dict[str, Any]:
    settings = flattened(description["settings"]) | dict(description["sha256"])
    return {name: value for name, value in settings.items() if name not in NAMES}
