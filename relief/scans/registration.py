"""Registration: the pose of a print in its scan, and measures of the print, with intervals."""

from dataclasses import dataclass
from math import atan, degrees, hypot, log, sqrt

import numpy as np
from scipy.ndimage import map_coordinates

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.progress import stage
from relief.relief import Relief
from relief.scans.blurred import DesignSpectrum, samples_mm, surface_of
from relief.scans.distortions import SURE, refined
from relief.scans.matching import another_plate, check_print, find_print
from relief.scans.pose import Pose
from relief.scans.pose_fitting import TUKEY, Fit, LostError
from relief.scans.scans import Scan

NORMAL_95 = 1.959964
"""Standard deviations of a normal distribution on either side that hold 95 %."""
WORKING_SIDE = 600
"""Most samples a side of a scan on which a pose is fitted; finer ones are averaged in blocks."""
DESIGN_SIDE, MOST_SIDE = 512, 1024
"""Samples a side with which the surface of the design is held, and most where the design has more."""
UNITS_APART = (1e-3, 0.1, 1.0 / 25.4, 10.0, 25.4, 1000.0)
"""Ratios of lengths in different units: um, cm, inches and metres for mm."""
UNIT_MARGIN = 1.6
"""Largest factor between a ratio of lengths and one of `UNITS_APART` that still suggests another unit."""
LEAST_SEEN, MOST_SEEN = 0.2, 4.0
"""Least and greatest side of the scan in sides of the design."""
LEAST_HEIGHT, MOST_HEIGHT = 0.2, 5.0
"""Least and greatest height of the print over that of the design; beyond, the scan is in another unit."""


@dataclass(frozen=True)
class Interval:
    """A number that was measured, with the ends of an interval that holds the truth with 95 %."""

    value: float
    low: float
    high: float

    @classmethod
    def about(cls, value: float, sigma: float) -> "Interval":
        """The interval of a normal distribution."""
        return cls(value, value - NORMAL_95 * sigma, value + NORMAL_95 * sigma)

    def times(self, factor: float) -> "Interval":
        """The interval of a multiple of the number, by a factor above 0."""
        return Interval(factor * self.value, factor * self.low, factor * self.high)

    def holds(self, truth: float) -> bool:
        """Whether a value lies within."""
        return self.low <= truth <= self.high

    def as_json(self, name: str) -> dict[str, float]:
        """Value and ends by `name`, `name_low` and `name_high`."""
        return {name: self.value, f"{name}_low": self.low, f"{name}_high": self.high}


@dataclass(frozen=True, eq=False)
class Registration:
    """A scan registered to its design.

    Attributes:
        scan: as read.
        design: what was printed.
        surface: the design on the samples with which the pose was fitted.
        fitted: the pose, its covariance and the residuals, on the samples of `working`.
        working: the scan on the samples on which the pose was fitted.
        rivals: other ways in which the scan fits its design as well, such as "mirrored".
        distorted: a fit with stretch and bow, whether or not these are significant.
        left_out: a line for each cause for which samples of the scan were left out.
    """

    scan: Scan
    design: Relief
    surface: DesignSpectrum
    fitted: Fit
    working: Scan
    distorted: Fit
    left_out: tuple[str, ...]
    rivals: tuple[str, ...]

    @property
    def pose(self) -> Pose:
        """How the print lies."""
        return self.fitted.pose

    @property
    def turned_degrees(self) -> Interval:
        """Turn of the print in the scan, counter-clockwise."""
        return Interval.about(degrees(self.pose.turn), degrees(self.fitted.sigma("turn")))

    @property
    def shift_x_mm(self) -> Interval:
        """Shift of the middle of the print from the middle of the scan's file, to the right."""
        return Interval.about(self.pose.shift_x_mm, self.fitted.sigma("shift_x_mm"))

    @property
    def shift_y_mm(self) -> Interval:
        """Shift of the middle of the print from the middle of the scan's file, upward."""
        return Interval.about(self.pose.shift_y_mm, self.fitted.sigma("shift_y_mm"))

    @property
    def scale(self) -> Interval:
        """Lengths of the print in the plane over those of the design."""
        sigma = self.pose.scale * self.fitted.sigma("log_scale")
        return Interval.about(self.pose.scale, sigma)

    @property
    def stretch_percent(self) -> Interval:
        """How much longer lengths along one direction have become than across, %."""
        return _size(*self.distorted.stretch).times(100.0)

    @property
    def sag_mm(self) -> Interval:
        """Height of the bow between its highest and lowest measured point."""
        return _size(*self.distorted.sag_mm)

    @property
    def height_scale(self) -> Interval:
        """Heights of the print over those of the design blurred alike."""
        return Interval.about(self.pose.height_scale, self.fitted.sigma("height_scale"))

    @property
    def blur_mm(self) -> Interval:
        """Standard deviation of the Gaussian blur of printer and scanner together, mm."""
        # Means of blocks and the reading of the file have blurred the scan too.
        added = self._working_mm2 + self.scan.variance_mm2 / self.pose.scale**2
        variance = self.pose.variance_mm2 - added
        sigma = self.fitted.sigma("variance_mm2")
        ends = (sqrt(max(0.0, variance + times * sigma)) for times in (0.0, -NORMAL_95, NORMAL_95))
        return Interval(*ends)

    @property
    def tilted_degrees(self) -> float:
        """Angle between the plate and the plane of the scan."""
        return degrees(atan(hypot(self.pose.tilt_x, self.pose.tilt_y)))

    def levelled(self, outlier: float = TUKEY) -> tuple[Array, Array]:
        """The print on the samples of the design.

        Deviations are interpolated between the samples of the scan, and added to the blurred design: direct
        interpolation would smooth the heights.

        Args:
            outlier: standard deviations of the residuals beyond which a sample is left out.

        Returns:
            Heights (rows, cols) mm, at the level of the design, without tilt and bow, and the deviations from
            the design as blurred; both NaN where nothing was measured, or outliers were.
        """
        # Blocks no finer than the design, so that each of its samples has their mean.
        times = max(1, int(self.design.pitch_mm * self.pose.scale / self.scan.pitch_mm))
        scan = self.scan.averaged(times)
        x, y = self.pose.on_design(*np.meshgrid(*scan.axes_mm()))
        left = scan.heights - self.pose.base(x, y) - self._model(x, y, self._blocks_mm2(times))
        left[~self.surface.inside(x, y) | (np.abs(left) > outlier * self.fitted.spread_mm)] = np.nan
        deviations = _between_holes(left, scan.places(*self.pose.on_scan(*samples_mm(self.design))))
        return deviations + self.model(), deviations

    def bow(self) -> Array:
        """The bow (rows, cols) mm on the samples of the design, about its mean; 0 if not significant."""
        bow = self.fitted.bow(*samples_mm(self.design))
        return bow - float(bow.mean())

    def model(self) -> Array:
        """The design (rows, cols) mm, blurred and scaled in height as the print is."""
        return self._model(*samples_mm(self.design), 0.0) + self.surface.level_mm

    def _model(self, x: Array, y: Array, added_mm2: float) -> Array:
        """The print at points of the design, about its mean, blurred further by a variance in the scan."""
        variance = self.pose.variance_mm2 - self._working_mm2 + added_mm2 / self.pose.scale**2
        heights = self.surface.at(x.ravel(), y.ravel(), variance).heights
        return np.asarray(self.pose.height_scale * heights.reshape(x.shape))

    def _blocks_mm2(self, times: int) -> float:
        """Variance of the blur by blocks of samples of the scan."""
        return (times**2 - 1) / 12.0 * self.scan.pitch_mm**2

    @property
    def _working_mm2(self) -> float:
        """Variance of the blur by the blocks of the working scan, in the plane of the design."""
        return self._blocks_mm2(round(self.working.pitch_mm / self.scan.pitch_mm)) / self.pose.scale**2


