"""Robust least squares of a pose, and its covariance under correlated errors.

A sample of the scan is the blurred design at its point plus a residual: noise, layers, dirt. Steps are
Gauss-Newton's with Tukey's weights. Residuals of neighbours are correlated, so the usual covariance would be
too small: with derivatives J and influences e, it is H^-1 (J' C J) H^-1, where C is the
covariance of e between places (P. J. Huber, Robust Statistics, 1981, chapter 7; W. Newey and K. West,
Econometrica 55, 1987). C is taken to depend on the distance of places alone and comes from the influences.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from math import exp, hypot

import numpy as np
from numpy.typing import NDArray
from scipy.fft import irfft2, next_fast_len, rfft2

from relief.ground.arrays import Array
from relief.scans.blurred import Derivatives, DesignSpectrum
from relief.scans.pose import BOWS, NAMES, PLAIN, STRETCHES, Pose
from relief.scans.scans import MAD_TO_SIGMA, Scan

TUKEY = 6.0
"""Standard deviations beyond which a residual has no weight: the estimator then has 98 % of the efficiency of
least squares under normal residuals."""
MOST_STEPS = 30
"""Most steps; from a coarse pose 5 to 10 are taken."""
DONE = 1e-3
"""Change of every number, in standard deviations, below which a fit ends."""
LONGEST_CORRELATION = 0.25
"""Farthest distance, in sides of the scan, over which errors are taken to be correlated: beyond, the few
independent parts of a scan give no estimate."""
LEAST_SPREAD = 1e-3
"""Least spread of the residuals, in ranges of the heights of the print: where most of an exact scan is flat,
half of its residuals are 0, and all the others would be outliers."""
FEWEST = 100
"""Fewest samples on the design of which a pose is fitted."""
PRIOR = {
    "turn": 0.3,
    "log_scale": 0.05,
    "shift_x_mm": 0.1,
    "shift_y_mm": 0.1,
    "variance_mm2": 4e-4,
    "height_scale": 1.0,
    "stretch": 0.05,
    "skew": 0.05,
}
"""Standard deviations of what is known before all numbers are fitted: no blur, and the others as they are at
the start of the fit. Shifts are in sides of the design, variance in squared sides, height in its own start.
This prior decides what the scan leaves open, as a shift along ridges, and nothing else."""
OPEN = 0.1
"""Share of its deviation before, from which on a number counts as one that the scan does not determine."""
MODEL_ERROR, SHARED = 0.01, 20.0
"""Error of the model in heights of the relief, and samples that share an error: they are the weight of the
prior beside that of the samples. Without them a checkered relief, which determines no blur, came out at a
fortieth of its height."""
LEAST_RIM = 0.02
"""Least width of the rim that is left out, in sides of the design: four blurs of 50 um at 10 mm."""
NEARLY_WHOLE = 0.98
"""Overlap that is as good as whole: the rim of a print is rounded."""


@dataclass(frozen=True, eq=False)
class Fit:
    """A pose and its covariance.

    Attributes:
        pose: how the print lies.
        residuals: (rows, cols) mm, heights of the scan less the model; NaN off the design and in holes.
        outliers: (rows, cols), samples without weight.
        correlation: of model and scan over the samples with weight, each weighted; -1 to 1.
        spread_mm: robust standard deviation of the residuals.
        overlap: share that the samples on the plate have of all the scan's, or of those that the whole plate
            would have if these are fewer.
        box_mm: least and greatest x, and y, of the design between which the samples lie.
        known: (n,) inverse variances of the numbers of the pose beforehand; 0: nothing is known.
        computed: the covariance, computed at its first use, as a search needs none.
    """

    pose: Pose
    residuals: Array
    outliers: NDArray[np.bool_]
    correlation: float
    spread_mm: float
    overlap: float
    box_mm: tuple[tuple[float, float], tuple[float, float]]
    known: Array
    computed: Callable[[], Array]

    @cached_property
    def covariance(self) -> Array:
        """(n, n) of the numbers of the pose, in the order of `NAMES`."""
        return self.computed()

    @property
    def undetermined(self) -> tuple[str, ...]:
        """Names of numbers that the scan does not determine; their intervals are those known before."""
        open_ = np.diag(self.covariance) * self.known > OPEN**2
        return tuple(name for name, each in zip(NAMES, open_, strict=True) if each)

    def bow(self, x: Array, y: Array) -> Array:
        """The bow at points of the design, mm; beyond the samples it goes on level."""
        return self.pose.bow(*(np.clip(each, *ends) for each, ends in zip((x, y), self.box_mm, strict=True)))

    @property
    def stretch(self) -> tuple[float, float]:
        """The greatest scale along a direction over the least, less 1, and its standard deviation."""
        size = hypot(self.pose.stretch, self.pose.skew)
        slopes = np.array([self.pose.stretch, self.pose.skew]) / max(size, np.finfo(float).tiny)
        grown = exp(2.0 * size)
        return grown - 1.0, 2.0 * grown * self._sigma(STRETCHES, slopes)

    @property
    def sag_mm(self) -> tuple[float, float]:
        """Height of the bow between its highest and lowest point, and its standard deviation."""
        x, y = (each.ravel() for each in np.meshgrid(*(np.linspace(*ends, 9) for ends in self.box_mm)))
        bow = self.pose.bow(x, y)
        high, low = int(np.argmax(bow)), int(np.argmin(bow))
        terms = np.stack([x**2, x * y, y**2])
        return float(bow[high] - bow[low]), self._sigma(BOWS, terms[:, high] - terms[:, low])

    def _sigma(self, names: tuple[str, ...], slopes: Array) -> float:
        """Standard deviation of a function of some numbers, by its derivatives."""
        places = [NAMES.index(name) for name in names]
        variance = float(slopes @ self.covariance[np.ix_(places, places)] @ slopes)
        return float(np.sqrt(max(variance, 0.0)))

    @property
    def quality(self) -> float:
        """Correlation, less where a part of the smaller of plate and scan lies off the other."""
        return self.correlation * float(np.sqrt(min(1.0, self.overlap / NEARLY_WHOLE)))

    def sigma(self, name: str) -> float:
        """Standard deviation of a number of the pose."""
        return self._sigma((name,), np.ones(1))


class LostError(ValueError):
    """The scan and the design do not overlap at a pose."""


def fit(
    design: DesignSpectrum,
    scan: Scan,
    start: Pose,
    free: Sequence[str] = PLAIN,
    steps: int = MOST_STEPS,
    robust: bool = True,
) -> Fit:
    """Fit a pose to a scan.

    Args:
        design: of the print.
        scan: of the print.
        start: a pose near the true one: within about half of the finest detail that both show.
        free: numbers of the pose that are fitted; the others stay.
        steps: most steps.
        robust: whether outliers are those of most residuals, and `PRIOR` is known beforehand. Without,
            nothing is, and outliers are six times the root mean square of all residuals.

    Raises:
        LostError: scan and design do not overlap.
    """
    samples = _Samples(design, scan, np.isin(NAMES, free), robust)
    middle, precision = _prior(start, design, samples.free & robust)
    numbers = start.array()
    state = samples.at(Pose.of(numbers))
    for _ in range(steps):
        jacobian, known = state.jacobian, state.alike_mm2 * precision
        hessian = jacobian.T @ (state.weights[:, None] * jacobian) + np.diag(known[samples.free])
        gradient = jacobian.T @ (state.weights * state.residuals)
        gradient += (known * (middle - numbers))[samples.free]
        step = np.zeros(len(numbers))
        step[samples.free] = _solve(hessian, gradient)
        numbers = numbers + _bounded(step, design)
        state = samples.at(Pose.of(numbers))
        deviations = state.spread_mm / np.sqrt(np.maximum(np.diag(hessian), np.finfo(float).tiny))
        if np.all(np.abs(step[samples.free]) <= DONE * deviations):
            break
    return state.ended(samples, precision)


def _prior(start: Pose, design: DesignSpectrum, free: NDArray[np.bool_]) -> tuple[Array, Array]:
    """What is known of the numbers of a pose beforehand: (n,) middles, and inverse variances."""
    side, height = max(design.size_mm), max(abs(start.height_scale), 1e-9)
    units = {"shift_x_mm": side, "shift_y_mm": side, "variance_mm2": side**2, "height_scale": height}
    deviations = [PRIOR.get(name, np.inf) * units.get(name, 1.0) for name in NAMES]
    return replace(start, variance_mm2=0.0).array(), free * np.array(deviations) ** -2.0


def _solve(hessian: Array, gradient: Array) -> Array:
    """The step; directions that the scan does not determine have no step."""
    units = np.sqrt(np.maximum(np.diag(hessian), np.finfo(float).tiny))
    scaled = hessian / units / units[:, None]
    return np.asarray(np.linalg.lstsq(scaled, gradient / units, rcond=1e-10)[0] / units)


def _bounded(step: Array, design: DesignSpectrum) -> Array:
    """The step, shortened so that no point moves by more than a twentieth of the plate."""
    size = max(design.size_mm)
    moves = dict(zip(NAMES, np.abs(step), strict=True))
    across = max(moves[name] for name in ("turn", "log_scale", *STRETCHES))
    farthest = max(0.5 * size * across, moves["shift_x_mm"], moves["shift_y_mm"]) / (0.05 * size)
    return step / max(1.0, farthest)


@dataclass(frozen=True, eq=False)
class _State:
    """Residuals and derivatives by the free numbers at one pose, of the samples that lie on the design."""

    pose: Pose
    places: NDArray[np.intp]
    residuals: Array
    jacobian: Array
    values: Array
    model: Array
    spread_mm: float
    box_mm: tuple[tuple[float, float], tuple[float, float]]

    @property
    def alike_mm2(self) -> float:
        """Variance of an error that all of a part of the samples share, of noise and of the model."""
        return SHARED * (self.spread_mm**2 + (MODEL_ERROR * float(np.std(self.model))) ** 2)

    @property
    def ratios(self) -> Array:
        return np.minimum(np.square(self.residuals / (TUKEY * self.spread_mm)), 1.0)

    @property
    def weights(self) -> Array:
        """Tukey's, 0 to 1."""
        return np.square(1.0 - self.ratios)

    def ended(self, samples: "_Samples", known: Array) -> Fit:
        residuals, outliers = np.full((2, samples.size), np.nan)
        residuals[self.places], outliers[self.places] = self.residuals, self.weights <= 0.0
        return Fit(
            self.pose,
            residuals.reshape(samples.shape),
            outliers.reshape(samples.shape) > 0.0,
            _correlation(self.values, self.model, self.weights),
            self.spread_mm,
            samples.overlap(self.pose),
            self.box_mm,
            known,
            partial(self._covariance, samples, known),
        )

    def _covariance(self, samples: "_Samples", precision: Array) -> Array:
        """(n, n) of all numbers of the pose, 0 of those that are not free."""
        # Tukey's influence falls off, so the mean of its derivative is less than that of the weights.
        slope = float(np.mean((1.0 - self.ratios) * (1.0 - 5.0 * self.ratios)))
        covariance, jacobian = np.zeros((len(NAMES), len(NAMES))), self.jacobian
        known = self.alike_mm2 * np.diag(precision[samples.free])
        inverse = np.linalg.pinv(slope * jacobian.T @ jacobian + known, hermitian=True)
        middle = samples.correlated(self.places, self.weights * self.residuals, jacobian)
        covariance[np.ix_(samples.free, samples.free)] = inverse @ (middle + self.alike_mm2 * known) @ inverse
        return covariance


