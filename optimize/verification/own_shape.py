"""The texture of a patch of a mesh alone, against the patch's own smooth shape.

Nobody calls a ball rough. Without the object as it was before its texture, its shape has to be told from the
patch itself. The shape is, at first, a part of a torus, which has two curvatures that are nearly constant: a
ball, a cylinder and a saddle are such parts. It is laid under the texture, as textures stand on objects, and
the mesh is unrolled over it: heights are taken along its normals, lengths along its sections. A polynomial
that is left in the unrolled heights belongs to the shape where it is larger than the texture's own waves
would make it. Where there are no short waves at all, as on a bare part with fillets, the shape is whatever is
longer than 2 mm. Long waves of a texture cannot be told from a shape of the same length.
"""

from functools import cache

import numpy as np
from scipy.optimize import least_squares

from relief.body import Body
from relief.common.arrays import Array
from relief.common.limits import HEIGHT_LIMIT_MM, PATCH_SIDE_MM
from relief.meshes.crops import Crop, Cropper
from relief.meshes.places import Frame

CURVED_MM = 0.09
"""Root mean square of the second order of a patch, mm, from which it is curved: that of a ball of 56 mm.
The tiles that come with Retouch have up to 0.089 (leather)."""
CURVED, SIGNIFICANT = 25.0, 4.0
"""Power of second order, and of higher orders, in units of what the texture's own waves give, from which it
is the object's. On the tiles second order has up to 20 (leather)."""
MOST_ORDER = 6
"""Highest order of the polynomial that may belong to the shape: waves of about 4 mm in 10."""
SHORT_MM = 2.0
"""Wavelength, mm, of which a low pass keeps half, and the waves below which are always texture."""
SMOOTH_MM, TEXTURED_MM = 0.010, 0.015
"""Standard deviation of the short waves, mm, up to which a patch is bare, and from which it is textured.
Parts with fillets of 2 mm and more have up to 0.010; the tiles have 0.040 (terrain) to 0.46."""
FOOT = 5.0
"""Percentile of the heights over the fitted shape at which the texture stands."""
STEP = 6
"""Every so many samples along a side are fitted."""
REACH_MM = 9.0
"""Distance from the place, along each axis, up to which the mesh is unrolled, mm."""
NODES, WEIGHTS = (np.polynomial.legendre.leggauss(8)[n] for n in (0, 1))
"""Nodes and weights of the quadrature along sections of the shape, from -1 to 1."""


def texture_alone(crop: Crop, around: Body) -> Array | None:
    """Heights of the texture of a patch over the patch's own smooth shape.

    Args:
        crop: Of the mesh; not on an edge.
        around: The mesh around the place in the axes of the place, mm.

    Returns:
        (n, n) mm of the size of the crop; None where the patch is textured and not curved, so that its
        heights are those of the texture.
    """
    middle = crop.middle
    short = _short_waves(crop.heights, crop.side_mm)
    if (share := _textured(short)) == 0.0:
        return short
    if not _curved(middle):
        return None
    shape = _fitted(middle)
    x, y = _lattice(len(middle))
    over = (middle - _torus(shape, x, y)) / np.sqrt(1.0 + sum(slope**2 for slope in _slopes(shape, x, y)))
    foot = float(np.percentile(over, FOOT))
    shape[0] += foot + crop.level_mm
    shape[4:] /= 1.0 + foot * shape[4:]
    side = None if crop.side_mm == PATCH_SIDE_MM else crop.side_mm
    flat = Cropper(_unrolled(around, shape), side_mm=side).crop(Frame(np.zeros(3), np.eye(3)))
    heights = over if flat.on_edge and side is None else flat.heights
    heights = _without_polynomial(heights) if side is None else heights
    return short + share * (heights - short)


def _curved(heights: Array) -> bool:
    """Whether a patch (n, n) has more of second order than its texture gives it."""
    basis, degree = _basis(len(heights))
    shares = basis.T @ heights.ravel()
    power = float((shares[degree == 2] ** 2).sum()) / heights.size
    rest = heights - (basis @ shares).reshape(heights.shape)
    return power > CURVED_MM**2 or power > CURVED * 3.0 * float(_expected(rest, np.array([2.0]))[0])


