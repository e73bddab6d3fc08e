"""Optimisation: touch and sight in one descent, verified. Importing this loads neither."""

import sys
from typing import TYPE_CHECKING

from relief.ground.lazy import lazy_names

if TYPE_CHECKING:
    from optimize.runs.job import Result as Result
    from optimize.runs.job import resume as resume
    from optimize.runs.job import run as run

__getattr__, __dir__, __all__ = lazy_names(sys.modules[__name__])
