"""Retouch from Python: touch, sight, optimisation and export by one import.

Importing this package loads none of them; each name loads what it needs when it is first used.
"""

import sys
from typing import TYPE_CHECKING

from relief.common.lazy import lazy_names

if TYPE_CHECKING:
    from optimize.runs.job import Result
    from optimize.settings.run_file import Run, load_run, run_from_scene
    from optimize.settings.skins import load_skin
    from relief.common.errors import InputError
    from relief.common.progress import Progress, progress
    from relief.export.plate import export_plate
    from relief.heightmap import load_heights, save_heights_exr, save_heights_png
    from relief.preparing.preparation import prepare
    from retouch.verbs.comparison import compare
    from retouch.verbs.runs import optimize, resume
    from surrogate.data.field_set import open_fieldset
    from tactile.area import contact_area
    from tactile.contact import ContactError
    from tactile.jnd import discrimination_probability, jnd_apart, jnd_scaled
    from tactile.model import press
    from tactile.pair_variation import roughness
    from tactile.skin import Skin
    from tactile.touch import Touch
    from visual.scene import Scene, load_scene

__all__ = [
    "ContactError",
    "InputError",
    "Progress",
    "Result",
    "Run",
    "Scene",
    "Skin",
    "Touch",
    "compare",
    "contact_area",
    "discrimination_probability",
    "export_plate",
    "jnd_apart",
    "jnd_scaled",
    "load_heights",
    "load_run",
    "load_scene",
    "load_skin",
    "open_fieldset",
    "optimize",
    "prepare",
    "press",
    "progress",
    "resume",
    "roughness",
    "run_from_scene",
    "save_heights_exr",
    "save_heights_png",
]

__getattr__, __dir__ = lazy_names(sys.modules[__name__])
