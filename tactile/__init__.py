"""Touch: what a finger feels of a relief, with gradients. Millimetres, newtons, MPa."""

import sys
from typing import TYPE_CHECKING

from relief.lazy import lazy_names

if TYPE_CHECKING:
    from relief.errors import InputError
    from tactile.area import contact_area
    from tactile.contact import ContactError
    from tactile.jnd import discrimination_probability, jnd_apart, jnd_scaled
    from tactile.model import Touch, TouchModel, press, touch_model
    from tactile.pair_variation import roughness
    from tactile.skin import Skin

__all__ = [
    "ContactError",
    "InputError",
    "Skin",
    "Touch",
    "TouchModel",
    "contact_area",
    "discrimination_probability",
    "jnd_apart",
    "jnd_scaled",
    "press",
    "roughness",
    "touch_model",
]

_SOURCES = {
    "ContactError": "tactile.contact",
    "InputError": "relief.errors",
    "Skin": "tactile.skin",
    "Touch": "tactile.model",
    "TouchModel": "tactile.model",
    "contact_area": "tactile.area",
    "discrimination_probability": "tactile.jnd",
    "jnd_apart": "tactile.jnd",
    "jnd_scaled": "tactile.jnd",
    "press": "tactile.model",
    "roughness": "tactile.pair_variation",
    "touch_model": "tactile.model",
}
"""The module of each public name; the imports above say the same to type checkers."""

__getattr__, __dir__ = lazy_names(sys.modules[__name__], _SOURCES)
