"""Numbers of printing: the prints of original and result beside the original's design."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from optimize.descent.problem import Problem
from optimize.settings.run_file import Run
from optimize.verification.picture_change import percent_of
from optimize.verification.picture_metrics import pixel_weights, pixels_per_degree
from optimize.verification.verification import DesignNumbers, Faults, PrintNumbers
from relief.ground.arrays import Array
from relief.ground.progress import stage
from relief.printed import faults, on_pixels
from tactile.jnd import jnd_unless_smooth
from tactile.measures import measure_touch
from tactile.quantities import ROUGHNESS

ACUITY_ARCMIN = 1.0
"""Angle that a good eye resolves: detail below it is blurred in what is seen."""
SAMPLES = 64
"""Samples a pixel of the pictures of the design: for a figure, and a change far above their noise."""


@dataclass(frozen=True)
class AsPrinted:
    """Printing in a run.

    Attributes:
        numbers: of printer and prints.
        design: (conditions, rows, cols) radiance, pictures of the original before layers are cut.
    """

    numbers: PrintNumbers
    design: Array


@stage("comparing with the design")
def as_printed(
    settings: Run, problem: Problem, result: Array, pictures: tuple[Array, Array]
) -> AsPrinted | None:
    """The part of a run's results about printing; None without a printer.

    Args:
        settings: of the run.
        problem: its relief is the original as printed.
        result: (rows, cols) mm, of whole layers.
        pictures: of both, (conditions, rows, cols) each.
    """
    printer = settings.print.described
    if printer is None:
        return None
    scene, surface = problem.scene, problem.surface
    design = settings.design(scene.size_mm).heights
    pitch_mm = scene.size_mm / design.shape[1]
    uncut = on_pixels(design, pitch_mm, printer, settings.axes_repeat)
    design_pictures = scene.render(scene.levelled(uncut), samples=SAMPLES, seed=settings.seed + 1).numpy()
    rough = [_roughness(relief, problem) for relief in (design, problem.heights)]
    slopes, steepest = np.hypot(*np.gradient(uncut, surface.pitch_mm)), printer.max_slope_degrees
    before, after = pictures
    eye = [pixels_per_degree(float(one), settings.verify.distance_cm) for one in scene.pixels_per_mm()]
    weights = pixel_weights(scene.plate_weights(), scene.weights)

    def seen(one: Array, other: Array) -> float:
        blurred = [_blurred(each, eye) for each in (one, other)]
        difference = float((weights * np.abs(blurred[1] - blurred[0])).mean())
        return percent_of(difference, float((weights * before).mean()))

    def beyond_limits(relief: Array) -> Faults:
        return Faults(**faults(relief, surface.pitch_mm, printer, surface.repeats))

    numbers = PrintNumbers(
        printer=printer.name,
        **printer.numbers(),
        keep_features=printer.keep_features,
        pixels=surface.shape,
        acuity_arcmin=ACUITY_ARCMIN,
        seen_change_percent=seen(before, after),
        design=DesignNumbers(
            jnd_of_print=jnd_unless_smooth(rough[1], rough[0]),
            seen_change_percent=seen(design_pictures, before),
            too_steep_percent=100.0 * float((slopes > math.tan(math.radians(steepest))).mean()),
        ),
        faults_before=beyond_limits(problem.heights),
        faults_after=beyond_limits(result),
    )
    return AsPrinted(numbers, design_pictures)


def _roughness(heights: Array, problem: Problem) -> float:
    """Mean roughness over the places of a relief (rows, cols), mm, by the elastic layer."""
    relief = replace(problem.relief, heights=heights)
    touch = measure_touch(relief, problem.skin, "layer", quantities=[ROUGHNESS])
    return touch.means[ROUGHNESS.name]


def _blurred(pictures: Array, pixels_per_degree: list[float]) -> Array:
    """Pictures (conditions, rows, cols) without what is finer than the eye resolves."""
    # A Gaussian is half as high at half that angle from its middle.
    widths = [one * ACUITY_ARCMIN / 60.0 / math.sqrt(8.0 * math.log(2.0)) for one in pixels_per_degree]
    each = [ndimage.gaussian_filter(one, width) for one, width in zip(pictures, widths, strict=True)]
    return np.stack(each)
