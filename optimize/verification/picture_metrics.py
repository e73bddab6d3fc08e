"""Metrics of picture change: mean, root mean square, DSSIM, FLIP and JOD, with their noise."""

import math
from collections.abc import Callable
from functools import partial

import numpy as np
from numpy.typing import NDArray

from optimize.verification.converged import Known
from optimize.verification.jod import jod
from optimize.verification.picture_change import change, percent_of
from optimize.verification.verification import PictureChange, PictureNoise
from relief.ground.arrays import FloatArray
from relief.ground.limits import EYE_DISTANCE_CM
from relief.ground.progress import stage
from relief.ground.srgb import srgb
from visual.picture_noise import Batches
from visual.scene import Scene

Weights = NDArray[np.float64]


def mean_change(before: FloatArray, after: FloatArray, weights: FloatArray | float = 1.0) -> float:
    """Mean absolute difference of arrays of one shape, in their unit, by weights with mean 1."""
    return float((weights * np.abs(after - before)).mean())


def rms_change(before: FloatArray, after: FloatArray, weights: FloatArray | float = 1.0) -> float:
    """Root mean square difference of arrays of one shape, in their unit, by weights with mean 1."""
    return float(np.sqrt((weights * np.square(after - before)).mean()))


def dssim(before: FloatArray, after: FloatArray, white: float) -> float:
    """Structural dissimilarity (1 - SSIM) / 2 of two pictures as displayed (Wang et al. 2004), in [0, 1].

    Args:
        before, after: (rows, cols) linear radiance.
        white: radiance shown as full white.
    """
    from skimage.metrics import structural_similarity

    one, other = srgb(before, white), srgb(after, white)
    return float(0.5 * (1.0 - structural_similarity(one, other, data_range=1.0)))


def pixels_per_degree(pixels_per_mm: float, distance_cm: float) -> float:
    """Pixels that a degree of the visual field covers, for an eye that looks at the plate itself.

    Args:
        pixels_per_mm: of a picture of the plate, `Scene.pixels_per_mm`.
        distance_cm: from the eye to the plate.
    """
    return pixels_per_mm * 20.0 * distance_cm * math.tan(math.radians(0.5))


def flip(before: FloatArray, after: FloatArray, white: float, pixels_per_degree: float) -> float:
    """Mean FLIP difference of two pictures as displayed (Andersson et al. 2020), in [0, 1].

    Args:
        before, after: (rows, cols) linear radiance.
        white: radiance shown as full white.
        pixels_per_degree: of the visual field; the more, the less an eye sees of a pixel.
    """
    import flip_evaluator

    images = [np.repeat(srgb(p, white)[:, :, None], 3, axis=2).astype(np.float32) for p in (before, after)]
    _, mean, _ = flip_evaluator.evaluate(
        *images, "LDR", inputsRGB=True, applyMagma=False, parameters={"ppd": pixels_per_degree}
    )
    return float(mean)


@stage("comparing the pictures")
def look(
    before: Batches,
    after: Batches,
    scene: Scene,
    distance_cm: float = EYE_DISTANCE_CM,
    with_jod: bool = False,
) -> PictureChange:
    """The change of pictures and its uncertainty.

    Args:
        before, after: of the same conditions, with common random numbers batch by batch.
        scene: of the pictures.
        distance_cm: from the eye to the plate, for FLIP and JOD.
        with_jod: whether JOD is computed, of the mean pictures: their noise moves it by 0.01.
    """
    white, plate = scene.white, scene.plate_weights()
    sharpness = [pixels_per_degree(float(one), distance_cm) for one in scene.pixels_per_mm()]
    # (conditions) pairs of (batches, rows, cols).
    pairs = list(zip(*(np.swapaxes(one.pictures, 0, 1) for one in (before, after)), strict=True))
    weights = pixel_weights(plate, scene.weights)
    mean = float((weights * before.mean).mean())
    whole = change(before, after, weights=weights)
    each = [change(before.condition(n), after.condition(n), weights=plate[n]) for n in range(len(pairs))]
    of_mean, of_white = whole.percent_of(mean), whole.percent_of(white)
    film = change(before, after)
    films = [change(before.condition(n), after.condition(n)) for n in range(len(pairs))]
    film_mean = float(before.mean.mean())
    levels = [float((plate[n] * picture).mean()) for n, picture in enumerate(before.mean)]
    return PictureChange(
        change_percent=of_mean.estimate,
        change_rms_percent=of_mean.rms_less_noise,
        change_percent_of_white=of_white.estimate,
        change_rms_percent_of_white=of_white.rms_less_noise,
        plate_share=tuple(float(np.mean(one > 0.0)) for one in plate),
        pixel_change_percent=tuple(100.0 * one.estimate / white for one in films),
        rms_change_percent=tuple(100.0 * one.rms_less_noise / white for one in films),
        mean_change_percent_of_mean=percent_of(film.estimate, film_mean),
        rms_change_percent_of_mean=percent_of(film.rms_less_noise, film_mean),
        dssim=tuple(less_noise(partial(dssim, white=white), b, a) for b, a in pairs),
        flip=tuple(
            less_noise(partial(flip, white=white, pixels_per_degree=one), b, a)
            for (b, a), one in zip(pairs, sharpness, strict=True)
        ),
        jod=tuple(jod(b.mean(0), a.mean(0), white, one) for (b, a), one in zip(pairs, sharpness, strict=True))
        if with_jod
        else None,
        pixels_per_degree=tuple(sharpness),
        distance_cm=distance_cm,
        samples=before.samples,
        noise=PictureNoise(
            certainty=whole.certainty.name.lower(),
            message=whole.certainty.value,
            batches=len(before.pictures),
            standard_error_percent=tuple(100.0 * float(error) for error in after.relative_error(plate)),
            change_percent_of_mean=of_mean,
            change_percent_of_white=of_white,
            conditions_percent_of_mean=tuple(
                one.percent_of(level) for one, level in zip(each, levels, strict=True)
            ),
            conditions_percent_of_white=tuple(one.percent_of(white) for one in each),
        ),
    )


def less_noise(
    difference: Callable[[FloatArray, FloatArray], float], before: FloatArray, after: FloatArray
) -> float:
    """A difference of two mean pictures, less the part of the noise that falls as 1 over the samples.

    Half of the batches have twice the noise's square, so that twice the difference by all less that by half
    has none of it (Richardson's extrapolation).

    Args:
        difference: of two pictures (rows, cols), not negative.
        before, after: (batches, rows, cols) radiance, an even number of batches.
    """
    half = len(before) // 2
    halves = [
        difference(before[part].mean(0), after[part].mean(0)) for part in (slice(half), slice(half, None))
    ]
    return max(0.0, 2.0 * difference(before.mean(0), after.mean(0)) - float(np.mean(halves)))


def known(scene: Scene) -> Known:
    """Whether the change between pictures of a scene is known, as a function of the pictures."""
    weights = pixel_weights(scene.plate_weights(), scene.weights)
    return lambda before, after: change(before, after, weights=weights).certainty.settled


def pixel_weights(plate: Weights, cameras: Weights) -> Weights:
    """(conditions, rows, cols) weights with mean 1, of pixels that show the plate and of their cameras.

    Args:
        plate: (conditions, rows, cols) weights of pixels, with mean 1 over each picture.
        cameras: (conditions,) weights of the conditions.
    """
    return plate * (cameras / cameras.mean())[:, None, None]
