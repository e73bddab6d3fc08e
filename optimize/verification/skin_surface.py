"""Change of the skin's surface by bands of wavelength: reported, not steered."""

import numpy as np
import torch

import tactile
from optimize.verification.felt_places import FeltPlaces
from optimize.verification.surface_bands import surface_bands
from optimize.verification.verification import SurfaceBand
from relief.ground.arrays import Array, Index
from relief.ground.threads import one_torch_thread
from tactile.measures import TouchMeasures

MOST_PLACES = 8
"""Most places whose skin is looked at, evenly taken."""


def skin_bands(touch: FeltPlaces, skin: tactile.Skin, size_mm: float) -> tuple[SurfaceBand, ...] | None:
    """Bands of the skin's surface at some of the places of a result.

    Args:
        touch: of original and result.
        skin: the finger.
        size_mm: side of a patch.

    Returns:
        None where two models of touch pressed, whose difference would count as change.
    """
    before, after = touch.before, touch.after
    if (before.model, before.mesh) != (after.model, after.mesh):
        return None
    some = np.linspace(0, len(touch.places) - 1, min(len(touch.places), MOST_PLACES)).round().astype(int)
    first, then = (_surface(side, some, skin, size_mm) for side in (before, after))
    return surface_bands(first, then, size_mm)


@one_torch_thread()
def _surface(touch: TouchMeasures, some: Index, skin: tactile.Skin, size_mm: float) -> Array:
    """(k, n, n) mm: surface of the skin over the plane where it would lie without pressure."""
    mesh = {} if touch.mesh is None else {"mesh": touch.mesh}
    pressure = torch.as_tensor(touch.pressure[some] / skin.young_modulus_mpa)
    model = tactile.touch_model(skin, pressure.shape[-1], size_mm, model=touch.model, **mesh)
    return np.asarray(model.operator.displacement(pressure))
