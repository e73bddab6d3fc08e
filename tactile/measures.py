"""Touch measures: numbers and maps of what a finger feels of a relief, by one model of touch."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
import torch

import tactile
from relief.depth import check_reach, floor_mm
from relief.ground.arrays import Array, Index
from relief.ground.progress import stage
from relief.ground.threads import one_torch_thread
from relief.patches import Patches
from relief.places import places
from relief.relief import Relief
from tactile.model import FEM_MESH, ModelName, check_model
from tactile.pair_variation import check_patch
from tactile.quantities import QUANTITIES, ROUGHNESS, Quantity, means

_log = logging.getLogger(__name__)

BATCH_SAMPLES = 1 << 19
"""Most samples of patches that are pressed together: 32 patches of 128 x 128. Larger batches gain no time."""


@dataclass(frozen=True)
class TouchMeasures:
    """Quantities that a finger feels at each of k contact locations of a relief.

    Attributes:
        model: of touch.
        mesh: nodes along a side of the finite elements; None for other models.
        values: (k,) of quantities by name, in their units.
        contact_fraction: share of the samples under pressure, mean over the contact locations.
        strain, pressure: (k, n, n) on the patches; pressure in MPa.
        gradients: (targets * k, rows * cols) of the targets' quantities by the heights, a sparse matrix if
            there are several locations; rows of one target follow one another. No rows if not asked for.
        error_bound: largest bound of the error of a contact's energy, over the elastic energy.
    """

    model: ModelName
    mesh: int | None
    values: dict[str, Array]
    contact_fraction: float
    strain: Array
    pressure: Array
    gradients: Array | sp.csr_matrix
    error_bound: float

    @property
    def means(self) -> dict[str, float]:
        """Means of the values over the contact locations."""
        return means(self.values)

    @property
    def ends(self) -> dict[str, float]:
        """The `count` of locations, and least and largest value of each quantity: `NAME_min`, `NAME_max`."""
        extremes = {"min": np.min, "max": np.max}
        each = {
            f"{name}_{end}": float(extreme(v))
            for name, v in self.values.items()
            for end, extreme in extremes.items()
        }
        return {"count": len(next(iter(self.values.values()))), **each}

    def __repr__(self) -> str:
        numbers = ", ".join(f"{name} {value:.4g}" for name, value in self.means.items())
        share = f"{100.0 * self.contact_fraction:.0f} % in contact"
        return f"<touch by {self.model}: {numbers}, {share}, contact's energy within {self.error_bound:.0e}>"


def measure_touch(
    relief: Relief,
    skin: tactile.Skin,
    model: ModelName,
    mesh: int = FEM_MESH,
    quantities: Iterable[Quantity] = QUANTITIES.values(),
    at: Index | None = None,
) -> TouchMeasures:
    """Press on a relief from a cold start, in double precision, with roughness by the full sum.

    Args:
        relief: to press on.
        skin: the finger.
        model: of touch.
        mesh: nodes along a side of the finite elements.
        quantities: to be measured.
        at: (k, 2) contact locations; None: the locations of `relief.places.places`.

    Raises:
        InputError: heights, size or skin are out of range, or a finger reaches more than 2.9 mm below the top
            of a relief higher than 3 mm; the message names the field.
        ContactError: the contact does not converge.
    """
    quantities, heights, surface = tuple(quantities), relief.heights, relief.surface
    patches = Patches(surface, places(surface) if at is None else at, side_mm=skin.patch_mm)
    # Before patches are cut and operators built, which can take many GiB and seconds.
    check_model(skin, patches.samples, patches.size_mm, model, mesh)
    if ROUGHNESS in quantities:
        check_patch(patches.plate_mm)
    deep = floor_mm(heights) > 0.0

    def press(fields: Array) -> tuple[tactile.Touch, dict[str, Array]]:
        # A plate that is its own patch is pressed as it is, without a dimension for locations.
        field = torch.as_tensor(fields if len(fields) > 1 else fields[0])
        touch = tactile.press(field, patches.size_mm, skin, model, mesh=mesh)
        if deep:
            check_reach(fields, touch.gap.detach().numpy().reshape(fields.shape))
        values = {one.name: each(one.value(touch)) for one in quantities}
        return touch, values

    measures = collected(patches, heights, press, model, mesh if model == "fem" else None)
    _log.info("pressed: %r", measures)
    return measures


Press = Callable[[Array], tuple[tactile.Touch, dict[str, Array]]]
"""Map from patches (k, n, n) to their touch and the values of quantities (k,) by name."""


@one_torch_thread()
def collected(
    patches: Patches, heights: Array, press: Press, model: ModelName, mesh: int | None = None
) -> TouchMeasures:
    """Press on all patches of a relief, batch by batch; fields as in `TouchMeasures`, without gradients."""
    touches, values = [], []
    parts = batches(patches)
    with stage("pressing on places", len(parts)) as advance:
        for part in parts:
            touch, of_part = press(patches.within_reach(heights, part))
            touches.append(touch)
            values.append(of_part)
            advance()
    return touch_measures(touches, values, model, mesh, columns=heights.size)


def batches(patches: Patches) -> list[slice]:
    """Parts of the patches that are pressed together."""
    size = max(1, BATCH_SAMPLES // patches.samples**2)
    return [slice(start, start + size) for start in range(0, patches.count, size)]


def each(value: torch.Tensor) -> Array:
    """(k,) of a quantity's values, of which one has no dimension."""
    return np.atleast_1d(value.detach().double().numpy())


def touch_measures(
    touches: Sequence[tactile.Touch],
    values: Sequence[dict[str, Array]],
    model: ModelName,
    mesh: int | None = None,
    gradients: Array | sp.csr_matrix | None = None,
    columns: int = 0,
) -> TouchMeasures:
    """The measures of touches, each (n, n) or (batch, n, n), and of their values; see `TouchMeasures`."""

    def maps(name: str) -> Array:
        fields = [getattr(touch, name).detach().double().numpy() for touch in touches]
        return np.concatenate([field.reshape(-1, *field.shape[-2:]) for field in fields])

    fractions = np.concatenate([each(touch.contact_fraction) for touch in touches])
    return TouchMeasures(
        model,
        mesh,
        {name: np.concatenate([of_part[name] for of_part in values]) for name in values[0]},
        float(fractions.mean()),
        maps("strain"),
        maps("pressure"),
        np.zeros((0, columns)) if gradients is None else gradients,
        max(float(touch.error_bound.max()) for touch in touches),
    )
