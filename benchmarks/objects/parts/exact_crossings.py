"""Whether triangles meet in more than a point, in exact arithmetic: for pairs that another search finds.

A search in single precision, as Blender's, also gives pairs that only touch at a vertex that they share.
"""

from collections.abc import Sequence
from fractions import Fraction

from relief.ground.arrays import FloatArray

Vector = tuple[Fraction, Fraction, Fraction]


def cross_exactly(first: FloatArray, second: FloatArray) -> bool:
    """Whether two triangles (3, 3) meet along a line and lie in two planes; numbers are taken as they are."""
    one, other = ([_vector(corner) for corner in corners] for corners in (first, second))
    normals = [_cross(_minus(b, a), _minus(c, a)) for a, b, c in (one, other)]
    along = _cross(*normals)
    if not any(along):
        return False
    ends = [
        _ends(one, [_dot(normals[1], _minus(corner, other[0])) for corner in one], along),
        _ends(other, [_dot(normals[0], _minus(corner, one[0])) for corner in other], along),
    ]
    if not all(ends):
        return False
    return max(min(each) for each in ends) < min(max(each) for each in ends)


def _ends(corners: Sequence[Vector], heights: Sequence[Fraction], along: Vector) -> list[Fraction]:
    """Where a triangle meets a plane, by the heights of its corners there, along the line of both planes."""
    places = [corner for corner, height in zip(corners, heights, strict=True) if height == 0]
    for k in range(3):
        one, other = heights[k], heights[k - 1]
        if one * other < 0:
            way = _minus(corners[k - 1], corners[k])
            share = one / (one - other)
            places.append(_vector([corners[k][axis] + share * way[axis] for axis in range(3)]))
    return [_dot(along, place) for place in places]


def _vector(numbers: Sequence[Fraction] | FloatArray) -> Vector:
    x, y, z = (each if isinstance(each, Fraction) else Fraction(float(each)) for each in numbers)
    return x, y, z


def _minus(one: Vector, other: Vector) -> Vector:
    return one[0] - other[0], one[1] - other[1], one[2] - other[2]


def _dot(one: Vector, other: Vector) -> Fraction:
    return one[0] * other[0] + one[1] * other[1] + one[2] * other[2]


def _cross(one: Vector, other: Vector) -> Vector:
    (a, b, c), (d, e, f) = one, other
    return b * f - c * e, c * d - a * f, a * e - b * d
