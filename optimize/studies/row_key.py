"""Keys of rows: settings and files that decide a run, without settings at the value that changes nothing."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from optimize.runs.config import Run, run_keys
from optimize.runs.key import all_settings

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
    "look.model": "exact",
    "look.weight": 1.0,
    "look.samples": None,
    "look.masking": 0.0,
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
}
"""Value of each setting with which runs behave as they did before the setting existed.

A setting that stands at this value is left out of the key, so that a new setting does not make old rows
unknown. A line is added with each new setting and is never changed, even if the default is.
"""


def row_key(settings: Run) -> str:
    """SHA-256, in hexadecimal, of the settings and files that decide a run."""
    neutral = {**run_keys(), **INTRODUCED}
    deciding = {
        name: value
        for name, value in all_settings(settings).items()
        if name not in neutral or neutral[name] != value
    }
    return hashlib.sha256(json.dumps(deciding, sort_keys=True).encode()).hexdigest()
