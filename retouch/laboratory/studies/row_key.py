"""Keys of rows: settings and files that decide a run, without settings at the value that changes nothing."""

import hashlib
import json
from collections.abc import Mapping
from typing import Any

from optimize.descent.methods import methods_that_take
from optimize.run_directory.key import all_settings
from optimize.settings.run_file import Run, run_keys
from relief.ground.formats import HEIGHT_MAPS
from relief.ground.limits import PATCH_SIDE_MM
from relief.printers import RANGES

SHORT = 12
"""Hexadecimal digits of a key that name the folder of a row."""

INTRODUCED: Mapping[str, Any] = {
    "size_mm": None,
    "relief_mm": None,
    "height_scale": None,
    "fill": False,
    "level": False,
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
    "look.shape": 0.0,
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
REVISED_TILES: Mapping[str, str] = {
    # bark-tile
    "645478f0026b076a8275a1e424ebdd94e4210586e1b56a82f7e017059164547b": (
        "e5bd8396fb7269acc328db7b0aae27da8620b6610945a099f9394c68ba8ac28b"
    ),
    # brick-tile
    "873a965fa12d49a9e43b2f167af2e4c597ef21bc7bfde3eadf64b3990569f1f7": (
        "25eb9bff6c3b226c6643d43ec3fa5f31ff49e18ed7b61f0900be8f877cd09b75"
    ),
    # dots-tile
    "43ca5d56f62a1d6dd3d1848737ce3c95850b3ae9a07c79e6222e3028242c38b3": (
        "1b3feec9711f2643e59b8e6f25cd2236f02280c83fefbb90be38b74b4a127acd"
    ),
    # grass-tile
    "26ee006bf0c0800dac3f473b66497bf7288eb9a81a1db1b6ee0d96d7668e1503": (
        "2aaedc27831223b7f30d6d4bdcd74aa9ffe9ce96f5fb6856fab27c18d9ae642c"
    ),
    # gravel-tile
    "8b38e85dcf3555a12625118f3af85f94f90c7fcb3f18c716796af77db9f21c91": (
        "fb530864b3a78ed1b70b85d65a99ca53630b122d7a32b0a741a8c274b8248122"
    ),
    # knit-tile
    "e3d791c16fcfaecc502e526b2621cefd1f4a15bd50d0042df0772762f6f59b8a": (
        "243ce80892825b628c636415e62da03cc6e26e778e5e526d91f0de2f65aa5033"
    ),
    # leather-tile
    "876ce4df7ebf38bfce202f23fe7e94c73d0c7f6aaf35b5da64e4e8f39921e107": (
        "f6139b81b406def8985d4a0a88ab5027bd811f9bb613ddf6c4a96f5429ea7784"
    ),
    # pebbles-tile
    "f621b13c9cbaf6c7156ee26ebf081b60c36ad5811a284774e1c242f60690296a": (
        "9f670ee3c3e1fb0fdd72bca1a22415dc3c5cf273fd863fef9da92e3d1f8c07d2"
    ),
    # scratches-tile
    "2f72d7cad7d66ae2e8d5cc8e70c8888c37c96cd9f62ae0b0173e568c2b1d775a": (
        "2c63fff00ed1b804231edfba9f3cbe6089e6935ea18752866c1d6d4ac4301513"
    ),
    # terrain-tile
    "41721adcf92274bb792087d1db8ebf1a65d2ec083c7032cddad4350b02a46ae9": (
        "834faddc719c46dfafbc0d7aaf762ef875c02334cd421b5ea2b5e0cc0eebb40b"
    ),
    # waves-tile
    "67f3358c47ac3da1ce3260fc9ee9ec461d634da92522fcf59931aad15fbcd4e3": (
        "48af6e446f7c2cb99c3ae6d45fe74eca5f0571ba57c9e3b2bb41dbc9091ed80d"
    ),
    # weave-tile
    "f57102f8f34cb97d4a7b579c86beb5f495b7f38f3ee7a7fe7cf29203667adcfc": (
        "91431c04c9ba8698b71bbd194763d96e5b3d811dd064ea5fe3a43c6cb201895a"
    ),
}
"""SHA-256 of bundled tiles, each with that of the file of the same heights whose header did not say that it
repeats, which is a setting of its own."""


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
    for name in ("texture", "touch.feel_of"):
        if name in deciding:
            deciding[name] = REVISED_TILES.get(deciding[name], deciding[name])
    if settings.height_scale == 1.0 and settings.texture.suffix.lower() in HEIGHT_MAPS:
        # As without it: none of these files states a unit of its own.
        deciding.pop("height_scale", None)
    if settings.size_mm in (None, PATCH_SIDE_MM):
        deciding["scene"] = REVISED.get(deciding["scene"], deciding["scene"])
    return hashlib.sha256(json.dumps(deciding, sort_keys=True).encode()).hexdigest()
