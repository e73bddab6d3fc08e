"""Keys of rows: settings and files that decide a run, without settings at the value that changes nothing."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from optimize.descent.methods import methods_that_take
from optimize.run_directory.key import all_settings
from optimize.settings.run_file import Run, run_keys
from relief.common.limits import PATCH_SIDE_MM
from relief.printers import RANGES

SHORT = 12
"""Hexadecimal digits of a key that name the folder of a row."""

INTRODUCED: Mapping[str, Any] = {
    "size_mm": None,
    "relief_mm": None,
    "height_scale": 1.0,
    "repeats": False,
    "seed": 0,
    "touch.model": "layer",
    "touch.spacing_mm": 2.5,
    "touch.fingers": "one",
    "touch.fingers_weight": 20.0,
    "touch.skin": "paper",
    "touch.young_modulus_mpa": 0.5,
    "touch.poisson_ratio": 0.48,
    "touch.force_n": 10.0,
    "touch.thickness_mm": 2.5,
    "touch.depth_mm": 0.75,
    "touch.layers": [],
    "touch.shape": "flat",
    "touch.radius_mm": None,
    "touch.across_mm": None,
    "touch.curved_x_mm": None,
    "touch.curved_y_mm": None,
    "touch.roughness": None,
    "touch.jnd": None,
    "touch.contact_area_mm2": None,
    "touch.contact_area_scale": None,
    "touch.roughness_map": None,
    "touch.roughness_range": None,
    "touch.roughness_from": None,
    "touch.roughness_to": None,
    "touch.axis": None,
    "touch.region": (),
    "touch.feel_of": None,
    "touch.feel_of_relief_mm": None,
    "touch.feel_of_repeats": None,
    "touch.feel_of_quantity": None,
    "look.model": "exact",
    "look.weight": 1.0,
    "look.samples": None,
    "look.masking": 0.0,
    "look.broad": 0.0,
    "descent.method": "gauss-newton",
    "descent.steps": 100,
    "descent.tolerance": 0.01,
    "descent.shadow_edges": True,
    "descent.learning_rate": 0.027,
    "descent.smoothing": 0.0,
    "descent.growth": 30.0,
    "descent.stop": "schedule",
    "descent.regularisation": 0.06,
    "verify.model": "fem",
    "verify.resolution": 64,
    "verify.corrections": 3,
    "verify.samples": None,
    "verify.distance_cm": 40.0,
    "verify.baseline": True,
    "verify.jod": False,
    "print.printer": None,
    **{f"print.{key}": None for key in RANGES},
    "print.keep_features": False,
}
"""Value of each setting with which runs behave as they did before the setting existed.

A setting that stands at this value is left out of the key, so that a new setting does not make old rows
unknown. A line is added with each new setting and is never changed, even if the default is.
"""


LATER_DEFAULTS = frozenset({"look.broad"})
"""Settings with another default than the value they were introduced with. Where the method of a run does not
take one, the run is as before, whatever it says."""
REVISED: Mapping[str, str] = {
    # studio
    "17fee0c016340caa3485997b3f1cb8fbc2bf677e1501bcbf00eaef0c46d1ac6a": (
        "fb7e866ffd989cb85788c0ff2027ce933b54b99456aa9357ba4414f507224f49"
    ),
    # one_sun
    "3cd8a8ecf0d5f84f96253fb0f12cf2a2bf734d9943f7b723b0f9d82f66bc3a3b": (
        "cde17aed5b7c5e4f4b5c7fc31ff6616ded94d82f13d0bc71bcfde21f7c5f6fca"
    ),
    # five_views
    "cc4160083917ca492e204ab78d0dc77b0e11bf767324caf45f97dd091d866b57": (
        "3c8f037ceb82432b9b1309522254d1d3abecda7c614fe6c6a4c5d35fdee056cd"
    ),
    # evening
    "c61c56154107caeb7698c0c2bec55d026645bc493d5e1c287330a8cc6af2e09c": (
        "2e1f372ce6d5d689f9c2e8b0634e1e1e5ec03338bfa12ca2115c1707c3ec36f8"
    ),
}
"""SHA-256 of bundled scenes, each with that of an earlier revision that shows plates of 10 x 10 mm alike.

A line is added with each such revision, so that it does not make old rows unknown.
"""


def row_key(settings: Run) -> str:
    """SHA-256, in hexadecimal, of the settings and files that decide a run."""
    neutral = {**run_keys(), **INTRODUCED}
    method = settings.descent.method
    idle = {name for name in LATER_DEFAULTS if method not in methods_that_take(name)}
    deciding = {
        name: value
        for name, value in all_settings(settings).items()
        if name not in idle and (name not in neutral or neutral[name] != value)
    }
    if settings.size_mm in (None, PATCH_SIDE_MM):
        deciding["scene"] = REVISED.get(deciding["scene"], deciding["scene"])
    return hashlib.sha256(json.dumps(deciding, sort_keys=True).encode()).hexdigest()
