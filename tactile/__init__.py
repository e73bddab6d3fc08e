"""Touch: what a finger feels of a relief, with gradients. Millimetres, newtons, MPa."""

import sys
from typing import TYPE_CHECKING

from relief.ground.lazy import lazy_names

if TYPE_CHECKING:
    from relief.ground.errors import InputError
    from tactile.area import contact_area
    from tactile.contact import ContactError
    from tactile.jnd import discrimination_probability, jnd_apart, jnd_scaled
    from tactile.model import TouchModel, press, touch_model
    from tactile.pair_variation import roughness
    from tactile.skin import Skin
    from tactile.touch import Touch

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

__getattr__, __dir__ = lazy_names(sys.modules[__name__])