class _Samples:
    """The measured samples of a scan, and the model of them at a pose."""

    def __init__(self, design: DesignSpectrum, scan: Scan, free: NDArray[np.bool_], robust: bool) -> None:
        self._design, self.free, self._robust = design, free, robust
        self.shape, self.size = scan.heights.shape, scan.heights.size
        self._places = np.flatnonzero(scan.measured)
        x, y = (axis.ravel()[self._places] for axis in np.meshgrid(*scan.axes_mm()))
        self._x, self._y, self._heights = x, y, scan.heights.ravel()[self._places]
        self.count, self._pitch_mm = len(self._places), scan.pitch_mm

    def _margin_mm(self, pose: Pose) -> float:
        """Width of the rim of the design that is left out, mm: at the rim a print is rounded.

        What a model without blur has there would else fix the shift along slanted ridges.
        """
        blur_mm = float(np.sqrt(max(pose.variance_mm2, 0.0)))
        side_mm = min(self._design.size_mm)
        return min(max(LEAST_RIM * side_mm, self._design.pitch_mm + 3.0 * blur_mm), 0.1 * side_mm)

    def overlap(self, pose: Pose) -> float:
        """Share of the smaller of plate and scan that lies on the other."""
        of_plate = float(np.prod(self._design.size_mm)) * (pose.scale / self._pitch_mm) ** 2
        on_plate = np.count_nonzero(self._design.inside(*pose.on_design(self._x, self._y)))
        return float(on_plate / max(1.0, min(self.count, of_plate)))

    def at(self, pose: Pose) -> _State:
        x, y = pose.on_design(self._x, self._y)
        inside = self._design.inside(x, y, self._margin_mm(pose))
        x, y, heights = x[inside], y[inside], self._heights[inside]
        if len(x) < FEWEST:
            raise LostError(f"{len(x)} samples of the scan lie on the design")
        model = self._design.at(x, y, pose.variance_mm2, self._pitch_mm)
        base, shape = pose.base(x, y), pose.height_scale * model.heights
        columns = _derivatives(pose, x, y, model)
        jacobian = np.stack([columns[place] for place in np.flatnonzero(self.free)], axis=-1)
        residuals = heights - shape - base
        centre = np.median(residuals)
        # Of dots on a floor the median sees the floor alone, and dots of another height are outliers.
        spread = MAD_TO_SIGMA * float(np.median(np.abs(residuals - centre)))
        spread = spread if self._robust else float(np.sqrt(np.mean(residuals**2)))
        least = LEAST_SPREAD * float(np.ptp(shape)) + np.finfo(float).tiny
        return _State(
            pose,
            self._places[inside],
            residuals,
            jacobian,
            heights - base,
            shape,
            max(spread, least),
            ((float(x.min()), float(x.max())), (float(y.min()), float(y.max()))),
        )

    def correlated(self, places: NDArray[np.intp], influences: Array, jacobian: Array) -> Array:
        """J' C J for influences (n,) and derivatives (n, k) at places (n,) of the scan."""
        rows, cols = self.shape
        lags = [max(2, round(LONGEST_CORRELATION * side)) for side in self.shape]
        shape = [next_fast_len(side + lag, real=True) for side, lag in zip(self.shape, lags, strict=True)]

        def spectrum(values: Array) -> Array:
            grid = np.zeros(rows * cols)
            grid[places] = values
            return np.asarray(rfft2(grid.reshape(rows, cols), shape))

        pairs = irfft2(np.abs(spectrum(np.ones(len(places)))) ** 2, shape)
        products = irfft2(np.abs(spectrum(influences - influences.mean())) ** 2, shape)
        # Without a pair of samples at a distance there is no estimate.
        covariance = np.where(pairs > 0.5, products / np.maximum(pairs, 1.0), 0.0)
        covariance *= _window(shape[0], lags[0])[:, None] * _window(shape[1], lags[1])
        density = rfft2(covariance, shape).real
        columns = [spectrum(column) for column in jacobian.T]
        return _weighted_products(columns, np.maximum(density, 0.0), shape)


