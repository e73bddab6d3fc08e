"""Bands of wavelength of the skin's surface: what roughness hardly sees and a sliding finger may feel.

Strain at the depth of the receptors has lost short waves: of one of 0.4 mm it keeps 1e-4, of one of 0.2 mm
1e-9. A finger that slides meets such waves as vibration of its *surface*, which follows the relief where it
touches and spans the hollows between. The displacement of that surface, and its change, are given by octaves
of wavelength, as root mean squares (`tactile.readouts.band_squares`), under a Hann window.

A wave as long as the patch has no place in such a window, so that bands end at 6.4 mm. Of a wave of a few
millimetres a few percent of the power count in the neighbouring band.
"""

import math

import numpy as np
import torch

from optimize.verification.verification import SurfaceBand
from relief.ground.arrays import Array
from tactile.readouts import band_squares

BANDS_MM = ((0.1, 0.2), (0.2, 0.4), (0.4, 0.8), (0.8, 1.6), (1.6, 3.2), (3.2, 6.4))
"""Least and greatest wavelength of each band, mm: octaves, the longest of which a patch of 10 mm holds."""
DETECTED_UM = ((0.040, 5.97), (0.231, 2.94), (0.602, 1.09))
"""Diameter of a raised dot on a smooth plate, mm, and the height from which people who actively touch it
detect it (d' of 1.35), um: Johansson and LaMotte 1983, Somatosensory Research 1, 21-31, means over subjects.
Standard deviations are 2.02, 1.19 and 0.19 um; an edge is detected from 0.85 um."""
MOST_SAMPLED = 256
"""Frequencies along an axis by which the share of a band that a grid holds is counted."""


def surface_bands(before: Array, after: Array, size_mm: float) -> tuple[SurfaceBand, ...]:
    """Bands of the skin's surface on patches of the original and of the result.

    Args:
        before, after: (k, n, n) surface of the skin over any plane, mm, at the same places.
        size_mm: side of a patch.

    Returns:
        The bands of which the grid holds anything and a patch has room for a wave, from short to long.
    """
    pitch = size_mm / before.shape[-1]
    bands = [band for band in BANDS_MM if band[1] > 2.0 * pitch / math.sqrt(2.0) and band[1] <= size_mm]
    initial, final, change = (_rms_um(fields, size_mm, bands) for fields in (before, after, after - before))
    return tuple(
        SurfaceBand(
            least_mm=band[0],
            most_mm=band[1],
            held=held_share(band, pitch),
            initial_um=initial[i],
            final_um=final[i],
            change_um=change[i],
            threshold_um=threshold_um(band),
        )
        for i, band in enumerate(bands)
    )


def threshold_um(band: tuple[float, float]) -> float:
    """Rms of a wave as high as the lowest dot of half its length that people detect on a smooth plate, um.

    Heights between those measured are interpolated by logarithms; beyond them the nearest counts. A wave of
    height h has an rms of h / (2 sqrt 2).

    Args:
        band: least and greatest wavelength, mm, of which the geometric mean counts.
    """
    diameters, heights = np.log(DETECTED_UM).T
    height = np.exp(np.interp(math.log(0.5 * math.sqrt(band[0] * band[1])), diameters, heights))
    return float(height) / math.sqrt(8.0)


def held_share(band: tuple[float, float], pitch_mm: float) -> float:
    """Share of a band's frequencies that a grid of some pitch, mm, holds in the plane, 0 to 1.

    Args:
        band: least and greatest wavelength, mm.
    """
    # In a quarter of the plane, the other ones being alike.
    along = (np.arange(MOST_SAMPLED) + 0.5) / (MOST_SAMPLED * band[0])
    radius = np.hypot(along[:, None], along)
    inside = (radius * band[0] <= 1.0) & (radius * band[1] > 1.0)
    held = along * 2.0 * pitch_mm <= 1.0
    return float((inside & held[:, None] & held).sum() / inside.sum())


def _rms_um(fields: Array, size_mm: float, bands: list[tuple[float, float]]) -> list[float]:
    """Rms of each band over all patches (k, n, n), um."""
    squares = band_squares(torch.as_tensor(fields), size_mm, bands).mean(0)
    return [1e3 * math.sqrt(square) for square in squares.tolist()]
