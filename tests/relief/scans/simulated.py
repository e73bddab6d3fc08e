"""Simulated scans: a design printed with a known blur and shrinkage, and scanned with known noise."""

from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter

from relief.ground.arrays import Array
from relief.relief import Relief
from relief.scans.blurred import DesignSpectrum, surface_of
from relief.scans.pose import Pose
from relief.scans.scans import Scan

FINEST = 2048
"""Most samples a side of a surface that is printed, unless the relief has more."""


@dataclass(frozen=True)
class Scanner:
    """What a scanner adds.

    Attributes:
        pitch_mm: distance of samples.
        size_mm: extents along y and x of what is scanned; None: the plate and a tenth of it around.
        noise_mm: standard deviation of the noise.
        noise_length_mm: standard deviation of the Gaussian that correlates the noise; 0: white.
        holes: share of the samples that are lost, in blobs.
        spikes: share of the samples that are off by many times the relief.
    """

    pitch_mm: float
    size_mm: tuple[float, float] | None = None
    noise_mm: float = 0.0
    noise_length_mm: float = 0.0
    holes: float = 0.0
    spikes: float = 0.0


def scanned(relief: Relief, pose: Pose, scanner: Scanner, random: np.random.Generator) -> Scan:
    """The scan of a print.

    Args:
        relief: the design, or what a printer's pixels and layers make of it.
        pose: how the print lies, with its blur and shrinkage.
        scanner: what it adds.
        random: for noise, holes and spikes.

    Returns:
        The scan, with holes beyond the rim of the print.
    """
    design = DesignSpectrum(surface_of(relief, FINEST), relief.width_mm, FINEST)
    high, wide = scanner.size_mm or (1.1 * side for side in design.size_mm)
    rows, cols = round(high / scanner.pitch_mm), round(wide / scanner.pitch_mm)
    scan = Scan(np.zeros((rows, cols)), scanner.pitch_mm, "simulated")
    x, y = pose.on_design(*np.meshgrid(*scan.axes_mm()))
    read = design.at(x.ravel(), y.ravel(), pose.variance_mm2).heights.reshape(rows, cols)
    values = pose.height_scale * read + pose.base(x, y)
    values += scanner.noise_mm * _noise((rows, cols), scanner.noise_length_mm / scanner.pitch_mm, random)
    if scanner.spikes:
        spiked = random.random((rows, cols)) < scanner.spikes
        values[spiked] += 10.0 * np.ptp(relief.heights) * random.standard_normal(np.count_nonzero(spiked))
    if scanner.holes:
        blobs = _noise((rows, cols), 3.0, random)
        values[blobs < np.quantile(blobs, scanner.holes)] = np.nan
    values[~design.inside(x, y)] = np.nan
    return Scan(values, scanner.pitch_mm, "simulated")


def _noise(shape: tuple[int, int], samples: float, random: np.random.Generator) -> Array:
    """Noise of variance 1, correlated by a Gaussian of this standard deviation in samples."""
    white = random.standard_normal(shape)
    if samples <= 0.0:
        return white
    smooth = gaussian_filter(white, samples, mode="wrap")
    return np.asarray(smooth / smooth.std())