def _derivatives(pose: Pose, x: Array, y: Array, model: Derivatives) -> list[Array]:
    """Derivatives of the heights at fixed points of the scan by each number, at points of the design."""
    slope_x = pose.height_scale * model.along_x + pose.tilt_x + 2.0 * pose.bow_xx * x + pose.bow_xy * y
    slope_y = pose.height_scale * model.along_y + pose.tilt_y + 2.0 * pose.bow_yy * y + pose.bow_xy * x
    # Slopes along the axes of a print that is stretched but not turned, and the points there.
    on_x, on_y = pose.unstretched(slope_x, slope_y)
    grown, shrunk = np.exp(pose.stretch), np.exp(-pose.stretch)
    at_x, at_y = grown * x + pose.skew * y, pose.skew * x + shrunk * y
    c, s = np.cos(pose.turn) / pose.scale, np.sin(pose.turn) / pose.scale
    return [
        on_x * at_y - on_y * at_x,
        -(slope_x * x + slope_y * y),
        -c * on_x + s * on_y,
        -s * on_x - c * on_y,
        pose.height_scale * model.by_variance,
        model.seen,
        np.ones(len(x)),
        x,
        y,
        shrunk * on_y * y - grown * on_x * x,
        -(on_x * y + on_y * x),
        x**2,
        x * y,
        y**2,
    ]


