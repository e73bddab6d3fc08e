"""JOD: how alike two pictures are to an eye, by ColorVideoVDP (Mantiuk et al. 2024), an optional package.

10 is identical; one less means that 75 % of observers see the difference as a loss of quality. Package and
packages that it needs load in two seconds, so that they are imported only where JOD is asked for.
"""

import warnings
from functools import lru_cache
from importlib import import_module
from importlib.util import find_spec
from typing import Any

import numpy as np

from relief.ground.arrays import FloatArray
from relief.ground.errors import InputError
from relief.ground.srgb import srgb

IDENTICAL = 10.0
"""JOD of a picture and itself."""
DISPLAY = "standard_4k"
"""Brightness of the display, by the package's own name for it: 200 cd/m², contrast 1000, under 250 lux."""
PACKAGE = "pycvvdp"
"""Name by which Python imports the package `cvvdp`."""
INSTALL = "JOD needs the package cvvdp: pip install 'retouch[jod]'"


def jod_obstacle() -> str | None:
    """Why there is no JOD here, in one line; None where the package is installed. Imports nothing."""
    return INSTALL if find_spec(PACKAGE) is None else None


def jod(before: FloatArray, after: FloatArray, white: float, pixels_per_degree: float) -> float:
    """JOD of two pictures as displayed, at most 10.

    Args:
        before, after: (rows, cols) linear radiance.
        white: radiance shown as full white.
        pixels_per_degree: of the visual field.

    Raises:
        InputError: the package is missing or does not load.
    """
    metric = _metric(float(pixels_per_degree), before.shape)
    shown = (srgb(picture, white)[:, :, None].astype(np.float32) for picture in (after, before))
    value, _ = metric.predict(*shown, dim_order="HWC")
    return min(IDENTICAL, float(value))


@lru_cache(maxsize=4)
def _metric(pixels_per_degree: float, shape: tuple[int, ...]) -> Any:
    if obstacle := jod_obstacle():
        raise InputError(obstacle)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            package = import_module(PACKAGE)
    except Exception as error:  # torchvision of another build than torch raises errors of many kinds
        raise InputError(f"JOD: cvvdp does not load: {' '.join(str(error).split())[:200]}") from error
    import torch

    geometry = package.vvdp_display_geometry(shape[::-1], ppd=pixels_per_degree)
    return package.cvvdp(
        display_name=DISPLAY, display_geometry=geometry, quiet=True, device=torch.device("cpu")
    )