def _without_polynomial(heights: Array) -> Array:
    """A patch (n, n) less the plane, the second order, and orders that are more than the texture gives."""
    basis, degree = _basis(len(heights))
    shares = basis.T @ heights.ravel()
    power = shares**2 / heights.size
    expected = _expected(heights - (basis @ shares).reshape(heights.shape), degree.clip(min=1))
    kept = 2
    for order in range(3, MOST_ORDER + 1):
        more = (degree > kept) & (degree <= order)
        if power[more].sum() > SIGNIFICANT * expected[more].sum():
            kept = order
    low = degree <= kept
    return np.asarray(heights - (basis[:, low] @ shares[low]).reshape(heights.shape))


def _short_waves(heights: Array, side_mm: float) -> Array:
    """A patch (n, n) without waves longer than 2 mm."""
    low_pass = _low_pass(len(heights), side_mm)
    return np.asarray(heights - low_pass @ heights @ low_pass.T)


def _textured(short: Array) -> float:
    """How far a patch counts as textured by its short waves (n, n) mm: 0, bare, to 1."""
    # A few samples may lie at the limit of the finger's reach, where the heights have a kink.
    spread = float(np.percentile(np.abs(short), 95.0)) / 1.96
    return float(np.clip((spread - SMOOTH_MM) / (TEXTURED_MM - SMOOTH_MM), 0.0, 1.0))


def _expected(rest: Array, degree: Array) -> Array:
    """Power that a texture gives a polynomial of a degree, mm², by its waves of 1 to 3 mm.

    The spectrum is carried on to longer waves as a power of the wavelength, or flat where it would fall. A
    polynomial of degree d has about 0.4 d waves along the patch.

    Args:
        rest: (n, n) heights without polynomials up to the highest order, mm.
        degree: (k,) degrees, 1 or more.
    """
    waves = np.fft.fftfreq(len(rest), 1.0 / len(rest))
    number = np.hypot(waves[:, None], waves)
    power = np.abs(np.fft.fft2(rest)) ** 2 / rest.size**2
    rings = np.arange(3, 11)
    levels = np.array([power[np.abs(number - ring) < 0.5].mean() for ring in rings]) + 1e-18
    rise, level = np.polyfit(np.log(rings), np.log(levels), 1)
    flat = float(power[np.abs(number - 3.5) < 1.0].mean())
    return np.maximum(flat, np.exp(level + rise * np.log(0.4 * degree)))


@cache
def _basis(samples: int) -> tuple[Array, Array]:
    """Orthonormal polynomials (samples², k) on a patch, and their degrees (k,), rising."""
    at = (np.arange(samples) + 0.5) / samples * 2.0 - 1.0
    values = np.polynomial.legendre.legvander(at, MOST_ORDER)
    pairs = [(i, total - i) for total in range(MOST_ORDER + 1) for i in range(total + 1)]
    products = np.stack([np.outer(values[:, j], values[:, i]).ravel() for i, j in pairs], axis=1)
    return np.linalg.qr(products)[0], np.array([i + j for i, j in pairs])


@cache
def _low_pass(samples: int, side_mm: float) -> Array:
    """(samples, samples) local regression of second order with Gaussian weights, for rows or columns."""
    # Half of a wave of length w is kept with a standard deviation of w / 3.43.
    at = (np.arange(samples) + 0.5) * side_mm / samples * 3.43 / SHORT_MM
    away = at - at[:, None]
    terms = np.stack([np.ones_like(away), away, away**2], axis=2)
    weighted = terms * np.exp(-0.5 * away**2)[..., None]
    first = np.broadcast_to(np.eye(3)[:, :1], (samples, 3, 1))
    return np.asarray((weighted @ np.linalg.solve(weighted.swapaxes(1, 2) @ terms, first))[..., 0])


