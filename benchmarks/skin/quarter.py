"""A round finger pressed on what is symmetric about both its axes: grooves, a sphere, a flat plate.

The pad is an elastic layer on a rigid bone, bounded by sliding sides; its roundness is subtracted from the
heights of what presses it. All is even about the middle of the patch, so that one quarter is solved, with as
many samples along each axis as that axis needs: 25 µm across grooves, 0.25 mm along them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.fft
import torch
from scipy.interpolate import CubicSpline
from torch import Tensor

from relief.ground.arrays import Array
from tactile.contact import Compliance, ContactError, Stop, approach_contact
from tactile.layer.layer_response import layer_response
from tactile.skin import Skin

HALF_MM = 8.0
"""Side of the quarter, half of that of the patch, mm. With patches of 24 instead of 16 mm, depths in grooves
differ by 0.5 to 1.4 %, forces on the sphere by 0.3 to 0.7 %."""
ALONG, ACROSS = 32, 320
"""Samples along and across grooves. With twice as many along, depths differ by 0.04 %. Across, where a sample
is 25 µm, depths fall by 0.6 to 1.7 % at twice and by 0.9 to 2.6 % at four times as many: first order."""
SIDE = 80
"""Samples a side of the quarter under a sphere, 0.1 mm: with half, twice and four times as many, forces
differ by 0.35, 0.13 and 0.13 % at most."""
TOLERANCES = (1e-5, 1e-3)
"""Residuals of the contact, the second where the first is not met in `STEPS` steps: fingers at the corners of
a prior, with a thin stiff layer over a soft base. Depths then differ by up to 1.5 % by where the solver
starts."""
STEPS = 150
"""Steps of the contact's solver to each residual; most fingers take 20 to 60."""
SYMBOL_NODES = 400
"""Wavenumbers at which the compliance is solved; between them lies a cubic spline in logarithms."""
FAR_MM = -20.0
"""Height of what is too low to touch, mm."""


@dataclass(frozen=True)
class QuarterLayer(Compliance):
    """Compliance of the layer for pressures that are even about both axes (..., rows, cols).

    Attributes:
        symbol: (rows, cols) compliance of the cosine modes, mm, at unit modulus of the base.
        half_mm: side of the quarter.
    """

    symbol: Tensor
    half_mm: float

    def displacement(self, pressure: Tensor) -> Tensor:
        """Normal displacement C p, mm."""
        return _transform(self.symbol * _transform(pressure, False), True)

    def precondition(self, residual: Tensor) -> Tensor:
        """The inverse of the compliance."""
        return _transform(_transform(residual, False) / self.symbol, True)


def _transform(field: Tensor, inverse: bool) -> Tensor:
    transform = scipy.fft.idctn if inverse else scipy.fft.dctn
    return torch.from_numpy(transform(field.numpy(), axes=(-2, -1), norm="ortho"))


def quarter_layer(skin: Skin, rows: int, cols: int, half_mm: float = HALF_MM) -> QuarterLayer:
    """The layer of a skin on a quarter of `rows` x `cols` samples."""
    waves = (np.pi / half_mm * np.arange(count) for count in (rows, cols))
    k = np.hypot(*np.meshgrid(*waves, indexing="ij"))
    least = np.pi / half_mm
    nodes = np.concatenate(([0.0], np.geomspace(least, 1.001 * k.max(), SYMBOL_NODES)))
    response = layer_response(nodes, skin.poisson_ratio, skin.thickness_mm, skin.depth_mm, skin.stack)
    spline = CubicSpline(np.log(nodes[1:]), np.log(response.surface[1:]))
    symbol = np.exp(spline(np.log(np.maximum(k, least))))
    return QuarterLayer(torch.as_tensor(np.where(k > 0.0, symbol, response.surface[0])), half_mm)


def _centres(samples: int, half_mm: float) -> Array:
    return np.asarray((np.arange(samples) + 0.5) * (half_mm / samples))


def _rise(skin: Skin, rows: int, cols: int, half_mm: float) -> Array:
    """(rows, cols) mm: how far the pad's surface lies above its lowest point."""
    if skin.radii_mm is None:
        return np.zeros((rows, cols))
    along, across = skin.radii_mm
    return _centres(rows, half_mm)[:, None] ** 2 / (2.0 * along) + _centres(cols, half_mm) ** 2 / (
        2.0 * across
    )


