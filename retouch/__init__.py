"""Retouch from Python: touch, sight, optimisation and export by one import.

Importing this package loads none of them; each name loads what it needs when it is first used.
"""

from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from optimize.runs.config import Run, load_run, run_from_scene
    from optimize.runs.job import Result, resume
    from optimize.runs.job import run as optimize
    from relief.errors import InputError
    from relief.export import export_plate
    from relief.heightmap import load_heights, save_heights_exr, save_heights_png
    from surrogate.data.field_set import open_fieldset
    from tactile.area import contact_area
    from tactile.contact import ContactError
    from tactile.jnd import discrimination_probability, jnd_apart, jnd_scaled
    from tactile.model import Touch, press
    from tactile.pair_variation import roughness
    from tactile.skin import Skin
    from visual.scene import Scene, load_scene

_SOURCES = {
    "ContactError": "tactile.contact:ContactError",
    "InputError": "relief.errors:InputError",
    "Result": "optimize.runs.job:Result",
    "Run": "optimize.runs.config:Run",
    "Scene": "visual.scene:Scene",
    "Skin": "tactile.skin:Skin",
    "Touch": "tactile.model:Touch",
    "contact_area": "tactile.area:contact_area",
    "discrimination_probability": "tactile.jnd:discrimination_probability",
    "export_plate": "relief.export:export_plate",
    "jnd_apart": "tactile.jnd:jnd_apart",
    "jnd_scaled": "tactile.jnd:jnd_scaled",
    "load_heights": "relief.heightmap:load_heights",
    "load_run": "optimize.runs.config:load_run",
    "load_scene": "visual.scene:load_scene",
    "open_fieldset": "surrogate.data.field_set:open_fieldset",
    "optimize": "optimize.runs.job:run",
    "press": "tactile.model:press",
    "resume": "optimize.runs.job:resume",
    "roughness": "tactile.pair_variation:roughness",
    "run_from_scene": "optimize.runs.config:run_from_scene",
    "save_heights_exr": "relief.heightmap:save_heights_exr",
    "save_heights_png": "relief.heightmap:save_heights_png",
}
"""Where each public name comes from, as ``module:name``; the imports above say the same to type checkers."""

__all__ = [
    "ContactError",
    "InputError",
    "Result",
    "Run",
    "Scene",
    "Skin",
    "Touch",
    "contact_area",
    "discrimination_probability",
    "export_plate",
    "jnd_apart",
    "jnd_scaled",
    "load_heights",
    "load_run",
    "load_scene",
    "open_fieldset",
    "optimize",
    "press",
    "resume",
    "roughness",
    "run_from_scene",
    "save_heights_exr",
    "save_heights_png",
]


def __getattr__(name: str) -> Any:
    if name not in _SOURCES:
        raise AttributeError(f"module 'retouch' has no attribute {name!r}")
    value = globals()[name] = resolve_name(_SOURCES[name])
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