def _window(length: int, lag: int) -> Array:
    """Parzen's window of lags along an axis, whose spectrum is nowhere negative: (length,)."""
    away = np.minimum(np.arange(length), length - np.arange(length)) / lag
    inner = 1.0 - 6.0 * away**2 + 6.0 * away**3
    return np.where(away <= 0.5, inner, 2.0 * np.maximum(1.0 - away, 0.0) ** 3)


def _weighted_products(columns: list[Array], density: Array, shape: list[int]) -> Array:
    """(k, k) products of columns by their spectra, weighted by a density, over all wave numbers."""
    # Of the real transform each column but the first and a middle one stands for two.
    twice = np.full(density.shape[1], 2.0)
    twice[0] = 1.0
    if shape[1] % 2 == 0:
        twice[-1] = 1.0
    weights = density * twice / (shape[0] * shape[1])
    products = np.empty((len(columns), len(columns)))
    for one, first in enumerate(columns):
        weighted = np.conj(first) * weights
        for other, second in enumerate(columns[: one + 1]):
            products[one, other] = products[other, one] = float(np.vdot(np.conj(weighted), second).real)
    return products


def _correlation(values: Array, model: Array, weights: Array) -> float:
    """Weighted correlation coefficient of two sets of numbers."""
    total = max(float(weights.sum()), np.finfo(float).tiny)
    one = values - (weights @ values) / total
    other = model - (weights @ model) / total
    norm = np.sqrt((weights @ one**2) * (weights @ other**2))
    return float((weights * one) @ other / norm) if norm > 0.0 else 0.0
