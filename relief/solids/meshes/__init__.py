"""Meshes: intersections, shells and neighbourhoods, checks of solids, and unrolling around a point."""

import sys
from typing import TYPE_CHECKING

from relief.ground.lazy import lazy_names

if TYPE_CHECKING:
    from relief.solids.meshes.intersections import self_intersections as self_intersections
    from relief.solids.meshes.solid import check_solid as check_solid
    from relief.solids.meshes.solid import outer_body as outer_body

__getattr__, __dir__, __all__ = lazy_names(sys.modules[__name__])