def _lattice(samples: int) -> tuple[Array, Array]:
    """x and y (samples, samples) of a patch of 10 mm, mm, row 0 at +y."""
    at = ((np.arange(samples) + 0.5) / samples - 0.5) * PATCH_SIDE_MM
    x, y = np.meshgrid(at, at[::-1])
    return x, y


def _fitted(heights: Array) -> Array:
    """Parameters (6,) of the torus nearest to heights (n, n), mm, as in `_torus`."""
    x, y = (each[::STEP, ::STEP].ravel() for each in _lattice(len(heights)))
    z = heights[::STEP, ::STEP].ravel()
    terms = np.stack([np.ones_like(x), x, y, x * x, x * y, y * y], axis=1)
    level, by_x, by_y, xx, xy, yy = np.linalg.lstsq(terms, z, rcond=None)[0]
    curvatures, directions = np.linalg.eigh(-np.array([[2.0 * xx, xy], [xy, 2.0 * yy]]))
    fits = []
    # Either curvature may be that of the tube.
    for one, other in ((0, 1), (1, 0)):
        turn = np.arctan2(directions[1, one], directions[0, one])
        start = np.array([level, by_x, by_y, turn, curvatures[one], curvatures[other]])
        fits.append(least_squares(lambda of: _torus(of, x, y) - z, start, method="lm", max_nfev=60))
    return np.array(min(fits, key=lambda fit: fit.cost).x)


def _torus(shape: Array, x: Array, y: Array) -> Array:
    """Heights of a torus near the top of its tube, mm.

    Args:
        shape: level (mm), slopes along x and y, direction of the tube's section (rad), its curvature and that
            of the ring, 1/mm.
        x, y: of any shape, mm.
    """
    level, by_x, by_y, turn, tube, ring = shape
    across = np.cos(turn) * x + np.sin(turn) * y
    along = np.cos(turn) * y - np.sin(turn) * x
    down = tube * across**2 / (1.0 + np.sqrt(np.maximum(1.0 - (tube * across) ** 2, 1e-3)))
    root = np.sqrt(np.maximum((1.0 - ring * down) ** 2 - (ring * along) ** 2, 1e-3))
    fall = (2.0 * down - ring * down**2 + ring * along**2) / (1.0 + root)
    return np.asarray(level + by_x * x + by_y * y - fall)


def _slopes(shape: Array, x: Array, y: Array, step: float = 1e-4) -> tuple[Array, Array]:
    """Derivatives of the heights of a torus along x and y."""
    along_x = _torus(shape, x + step, y) - _torus(shape, x - step, y)
    along_y = _torus(shape, x, y + step) - _torus(shape, x, y - step)
    return along_x / (2.0 * step), along_y / (2.0 * step)


def _unrolled(around: Body, shape: Array) -> Body:
    """A mesh over a torus as heights over a plane: along its normals, at lengths along its sections, mm."""
    at = around.vertices
    x, y = at[:, 0].copy(), at[:, 1].copy()
    for _ in range(6):
        by_x, by_y = _slopes(shape, x, y)
        length = np.sqrt(1.0 + by_x**2 + by_y**2)
        height = (at[:, 2] - _torus(shape, x, y) - (at[:, 0] - x) * by_x - (at[:, 1] - y) * by_y) / length
        x = np.clip(at[:, 0] + height / length * by_x, -REACH_MM, REACH_MM)
        y = np.clip(at[:, 1] + height / length * by_y, -REACH_MM, REACH_MM)
    radius = np.maximum(np.hypot(x, y), 1e-12)
    stretch = np.zeros_like(x)
    for node, weight in zip(0.5 + 0.5 * NODES, 0.5 * WEIGHTS, strict=True):
        along = _slopes(shape, node * x, node * y)
        stretch += weight * np.sqrt(1.0 + ((along[0] * x + along[1] * y) / radius) ** 2)
    there = (np.abs(height) < HEIGHT_LIMIT_MM) & (np.maximum(np.abs(x), np.abs(y)) < REACH_MM)
    faces = around.faces[there[around.faces].all(axis=1)]
    return Body(np.stack([x * stretch, y * stretch, height], axis=1), faces)
