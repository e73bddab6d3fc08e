"""Keys of rows: settings and files that decide a run, without settings at their default."""

import hashlib
import json

from optimize.descent.methods import methods_that_take
from optimize.run_directory.key import all_settings
from optimize.settings.run_file import Run, run_keys
from relief.ground.formats import HEIGHT_MAPS

SHORT = 12
"""Hexadecimal digits of a key that name the folder of a row."""
DEFAULTS = 1
"""Number of the present defaults. A change of a default raises it, so that rows which were computed by the
former default are not taken for rows by the new one."""


def row_key(settings: Run) -> str:
    """SHA-256, in hexadecimal, of the settings and files that decide a run.

    A setting at its default is left out, so that a new setting does not make old rows unknown, and so is one
    that the method of the descent does not take.
    """
    defaults, method = run_keys(), settings.descent.method
    idle = {name for name in defaults if (takers := methods_that_take(name)) and method not in takers}
    deciding = {
        name: value
        for name, value in all_settings(settings).items()
        if name not in idle and (name not in defaults or defaults[name] != value)
    }
    if settings.height_scale == 1.0 and settings.texture.suffix.lower() in HEIGHT_MAPS:
        # As without it: none of these files states a unit of its own.
        deciding.pop("height_scale", None)
    return hashlib.sha256(json.dumps([DEFAULTS, deciding], sort_keys=True).encode()).hexdigest()
