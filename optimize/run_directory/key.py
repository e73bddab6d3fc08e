"""Key of a run: what decides its result. A run goes on, and counts as finished, under its own key only."""

import json
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

from optimize.settings.run_file import Run, load_settings
from optimize.verification.verification import Verification, described
from relief.ground.errors import InputError
from relief.ground.files import read_limited
from relief.ground.formats import PLATES
from relief.ground.nesting import flattened
from tactile.quantities import mapped_quantities

SETTINGS = "run.toml"
RESULT = "result.json"
REPORT = "report.html"
LARGEST_RESULT = 1 << 24
"""Most bytes of result.json: 100 times those of a run with 64 lights."""
FILES = (
    *("scene", "texture"),
    *(f"touch.{quantity.map_keys.file}" for quantity in mapped_quantities()),
    "touch.feel_of",
)
"""Settings that name a file, but for the masks of regions. Files may be moved, but not changed, before a run
is resumed (`Run.files`)."""
NAMES = ("touch.skin",)
"""Settings that only name what other settings spell out."""
REGION = "touch.region."
"""Prefix of the settings of a region, before its number."""
INTRODUCED_IN_REGIONS = {"graded": False}
"""Value of each key of a region with which runs behave as they did before the key existed. A key at this
value is left out, so that earlier runs can be resumed and rows of studies stay known."""
CHANGEABLE = (
    *("descent.steps", "verify.corrections", "verify.samples"),
    *("verify.distance_cm", "verify.baseline", "verify.jod"),
)
"""Settings that may be changed before a run is resumed: how far the run goes, and how well it is measured."""


def run_key(settings: Run) -> dict[str, Any]:
    """Everything that decides a run: its settings by dotted key, with the SHA-256 of a file for its place."""
    return {name: value for name, value in all_settings(settings).items() if name not in CHANGEABLE}


def all_settings(settings: Run) -> dict[str, Any]:
    """The settings of a run by dotted key, with the SHA-256 of a file for its place."""
    return _key(described(settings))


def finished(run_dir: Path) -> Verification | None:
    """The content of result.json if resuming the run would change nothing, else None.

    A run is finished if it was not interrupted, its files are there, and run.toml, scene and texture are
    those of the result. Nothing heavy is imported.

    Raises:
        InputError: there is no run.toml, or it is no run file.
    """
    settings = load_settings(run_dir / SETTINGS)
    if not all((run_dir / name).is_file() for name in (RESULT, REPORT, "heights.exr", *PLATES)):
        return None
    result = read_verification(run_dir)
    if result is None or result.stop.reason == "interrupted":
        return None
    try:
        of_result = _key({"settings": result.settings, "sha256": result.sha256})
        return result if of_result == all_settings(settings) else None
    except (ValueError, TypeError, LookupError, AttributeError, RecursionError):
        return None


def read_verification(run_dir: Path) -> Verification | None:
    """The content of result.json; None if it is missing, damaged, or holds what may not be shown."""
    file = run_dir / RESULT
    try:
        # What is no file, such as a pipe, would be waited for.
        stamp = file.stat() if file.is_file() else None
    except (OSError, ValueError):
        return None
    return None if stamp is None else _verification(file, stamp.st_mtime_ns, stamp.st_size)


@lru_cache(maxsize=64)
def _verification(file: Path, written_ns: int, size: int) -> Verification | None:
    """The content of a file as it was written at a time: those who look again need not read again."""
    try:
        return Verification.from_json(json.loads(read_limited(file, LARGEST_RESULT)))
    except (InputError, ValueError, TypeError, RecursionError):
        return None


def _key(description: Mapping[str, Any]) -> dict[str, Any]:
    settings = flattened(description["settings"]) | dict(description["sha256"])
    return {
        name: value for name, value in settings.items() if name not in NAMES and not _as_before(name, value)
    }


def _as_before(name: str, value: Any) -> bool:
    """Whether a setting is a key of a region that changes nothing."""
    key = name.rpartition(".")[2]
    return name.startswith(REGION) and key in INTRODUCED_IN_REGIONS and value is INTRODUCED_IN_REGIONS[key]
