"""The texture of patches of a mesh alone, against the patches' own smooth shapes.

Nobody calls a ball rough. Without the bare object, the shape under the texture is estimated from the mesh. A
part of a torus is fitted around each contact location; the fit reaches farther than the patch, because the
waves of a texture average out on a wider disc. The torus lies under the texture, as textures stand on
objects, and the mesh is unrolled over the torus. A residual of third to sixth order on the disc belongs to
the shape where the residual exceeds the texture's own waves. The texture's waves are estimated from higher
orders at all locations of the object together, because the texture is the same all over the object. A share
of each order stays, so that the roughness keeps a part of the texture's long waves. Where there are no short
waves, as on a bare part with fillets, the shape is whatever is longer than 2 mm.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from relief.ground.arrays import Array, Index
from relief.ground.limits import HEIGHT_LIMIT_MM, PATCH_SIDE_MM
from relief.ground.progress import stage
from relief.solids.body import Body
from relief.solids.meshes.crops import Cropper, SurfaceCrop, within
from relief.solids.meshes.mesh_places import FACING, Frame
from relief.solids.objects.torus import REACH_MM, fitted, over, raised, unrolled, unrolled_body

CURVED_MM = 0.09
"""Root mean square of the second order of a patch, mm, from which it is curved: that of a ball of 56 mm.
The tiles that come with Retouch have up to 0.089 (leather)."""
CURVED = 25.0
"""Power of second order, in units of what the texture's own waves give, from which it is the object's. On the
tiles it has up to 20 (leather)."""
WIDE_MM, DISC_MM = 9.0, 7.0
"""Radii of the discs around a place that a shape is fitted to, mm: textures are estimated better on the wide
one, which reaches round the sides of narrow objects; the other reaches to the corners of a patch."""
POINTS, EVERY = 4096, 4
"""Number of samples of the wide disc, and stride of the torus fit. Four samples on a mm² are too few: waves
shorter than their distance add as much to a polynomial as its own coefficients."""
SHAPE_ORDER, MOST_ORDER = 6, 10
"""Highest order that may belong to the shape, waves of about 5 mm on the disc, and the highest order from
which the texture is estimated."""
SIMPLE = 7.0
"""Power of a polynomial of third to fifth order on the wide disc, in units of that of higher orders on the
other, up to which the torus of the wide disc is shape enough: leather on a ball has 2.7 to 6.9, gravel on the
slider, which is 14 mm wide, 14 and more."""
STEEPEST = 3.0
"""Largest power of the order by which the texture's share of an order falls: leather has 2.6."""
KEPT = 0.75
"""Power of the texture's share of an order by which the order is kept. With 1 the error of the shape is
least; with 0.5 the order keeps the power that the texture gives it, in the form of the shape."""
FARTHER = 1.05
"""Factor by which heights over the torus of the wide disc may vary more on the patch than over the other."""
WORSE = 1.5
"""Factor by which heights over the torus of the disc may vary more on the patch than over one that is fitted
to the patch alone; beyond that the disc holds another surface."""
SHORT_MM = 2.0
"""Wavelength, mm, of which a low pass keeps half, and the waves below which are always texture."""
SMOOTH_MM, TEXTURED_MM = 0.010, 0.015
"""Standard deviation of the short waves, mm, up to which a patch is bare, and from which it is textured.
Parts with fillets of 2 mm and more have up to 0.010; the tiles have 0.040 (terrain) to 0.46."""
FOOT = 5.0
"""Percentile of the heights over the fitted shape at which the texture stands."""
MARGIN_MM = 1.5
"""Margin around a patch, mm, within which faces may come to lie on it when it is unrolled."""


@dataclass(frozen=True)
class OwnShape:
    """The smooth shape around a place, and what is left over it on the disc.

    Attributes:
        torus: (6,) parameters in the axes of the place.
        radius_mm: Of the disc.
        terms: (k, k) mm, by the terms of polynomials; each column is a polynomial, orthogonal to the others.
        power: (`MOST_ORDER` + 1,) mm² of each order.
    """

    torus: Array
    radius_mm: float
    terms: Array
    power: Array


