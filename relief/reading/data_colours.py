"""Colours that are data: normal maps, and elevations packed over several bytes."""

from collections.abc import Mapping

import numpy as np

from relief.ground.arrays import AnyArray, Array

MOST_PIXELS = 2**18
"""Pixels, about, that are looked at, of the rows in the middle."""
FEWEST_COLOURS = 32
"""Colours, or bytes, below which a picture is a drawing: teal, purple and olive have length 1, too."""
LEAST_SHARE = 0.002
"""Least share of pixels that vary."""
MEDIAN = (0.8, 1.03)
"""Median length of normals."""
LENGTH_SPREAD, LENGTH_SPREAD_ALL_ROUND = 0.38, 0.2
"""Largest standard deviation of the lengths, in that of the directions: of normals to a surface, of normals
that point anywhere. Colours at random have 0.58."""
COLLINEAR = 0.03
"""Second standard deviation of directions, in the first, below which colours are shades of one colour."""
STEEPEST_MEAN = 0.2
"""Largest x and y of the mean normal to a surface, and least z. Azure paint has lengths of 1, too."""
ALL_ROUND = 0.6
"""Least standard deviation of directions that point anywhere."""
SMOOTHER = 0.9
"""Largest bends of both bytes, in those of the higher one; at least 0.999 in photographs."""
NOISE = 0.3
"""Least standard deviation of the steps of bytes at random, in 255; 0.41 of independent ones."""


def no_heights(channels: Mapping[str, AnyArray], white: float) -> str | None:
    """What colours are that hold data whose brightness means nothing, and what to do; None for others.

    Args:
        channels: (rows, cols) by name, as of `relief.reading.samples.Samples`.
        white: value of white, where black is 0.
    """
    if not {"R", "G", "B"} <= channels.keys():
        return None
    rows, cols = channels["R"].shape
    few = min(rows, max(3, MOST_PIXELS // cols))
    part = slice((rows - few) // 2, (rows + few) // 2)
    colours = np.stack([channels[name][part].astype(np.float64) / white for name in "RGB"])
    if _are_normals(colours):
        what = "a normal map: its colours are directions, not heights"
        return f"{what}; use the height or displacement map that comes with it"
    pairs = ((0, 1), (1, 2), (2, 1), (1, 0))
    if white == 255.0 and any(_high_and_low(colours[high], colours[low]) for high, low in pairs):
        what = "an elevation packed over several bytes a pixel, not grey"
        return f"{what}; write its numbers to a TIFF of floating-point numbers first"
    return None


def _are_normals(colours: Array) -> bool:
    """Whether (3, rows, cols) colours, but for a background, are directions: of length 1 as 2 c - 1.

    Directions that are numbers are as they are. Lengths vary little beside the directions. Normals to a
    surface are around blue; those to an object point anywhere, and no photograph has such lengths.
    """
    flat = colours.reshape(3, -1)
    if not (np.abs(flat) < 2.0).all():
        return False
    codes = np.rint(255.0 * flat).astype(np.int64)
    found, of_pixel, counts = np.unique(
        codes[0] << 16 ^ codes[1] << 8 ^ codes[2], return_inverse=True, return_counts=True
    )
    directions = flat if flat.min() < 0.0 else 2.0 * flat - 1.0
    directions = directions[:, of_pixel != counts.argmax()]
    if len(found) < FEWEST_COLOURS or directions.shape[1] < flat.shape[1] * LEAST_SHARE:
        return False
    lengths = np.linalg.norm(directions, axis=0)
    variances, mean = np.linalg.eigvalsh(np.cov(directions)), directions.mean(axis=1)
    spread = float(np.sqrt(max(variances.sum(), 1e-12)))
    scatter = lengths.std() / spread
    if variances[1] < COLLINEAR**2 * variances[2] or not MEDIAN[0] < np.median(lengths) < MEDIAN[1]:
        return False
    to_surface = scatter < LENGTH_SPREAD and np.abs(mean[:2]).max() < STEEPEST_MEAN < mean[2]
    return bool(to_surface or (spread > ALL_ROUND and scatter < LENGTH_SPREAD_ALL_ROUND))


def _high_and_low(high: Array, low: Array) -> bool:
    """Whether one channel (rows, cols) counts what another one, the lower byte, has in excess of 255.

    Steps of the higher byte are then undone by the lower one, so that both bytes together are smoother.
    """
    bends, together = (np.abs(np.diff(values, 2, axis=1)) for values in (256.0 * high, 256.0 * high + low))
    at = bends > 0.0
    if len(np.unique(low)) < FEWEST_COLOURS or at.mean() < LEAST_SHARE:
        return False
    # Of a steep surface the lower byte is noise that takes every value alike.
    steps, low_steps = (np.diff(values, axis=1).std() for values in (high, low))
    shares = np.histogram(low, 8, (0.0, 1.0))[0] * 8.0 / low.size
    noise = low_steps > NOISE and low_steps > 4.0 * steps and np.abs(shares - 1.0).max() < 0.4
    return bool(together[at].mean() < SMOOTHER * bends[at].mean() or noise)
