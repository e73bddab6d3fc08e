"""Touch: what a finger feels of a relief, with gradients. Millimetres, newtons, MPa."""

import sys
from typing import TYPE_CHECKING

from relief.ground.lazy import lazy_names

if TYPE_CHECKING:
    from relief.ground.errors import InputError as InputError
    from tactile.contact import ContactError as ContactError
    from tactile.jnd import discrimination_probability as discrimination_probability
    from tactile.jnd import jnd_apart as jnd_apart
    from tactile.jnd import jnd_scaled as jnd_scaled
    from tactile.model import TouchModel as TouchModel
    from tactile.model import press as press
    from tactile.model import touch_model as touch_model
    from tactile.pair_variation import roughness as roughness
    from tactile.skin import Skin as Skin
    from tactile.touch import Touch as Touch
    from tactile.touch import contact_area as contact_area

__getattr__, __dir__, __all__ = lazy_names(sys.modules[__name__])