def textures_alone(crops: Sequence[SurfaceCrop], around: Callable[[Frame, float], Body]) -> dict[int, Array]:
    """Heights of the texture alone of those patches that have a shape of their own.

    Args:
        crops: Of a mesh; none on an edge.
        around: The mesh in the axes of a place within a distance along x and y, mm.

    Returns:
        (n, n) mm by the numbers of the crops. Left out are patches that are textured and not curved: their
        heights are those of the texture.
    """
    alone: dict[int, Array] = {}
    shapes: dict[int, tuple[OwnShape, OwnShape]] = {}
    over_torus: dict[int, tuple[int, Array]] = {}
    with stage("separating textures from shapes", len(crops)) as advance:
        for number, crop in enumerate(crops):
            short = short_waves(crop.heights, crop.side_mm)
            if _textured(short) == 0.0:
                alone[number] = short
            elif _curved(crop.middle):
                alone[number] = short
                reach_mm = 0.5 * crop.side_mm + MARGIN_MM
                body = around(crop.frame, max(WIDE_MM, reach_mm))
                shapes[number] = pair = _own_shapes(crop, body)
                which = int(not _simple(*pair))
                over_torus[number] = which, _over_torus(crop, within(body, reach_mm), pair[which].torus)
            advance()
    own = [_own_power(same) for same in zip(*shapes.values(), strict=True)]
    for number, (which, heights) in over_torus.items():
        short = alone[number]
        if crops[number].side_mm == PATCH_SIDE_MM:
            heights = heights - _left_over(shapes[number][which], own[which], len(heights))
        alone[number] = short + _textured(short) * (heights - short)
    return alone


def _own_shapes(crop: SurfaceCrop, around: Body) -> tuple[OwnShape, OwnShape]:
    """Shapes around a place, by the wide disc and by the other; by the patch where they do not fit."""
    points = _points(around)
    depth = points[:, 2] - crop.level_mm
    points = points[(depth > -HEIGHT_LIMIT_MM) & (depth < 2.0 * HEIGHT_LIMIT_MM)]
    near = points[np.linalg.norm(points, axis=1) < DISC_MM]
    on_patch = points[np.abs(points[:, :2]).max(axis=1) < 0.5 * PATCH_SIDE_MM]
    patch = fitted(on_patch[::EVERY])
    disc = better(fitted(near[::EVERY]), patch, on_patch, WORSE)
    if disc is patch:
        near = on_patch
    wide = better(fitted(points[::EVERY]), disc, on_patch, FARTHER)
    if wide is disc:
        points = near
    return _own_shape(wide, points, WIDE_MM, on_patch), _own_shape(disc, near, DISC_MM, on_patch)


def _simple(wide: OwnShape, disc: OwnShape) -> bool:
    """Whether nothing but a torus is needed on the wide disc."""
    one, other = (shape.power / (np.arange(MOST_ORDER + 1) + 1.0) for shape in (wide, disc))
    return bool(one[3:SHAPE_ORDER].mean() < SIMPLE * np.median(other[SHAPE_ORDER + 1 :]))


def better(one: Array, other: Array, on_patch: Array, worse: float) -> Array:
    """One torus, or the other where points on the patch vary less over it by more than a factor."""
    spreads = [float(over(shape, *on_patch.T).std()) for shape in (one, other)]
    return one if spreads[0] < worse * spreads[1] else other


def _own_shape(shape: Array, points: Array, radius_mm: float, on_patch: Array) -> OwnShape:
    """The shape by a torus that was fitted to points (k, 3) mm, and what they have over it."""
    shape = raised(shape, float(np.percentile(over(shape, *on_patch.T), FOOT)))
    flat = unrolled(points, shape)
    flat = flat[np.abs(flat[:, :2]).max(axis=1) < REACH_MM]
    terms, order = _terms(flat[:, 0], flat[:, 1], radius_mm)
    basis, to_shares = np.linalg.qr(terms)
    shares = basis.T @ flat[:, 2]
    power = np.bincount(order, shares**2) / len(flat)
    return OwnShape(shape, radius_mm, np.linalg.solve(to_shares, np.diag(shares)), power)


def _points(around: Body) -> Array:
    """Points (k, 3) of a mesh within the wide disc, as many on equal areas, that face the finger, mm."""
    normals, (a, b, c) = around.normals, around.faces.T
    double = np.sqrt(np.einsum("fd,fd->f", normals, normals))
    middles = (around.vertices[a] + around.vertices[b] + around.vertices[c]) / 3.0
    seen = (normals[:, 2] > FACING * double) & (np.einsum("fd,fd->f", middles, middles) < WIDE_MM**2)
    area = np.cumsum(double[seen])
    at = (np.arange(POINTS) + 0.5) / POINTS * area[-1]
    face = np.flatnonzero(seen)[np.searchsorted(area, at)]
    share = np.random.default_rng(0).dirichlet(np.ones(3), POINTS)
    return np.asarray(np.einsum("nc,ncd->nd", share, around.vertices[around.faces[face]]))


def _own_power(shapes: Sequence[OwnShape]) -> Array:
    """Power (`MOST_ORDER` + 1,) that the texture gives each order at a place, mm².

    Medians over the places of what a polynomial of a higher order has, carried on to lower orders as a power
    of the order.
    """
    number = np.arange(MOST_ORDER + 1) + 1.0
    level = np.log(np.median([shape.power for shape in shapes], axis=0) / number + 1e-18)
    high = np.arange(SHAPE_ORDER, MOST_ORDER + 1)
    rise = float(np.clip(np.polyfit(np.log(high), level[high], 1)[0], -STEEPEST, 0.0))
    middle = float((level[high] - rise * np.log(high)).mean())
    return np.asarray(number * np.exp(middle + rise * np.log(np.maximum(number - 1.0, 1.0))))


