"""Files of meshes: readers of formats, and the mesh that they give, with checks of what it holds."""

import sys
from typing import TYPE_CHECKING

from relief.ground.lazy import lazy_names

if TYPE_CHECKING:
    from relief.solids.files.mesh import Mesh as Mesh
    from relief.solids.files.mesh import read_mesh as read_mesh

__getattr__, __dir__, __all__ = lazy_names(sys.modules[__name__])