def _between_holes(values: Array, places: Array) -> Array:
    """Values (rows, cols) at places (2, ...) of their grid, linear between samples.

    Beside holes values are weighted means of the measured samples; NaN where these have less than half of the
    weight.
    """
    measured = np.isfinite(values)
    there = map_coordinates(measured.astype(np.float64), places, order=1, cval=0.0)
    read = map_coordinates(np.where(measured, values, 0.0), places, order=1, cval=0.0)
    return np.where(there >= 0.5, read / np.maximum(there, 0.5), np.nan)


def register(scan: Scan, design: Relief) -> Registration:
    """Register a scan to its design.

    Args:
        scan: of a print.
        design: what was printed; its rim is one, whether or not it is a tile.

    Raises:
        InputError: the scan is of another plate, mirrored, upside down or in another unit.
    """
    if float(np.ptp(design.heights)) <= 0.0:
        raise InputError(f"{scan.name}: cannot be laid on {design.name}, which is flat")
    _check_size(scan, max(design.surface.size_mm))
    side = min(MOST_SIDE, max(DESIGN_SIDE, *design.heights.shape))
    surface = DesignSpectrum(surface_of(design, side), design.width_mm, side)
    working = scan.averaged(-(-max(scan.heights.shape) // WORKING_SIDE))
    start, rivals = find_print(surface, working)
    with stage("fitting the pose"):
        try:
            scan, fitted, working, distorted, left_out = refined(surface, scan, working, start)
            check_print(surface, working, fitted)
        except LostError:
            raise another_plate(scan, 0.0) from None
    _check_heights(fitted, scan.name)
    return Registration(scan, design, surface, fitted, working, distorted, left_out, rivals)


def _size(value: float, sigma: float) -> Interval:
    """The interval of a size, which is above 0 by chance."""
    low = value - NORMAL_95 * sigma if value > SURE * sigma else 0.0
    return Interval(value, low, value + NORMAL_95 * sigma)


def _check_size(scan: Scan, size_mm: float) -> None:
    """Raise InputError for a scan whose size suggests another unit, or that is far too small or large."""
    ratio = max(scan.size_mm) / size_mm
    sizes = f"{scan.name}: measures {max(scan.size_mm):.4g} mm, and its design {size_mm:.4g} mm"
    unit = next((unit for unit in UNITS_APART if abs(log(ratio / unit)) < log(UNIT_MARGIN)), None)
    if LEAST_SEEN <= ratio <= MOST_SEEN:
        return
    if unit is None:
        raise InputError(f"{sizes}; cut the scan to the plate, or state its size or unit")
    asked = f"{ratio:.3g} times as much; is the scan in another unit? State"
    raise InputError(f"{sizes}: {asked} units or size_mm", f"{sizes}: {asked} --units or --size-mm")


def _check_heights(fitted: Fit, name: str) -> None:
    """Raise InputError for heights in another unit."""
    height = fitted.pose.height_scale
    if not LEAST_HEIGHT <= height <= MOST_HEIGHT:
        wrong = f"{name}: its heights are {height:.3g} times those of the design; state"
        raise InputError(f"{wrong} height_scale or units", f"{wrong} --height-scale or --units")
