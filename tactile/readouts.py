"""Read-outs of a press beside roughness and contact area: reported where asked for, never optimised.

Each says by another measure how rough a surface may feel: what a source names, taken of the same press, with
no constant fitted here. All are 0 on a flat plate. With fields f, weights w of the samples and the discrete
Fourier transform F of w (f - mean by w), the waves of a field within a band of wavelength have

    rms² = sum of |F|² over the frequencies of the band / (n² sum of w²) on n x n samples.

Weights are a Hann window over the patch under a flat finger; under a round one they fall from 1 to 0 like
cos² from the middle to the edge of what it touches of a flat plate, whose skin a flat plate leaves flat. So a
round finger's own shape counts only where a texture holds the skin off the plate. On a curved object what
the finger leaves untouched counts, too, in waves and contact image.

Of a wave of a few millimetres some percent of the power count in the neighbouring band.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import torch
from torch import Tensor

from tactile.pressing import OUT_OF_REACH_MM
from tactile.touch import Touch

Band = tuple[float, float]
"""Least and greatest wavelength, mm."""


@dataclass(frozen=True)
class ReadOut:
    """A number of a press.

    Attributes:
        name: key in JSON.
        label, unit: for the screen; the unit may be empty.
        decimals: digits behind the point on the screen.
        source: who takes this measure for roughness, and what of it had to be chosen here.
        value: from a touch and its heights (..., n, n), mm, to the numbers (...), without gradient.
    """

    name: str
    label: str
    unit: str
    decimals: int
    source: str
    value: Callable[[Touch, Tensor], Tensor]


def band_squares(
    fields: Tensor, size_mm: float, bands: Sequence[Band], weights: Tensor | None = None
) -> Tensor:
    """(..., bands) mean squares of the waves of fields (..., n, n) within bands; the formula is at the top.

    Args:
        fields: of any unit.
        size_mm: their side.
        bands: of wavelength.
        weights: (n, n) or (..., n, n), 0 towards the edges; None: a Hann window.
    """
    n = fields.shape[-1]
    if weights is None:
        line = torch.sin(math.pi * (torch.arange(n, dtype=fields.dtype) + 0.5) / n).square()
        weights = line[:, None] * line
    middle = (fields * weights).sum((-2, -1), keepdim=True) / weights.sum((-2, -1), keepdim=True)
    power = torch.fft.fft2((fields - middle) * weights).abs().square()
    frequency = torch.fft.fftfreq(n, size_mm / n, dtype=fields.dtype)
    radius = torch.hypot(frequency[:, None], frequency)
    total = n**2 * weights.square().sum((-2, -1))
    inside = [(radius * least <= 1.0) & (radius * most > 1.0) for least, most in bands]
    return torch.stack([(power * band).sum((-2, -1)) / total for band in inside], -1)


def contact_spectrum(touch: Touch, heights: Tensor) -> Tensor:
    """(...) rms of the waves of 1 to 10 mm of the contact image, 1 where skin bears pressure and else 0.

    The source weighs spatial frequencies of 0.1 to 1 per mm (its abstract prints "mm", of plates whose waves
    are 2 to 5 mm long) by fitted weights, at 1 to 3 N. The weights could not be read, so that all of the band
    weighs the same here, at the finger's own force.
    """
    return _rms((touch.pressure.detach() > 0.0).to(heights.dtype), touch, (1.0, 10.0))


def surface_waves(touch: Touch, heights: Tensor, band: Band) -> Tensor:
    """(...) rms of the waves of the skin's surface within a band, um; that surface is relief plus gap."""
    # As in `Press`: where a round finger has nothing below, the gap is measured from this depth.
    lowest = heights.detach().amax((-2, -1), keepdim=True) - OUT_OF_REACH_MM
    return 1e3 * _rms(touch.gap.detach() + torch.maximum(heights.detach(), lowest), touch, band)


def strain_mean(touch: Touch, heights: Tensor) -> Tensor:
    """(...) mean compressive strain at the receptors that count, over the flat plate's."""
    return -_mean(touch.strain.detach(), touch)


def strain_deviation(touch: Touch, heights: Tensor) -> Tensor:
    """(...) standard deviation of the strain over the receptors that count."""
    strain = touch.strain.detach()
    return _mean((strain - _mean(strain, touch)[..., None, None]).square(), touch).sqrt()


def _mean(field: Tensor, touch: Touch) -> Tensor:
    """(...) mean of a field (..., n, n) over the receptors that count."""
    counted = torch.ones_like(field) if touch.receptors is None else touch.receptors.expand_as(field)
    return (field * counted).sum((-2, -1)) / counted.sum((-2, -1))


def _rms(field: Tensor, touch: Touch, band: Band) -> Tensor:
    """(...) rms of the waves of a field (..., n, n) within a band."""
    return band_squares(field, touch.size_mm, [band], _weights(touch.receptors))[..., 0].sqrt()


def _weights(receptors: Tensor | None) -> Tensor | None:
    """Weights as at the top on the receptors (..., n, n) that a round finger touches; None of a flat one."""
    if receptors is None:
        return None
    n = receptors.shape[-1]
    at = torch.arange(n, dtype=receptors.dtype)
    squares = []
    for axis in (-1, -2):
        share = receptors.sum(axis) / receptors.sum((-2, -1))[..., None]
        away = at - (share * at).sum(-1, keepdim=True)
        # An ellipse's variance along an axis is a quarter of its half axis squared.
        squares.append(away.square() / (4.0 * (share * away.square()).sum(-1, keepdim=True)))
    radius = (squares[0][..., :, None] + squares[1][..., None, :]).sqrt().clamp_max(1.0)
    return torch.cos(0.5 * math.pi * radius).square() * receptors


WEIGHED = "rms; after Yanwari and Okamoto 2025, doi 10.3390/s25082598 (abstract), without their weights"
OWN = "rms; as touch.surface_bands of a run, by no published model of roughness"
RATE = "SA1 rates follow compressive strain: Phillips and Johnson 1981, doi 10.1152/jn.1981.46.6.1204"
VARIANCE = "of SA1 rates: Connor et al. 1990, doi 10.1523/JNEUROSCI.10-12-03823.1990 (abstract)"
FINE, COARSE = partial(surface_waves, band=(0.2, 0.8)), partial(surface_waves, band=(0.8, 3.2))
"""Waves that the strain at the receptors' depth has mostly lost, from where 128 samples over 10 mm hold a
whole band; and waves that it keeps."""

_ROWS = (
    ReadOut("contact_spectrum", "contact image, 1 to 10 mm", "", 3, WEIGHED, contact_spectrum),
    ReadOut("surface_fine_um", "waves of the skin, 0.2 to 0.8 mm", "µm", 1, OWN, FINE),
    ReadOut("surface_coarse_um", "waves of the skin, 0.8 to 3.2 mm", "µm", 1, OWN, COARSE),
    ReadOut("strain_mean", "mean compressive strain", "", 4, RATE, strain_mean),
    ReadOut("strain_deviation", "standard deviation of strain", "", 4, VARIANCE, strain_deviation),
)
READ_OUTS = {one.name: one for one in _ROWS}
"""Read-outs by name. Roughness V is none of them."""
