"""Arrays: the types that most modules name."""

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
"""Array in double precision, the precision of everything that is measured."""
Index = NDArray[np.int64]
"""Array of numbers of things: faces, vertices, pixels, height samples."""