def _pressed(
    layer: QuarterLayer, heights: Array, force_over_modulus: float, start: Tensor | None = None
) -> tuple[Tensor, Tensor, float]:
    """Pressure (units of E), gap and descent (mm) of a quarter, by force over the base's modulus, mm²."""
    mean = force_over_modulus / (2.0 * layer.half_mm) ** 2
    for tolerance in TOLERANCES:
        state = approach_contact(
            layer, torch.as_tensor(heights), mean, start, STEPS, Stop(residual=tolerance)
        )
        if bool(state.converged):
            return state.pressure, state.gap, float(state.approach)
        start = None
    raise ContactError(f"contact not converged to {TOLERANCES[-1]:g} in {STEPS} steps")


def groove_depths(
    skin: Skin,
    widths_mm: tuple[float, ...],
    forces_n: tuple[float, ...],
    half_mm: float = HALF_MM,
    samples: tuple[int, int] = (ALONG, ACROSS),
    land_mm: float | None = None,
) -> Array:
    """(forces, widths) mm: how deep the pad sinks into the groove below its middle, under each force.

    Args:
        skin: the finger; its own force has no meaning here.
        widths_mm: of grooves, which run along the finger.
        forces_n: in rising order.
        half_mm: side of the quarter.
        samples: along and across the grooves.
        land_mm: width of the lands between grooves; None: as wide as the grooves.

    Returns:
        Depth of the pad's surface at the middle of the groove below the lands.
    """
    layer = quarter_layer(skin, *samples, half_mm)
    rise = _rise(skin, *samples, half_mm)
    depths = np.empty((len(forces_n), len(widths_mm)))
    for column, width in enumerate(widths_mm):
        period = width + (width if land_mm is None else land_mm)
        # Distance from the middle of the nearest groove; a sample is land where its middle is.
        offset = np.abs((_centres(samples[1], half_mm) / period + 0.5) % 1.0 - 0.5) * period
        heights = np.where(offset > 0.5 * width, 0.0, FAR_MM) - rise
        start = None
        for row, force in enumerate(forces_n):
            start, gap, _ = _pressed(layer, heights, force / skin.young_modulus_mpa, start)
            # The gap at the first sample counts from the groove's floor less the pad's rise there.
            depths[row, column] = -FAR_MM - float(gap[0, 0])
    return depths


def sphere_depths(
    skin: Skin,
    diameter_mm: float,
    forces_n: tuple[float, ...],
    half_mm: float = HALF_MM,
    side: int = SIDE,
) -> Array:
    """(forces) mm: how far a sphere is pushed into the pad since first touch; arguments as `groove_depths`.

    The sphere is a sphere and no paraboloid: a paraboloid takes 1 % more force at a depth of 0.5 mm, and 9 %
    more at 1.5 mm.
    """
    layer = quarter_layer(skin, side, side, half_mm)
    x = _centres(side, half_mm)
    square, radius = x[:, None] ** 2 + x**2, 0.5 * diameter_mm
    cap = np.sqrt(np.maximum(radius**2 - square, 0.0)) - radius
    heights = np.where(square < radius**2, cap, FAR_MM) - _rise(skin, side, side, half_mm)
    depths, start = [], None
    for force in forces_n:
        start, _, descent = _pressed(layer, heights, force / skin.young_modulus_mpa, start)
        depths.append(descent)
    return np.array(depths)


def sphere_forces(depths_mm: Array, forces_n: Array, at_mm: tuple[float, ...], first_n: float) -> Array:
    """Force (len(at_mm)) at depths that count from a force of `first_n`, between a curve's samples."""
    curve = CubicSpline(np.log(forces_n), np.log(depths_mm))
    first = float(np.exp(curve(np.log(first_n))))
    back = CubicSpline(np.log(depths_mm), np.log(forces_n))
    return np.asarray(np.exp(back(np.log(first + np.array(at_mm)))))


def flat_contact(
    skin: Skin, force_n: float, half_mm: float = HALF_MM, side: int = SIDE
) -> tuple[float, float, float]:
    """Area of contact with a flat plate (mm²), greatest pressure (MPa) and descent (mm)."""
    layer = quarter_layer(skin, side, side, half_mm)
    pressure, _, descent = _pressed(
        layer, -_rise(skin, side, side, half_mm), force_n / skin.young_modulus_mpa
    )
    touching = int((pressure > 0.0).sum())
    return (
        4.0 * touching * (half_mm / side) ** 2,
        float(pressure.max()) * skin.young_modulus_mpa,
        descent,
    )