def _over_torus(crop: SurfaceCrop, around: Body, shape: Array) -> Array:
    """Heights (n, n) of the mesh over the torus (6,) of a place, mm."""
    side = None if crop.side_mm == PATCH_SIDE_MM else crop.side_mm
    flat = Cropper(unrolled_body(around, shape), side_mm=side).crop(Frame(np.zeros(3), np.eye(3)))
    if flat.on_edge and side is None:
        return over(shape, *_lattice(len(crop.middle)), crop.middle + crop.level_mm)
    return flat.heights


def _left_over(shape: OwnShape, own: Array, samples: int) -> Array:
    """Heights (samples, samples) over the torus that belong to the shape, mm; `own`: power of the texture."""
    taken = np.zeros(MOST_ORDER + 1)
    taken[1] = 1.0
    for order in range(3, SHAPE_ORDER + 1):
        taken[order] = 1.0 - min(1.0, own[order] / shape.power[order]) ** KEPT
    x, y = _lattice(samples)
    terms, orders = _terms(x.ravel(), y.ravel(), shape.radius_mm)
    return np.asarray((terms @ (shape.terms @ taken[orders])).reshape(samples, samples))


def _curved(heights: Array) -> bool:
    """Whether a patch (n, n) has more of second order than its texture gives it."""
    basis, second = _second_order(len(heights))
    shares = basis.T @ heights.ravel()
    power = float((shares[second] ** 2).sum()) / heights.size
    rest = heights - (basis @ shares).reshape(heights.shape)
    return power > CURVED_MM**2 or power > CURVED * 3.0 * _expected(rest)


def short_waves(heights: Array, side_mm: float) -> Array:
    """A patch (n, n) without waves longer than 2 mm."""
    low_pass = _low_pass(len(heights), side_mm)
    return np.asarray(heights - low_pass @ heights @ low_pass.T)


def _textured(short: Array) -> float:
    """How far a patch counts as textured by its short waves (n, n) mm: 0, bare, to 1."""
    # A few samples may lie at the limit of the finger's reach, where the heights have a kink.
    spread = float(np.percentile(np.abs(short), 95.0)) / 1.96
    return float(np.clip((spread - SMOOTH_MM) / (TEXTURED_MM - SMOOTH_MM), 0.0, 1.0))


def _expected(rest: Array) -> float:
    """Power that a texture gives a polynomial of second order, mm², by its waves of 1 to 3 mm.

    The spectrum is carried on to longer waves as a power of the wavelength, or flat where it would fall. A
    polynomial of second order has about 0.8 waves along the patch.

    Args:
        rest: (n, n) heights without polynomials up to sixth order, mm.
    """
    waves = np.fft.fftfreq(len(rest), 1.0 / len(rest))
    number = np.hypot(waves[:, None], waves)
    power = np.abs(np.fft.fft2(rest)) ** 2 / rest.size**2
    rings = np.arange(3, 11)
    levels = np.array([power[np.abs(number - ring) < 0.5].mean() for ring in rings]) + 1e-18
    rise, level = np.polyfit(np.log(rings), np.log(levels), 1)
    flat = float(power[np.abs(number - 3.5) < 1.0].mean())
    return float(max(flat, np.exp(level + rise * np.log(0.8))))


def _terms(x: Array, y: Array, radius_mm: float) -> tuple[Array, Index]:
    """Products of powers of x and y, in radii, at (k,) points, mm, (k, terms), and their orders."""
    by_x, by_y = (np.vander(each / radius_mm, MOST_ORDER + 1, increasing=True) for each in (x, y))
    pairs = [(i, total - i) for total in range(MOST_ORDER + 1) for i in range(total + 1)]
    first, second = np.array(pairs).T
    return by_x[:, first] * by_y[:, second], first + second


@cache
def _second_order(samples: int) -> tuple[Array, Array]:
    """Orthonormal polynomials (samples², k) up to sixth order on a patch, and which are of second (k,)."""
    x, y = _lattice(samples)
    terms, order = _terms(x.ravel(), y.ravel(), DISC_MM)
    low = order <= SHAPE_ORDER
    return np.linalg.qr(terms[:, low])[0], order[low] == 2


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


@cache
def _lattice(samples: int) -> tuple[Array, Array]:
    """x and y (samples, samples) of a patch of 10 mm, mm, row 0 at +y."""
    at = ((np.arange(samples) + 0.5) / samples - 0.5) * PATCH_SIDE_MM
    x, y = np.meshgrid(at, at[::-1])
    return x, y
