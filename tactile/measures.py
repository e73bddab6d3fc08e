"""Touch measures: numbers and maps of what a finger feels of a relief, by one model of touch."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path

import numpy as np
import scipy.sparse as sp
import torch

import tactile
from relief.depth import check_reach, floor_mm, within_reach
from relief.ground.arrays import Array, Index
from relief.ground.formatting import about, number
from relief.ground.progress import say, stage
from relief.ground.threads import one_torch_thread
from relief.patches import STEERING_SAMPLES, Patches
from relief.places import places
from relief.relief import Relief
from tactile.model import FEM_MESH, ModelName, check_model
from tactile.pair_variation import check_patch
from tactile.quantities import QUANTITIES, ROUGHNESS, Quantity, means
from tactile.readouts import ReadOut

_log = logging.getLogger(__name__)

BATCH_SAMPLES = 1 << 19
"""Most samples of patches that are pressed together: 32 patches of 128 x 128. Larger batches gain no time."""

MOST_SAMPLES, FULL_SAMPLES = 1 << 25, 1 << 24
"""Most samples of patches that are all pressed as finely as the relief is sampled, 55 to 120 CPU seconds; and
how many of them are pressed at random locations where there are more (`ratio_estimate`)."""

MAP_SAMPLES = 1 << 25
"""Most samples of the maps of touch that are kept, 0.25 GiB for each map: 2048 patches of 128 x 128."""

PRESSED_S, FORECAST_S = 2.5e-6, 5.0
"""CPU seconds to press one sample (1.6e-6 to 3.6e-6 for 128 to 1024 samples a side, docs/evidence/touch.md),
and least seconds of which there is a forecast."""

BASE_GIB, HEIGHTS_BYTES, PATCH_BYTES = 0.4, 24, 700
"""Memory of the process, GiB; bytes for each sample of a relief that is read, and of a patch whose skin is
built."""


@dataclass(frozen=True)
class Subsample:
    """Contact locations that were pressed with all samples of a relief, chosen at random.

    Attributes:
        count: number of these locations.
        standard_errors: of the means over all locations, by the name of the quantity.
    """

    count: int
    standard_errors: Mapping[str, float]


@dataclass(frozen=True)
class TouchMeasures:
    """Quantities that a finger feels at each of k contact locations of a relief.

    Attributes:
        model: of touch.
        mesh: nodes along a side of the finite elements; None for other models.
        values: (k,) of quantities by name, in their units.
        contact_fractions: (k,) share of the samples under pressure.
        strain, pressure: (k, n, n) on the patches; pressure in MPa. Of the first locations only, where all
            have more than `MAP_SAMPLES` samples.
        gradients: (targets * k, rows * cols) of the targets' quantities by the heights, a sparse matrix if
            there are several locations; rows of one target follow one another. No rows if not asked for.
        error_bound: largest bound of the error of a contact's energy, over the elastic energy.
        subsample: locations that alone were pressed with all samples of the relief; None: all were.
        readouts: those that were asked for, by name, (k,), or of the locations of the subsample alone.
    """

    model: ModelName
    mesh: int | None
    values: dict[str, Array]
    contact_fractions: Array
    strain: Array
    pressure: Array
    gradients: Array | sp.csr_matrix
    error_bound: float
    subsample: Subsample | None = None
    readouts: Mapping[str, Array] = field(default_factory=dict)

    @property
    def contact_fraction(self) -> float:
        """Share of the samples under pressure, mean over the contact locations."""
        return float(self.contact_fractions.mean())

    @property
    def means(self) -> dict[str, float]:
        """Means of the values over the contact locations."""
        return means(self.values)

    @property
    def ends(self) -> dict[str, float]:
        """The `count` of locations, and least and largest value of each quantity: `NAME_min`, `NAME_max`.

        With a subsample also `count_full_sampling`, and `NAME_standard_error` of each quantity.
        """
        numbers: dict[str, float] = {"count": len(next(iter(self.values.values())))}
        for name, of_places in self.values.items():
            numbers |= {f"{name}_min": float(of_places.min()), f"{name}_max": float(of_places.max())}
        if (some := self.subsample) is not None:
            numbers["count_full_sampling"] = some.count
            numbers |= {f"{name}_standard_error": error for name, error in some.standard_errors.items()}
        return numbers

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
    readouts: Sequence[ReadOut] = (),
    most: int | None = None,
    by: Callable[[torch.Tensor, float], tactile.Touch] | None = None,
) -> TouchMeasures:
    """Press on a relief from a cold start, in double precision, with roughness by the full sum.

    Where the patches have more than `MOST_SAMPLES` samples, all are pressed with 128 samples a side and a
    random choice as the relief is sampled (`ratio_estimate`). A forecast of the time and the memory is said
    before the first press, if that is more than `FORECAST_S`.

    Args:
        relief: to press on.
        skin: the finger.
        model: of touch.
        mesh: nodes along a side of the finite elements.
        quantities: to be measured.
        at: (k, 2) contact locations; None: the locations of `relief.places.places`.
        readouts: to be taken of the same presses.
        most: as of `Patches`.
        by: from patches (..., n, n) and their side, mm, to their touch; None: by the model.

    Raises:
        InputError: heights, size or skin are out of range, or a finger reaches more than 2.9 mm below the top
            of a relief higher than 3 mm; the message names the field.
        ContactError: the contact does not converge.
    """
    quantities, heights, surface = tuple(quantities), within_reach(relief.heights), relief.surface
    patches = Patches(surface, places(surface) if at is None else at, most, skin.patch_mm)
    # Before patches are cut and operators built, which can take many GiB and seconds.
    check_model(skin, patches.samples, patches.size_mm, model, mesh)
    if ROUGHNESS in quantities:
        check_patch(patches.plate_mm)
    deep = floor_mm(relief.heights) > 0.0

    def press(of: Patches, part: slice) -> tuple[tactile.Touch, dict[str, Array]]:
        # A plate that is its own patch is pressed as it is, without a dimension for locations.
        fields = of.of(heights, part)
        pressed_on = torch.as_tensor(fields if len(fields) > 1 else fields[0])
        finger = by or partial(tactile.press, skin=skin, model=model, mesh=mesh)
        touch = finger(pressed_on, patches.size_mm)
        if deep:
            check_reach(fields, touch.gap.detach().numpy().reshape(fields.shape))
        values = {one.name: each(one.value(touch)) for one in quantities}
        advance(fields.size)
        return touch, values | {one.name: each(one.value(touch, pressed_on)) for one in readouts}

    chosen = full_sampling(patches)
    parts = [patches]
    if chosen is not None:
        parts = [replace(patches, most=STEERING_SAMPLES), replace(patches, places=patches.places[chosen])]
    say_forecast(relief, parts)
    with stage("pressing on places", sum(part.samples_in_all for part in parts)) as advance:
        nodes = mesh if model == "fem" else None
        pressed = [collected(part.count, part.samples, partial(press, part), model, nodes) for part in parts]
    # Not by ratios: a mean strain may be of either sign.
    read = [{one.name: part.values.pop(one.name) for one in readouts} for part in pressed]
    measures = pressed[0] if chosen is None else ratio_estimate(pressed[0], pressed[1], chosen)
    measures = replace(measures, readouts=read[-1])
    _log.info("pressed: %r", measures)
    return measures


def full_sampling(patches: Patches) -> Index | None:
    """Numbers of the patches to be pressed with all samples of the relief, drawn at random; None: of all."""
    if patches.samples_in_all <= MOST_SAMPLES or patches.samples <= STEERING_SAMPLES:
        return None
    drawn = np.random.default_rng(0).permutation(patches.count)[: FULL_SAMPLES // patches.samples**2]
    return np.sort(drawn)


def say_forecast(relief: Relief, parts: Sequence[Patches]) -> None:
    """Say what pressing on patches takes, if that is long: locations, samples, time and memory."""
    seconds = PRESSED_S * sum(part.samples_in_all for part in parts)
    if seconds < FORECAST_S:
        return
    presses = [f"with {part.samples} x {part.samples} samples on {part.count}" for part in parts]
    size = HEIGHTS_BYTES * relief.heights.size + PATCH_BYTES * parts[-1].samples ** 2
    size += 16 * sum(min(part.samples_in_all, MAP_SAMPLES) for part in parts)
    takes = f"about {' '.join(about(seconds))} and {number(BASE_GIB + size / 2**30, 2)} GiB of memory"
    say(f"{Path(relief.name).name}: a finger presses {' and '.join(presses)} places: {takes}")


def ratio_estimate(coarse: TouchMeasures, full: TouchMeasures, chosen: Index) -> TouchMeasures:
    """Measures at k contact locations from coarser patches of all and from all samples of m chosen ones.

    Values of coarser patches are multiplied by the ratio of the means over the chosen locations (ratio
    estimation in double sampling), so that details between the coarser samples count in the means; a chosen
    location has its own value. Errors are those of a random choice of m of k.

    Args:
        coarse: of all k locations.
        full: of the m chosen ones.
        chosen: (m,) their numbers, chosen at random.
    """

    def estimate(name: str, of_coarse: Array, of_full: Array) -> Array:
        total = float(of_coarse[chosen].sum())
        estimates = of_coarse * (float(of_full.sum()) / total if total else 1.0)
        left = (of_full - estimates[chosen]).std(ddof=1)
        errors[name] = float(left) * math.sqrt(1.0 / len(chosen) - 1.0 / len(of_coarse))
        estimates[chosen] = of_full
        return estimates

    errors = dict[str, float]()
    values = {name: estimate(name, each, full.values[name]) for name, each in coarse.values.items()}
    fractions = estimate("contact_fraction", coarse.contact_fractions, full.contact_fractions)
    bound, some = max(coarse.error_bound, full.error_bound), Subsample(len(chosen), errors)
    return replace(coarse, values=values, contact_fractions=fractions, error_bound=bound, subsample=some)


Press = Callable[[slice], tuple[tactile.Touch, dict[str, Array]]]
"""Map from a part of the patches to its touch, and the values of quantities (k,) by name."""


@one_torch_thread()
def collected(
    count: int,
    samples: int,
    press: Press,
    model: ModelName,
    mesh: int | None = None,
    most: int | None = None,
) -> TouchMeasures:
    """Press on patches batch by batch; fields as in `TouchMeasures`, without gradients.

    Args:
        count: number of patches.
        samples: n, of their sides.
        press: of a batch.
        model, mesh: as in `TouchMeasures`.
        most: samples of the maps that are kept; None for `MAP_SAMPLES`.
    """
    maps = np.empty((2, min(count, max(1, (most or MAP_SAMPLES) // samples**2)), samples, samples))
    values, fractions, bounds = [], [], []
    size = max(1, BATCH_SAMPLES // samples**2)
    for part in (slice(start, start + size) for start in range(0, count, size)):
        touch, of_part = press(part)
        # Maps beyond those that are kept are dropped here, and with them the gap.
        of_batch = torch.stack((touch.strain, touch.pressure)).detach().reshape(2, -1, samples, samples)
        maps[:, part] = of_batch[:, : len(maps[0, part])]
        values.append(of_part)
        fractions.append(each(touch.contact_fraction))
        bounds.append(float(touch.error_bound.max()))
    joined = {name: np.concatenate([of_part[name] for of_part in values]) for name in values[0]}
    none = np.zeros((0, samples**2))
    return TouchMeasures(model, mesh, joined, np.concatenate(fractions), maps[0], maps[1], none, max(bounds))


def each(value: torch.Tensor) -> Array:
    """(k,) of a quantity's values, of which one has no dimension."""
    return np.atleast_1d(value.detach().double().numpy())
