"""NPY: an array of real numbers."""

from pathlib import Path

import numpy as np

from relief.ground.errors import InputError
from relief.ground.files import damage_named
from relief.reading.samples import Check, Samples, grey_or_colours, measured, without_transparent


def read_npy(path: Path, check: Check) -> Samples:
    """Read an array (rows, cols), or with 1, 3 or 4 channels last. Raises InputError."""
    with damage_named(path, "an NPY array"):
        values = np.lib.format.open_memmap(path, mode="r")
        if values.dtype.kind not in "fiu":
            raise InputError(f"{path}: does not hold one array of real numbers")
        if len(values.shape) != 2 and not (len(values.shape) == 3 and values.shape[2] in (1, 3, 4)):
            raise InputError(f"{path}: shape {values.shape}; expected (rows, cols), or 3 or 4 channels last")
        check(values.shape, path)
        layers = [measured(np.asarray(one)) for one in np.moveaxis(np.atleast_3d(values), -1, 0)]
    channels = without_transparent(grey_or_colours(*layers))
    return Samples(path, "NPY of numbers" + ("" if "Y" in channels else " in colour"), channels)
