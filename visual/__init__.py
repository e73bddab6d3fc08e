"""Sight: what a relief looks like, with gradients. Importing this loads no Mitsuba, Dr.Jit or torch."""

import sys
from typing import TYPE_CHECKING

from relief.ground.lazy import lazy_names

if TYPE_CHECKING:
    from relief.ground.errors import InputError as InputError
    from relief.heightmap import load_heights as load_heights
    from visual.scene import Scene as Scene
    from visual.scene import load_scene as load_scene

__getattr__, __dir__, __all__ = lazy_names(sys.modules[__name__])
