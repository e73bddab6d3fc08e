"""Key of a run: what decides its result. A run goes on, and counts as finished, under its own key only."""

from collections.abc import Mapping
from typing import Any

from optimize.settings.run_file import Run
from optimize.verification.verification import described
from relief.ground.nesting import flattened
from tactile.quantities import mapped_quantities

SETTINGS = "run.toml"
RESULT = "result.json"
REPORT = "report.html"
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


def run_key(settings: Run) -> dict[str, Any]:
    """Everything that decides a run: its settings by dotted key, with the SHA-256 of a file for its place."""
    return {name: value for name, value in all_settings(settings).items() if name not in CHANGEABLE}


def all_settings(settings: Run) -> dict[str, Any]:
    """The settings of a run by dotted key, with the SHA-256 of a file for its place."""
    return key_of(**described(settings))


def key_of(settings: Mapping[str, Any], sha256: Mapping[str, str]) -> dict[str, Any]:
    """The settings by dotted key, with checksums for files; arguments as in a `Verification`."""
    values = flattened(settings) | dict(sha256)
    return {name: value for name, value in values.items() if name not in NAMES}
