"""Ambient radiance of points on a relief, from their horizons in some azimuths.

    radiance = mean over azimuths of  2 pi * integral of  BSDF * cos(elevation)  from horizon to zenith

The BSDF, foreshortening included, is Mitsuba's; the integral is a Gauss-Legendre quadrature.
"""

from typing import Any

import numpy as np

from relief.ground.arrays import Array
from visual.backend.mitsuba import dr, mi
from visual.geometry.film_samples import PictureSamples
from visual.geometry.placed_mesh import PlacedMesh
from visual.reference.horizon import horizon_tangent

ELEVATIONS = 3
"""Gauss-Legendre nodes between horizon and zenith: within 0.04 % of 8 nodes on average."""


def ambient_radiance(
    bsdf: Any, mesh: PlacedMesh, samples: PictureSamples, azimuths: int, generator: np.random.Generator
) -> Array:
    """Radiance toward the zenith under a sky of radiance 1.

    Args:
        bsdf: Mitsuba's, the plate's material.
        mesh: the plate.
        samples: on the plate.
        azimuths: of horizons from each sample, evenly spaced.
        generator: turns the azimuths of each sample at random, which makes their mean unbiased.

    Returns:
        (samples,).
    """
    count = len(samples.face)
    lane = dr.arange(mi.UInt32, count * azimuths)
    point = lane // azimuths

    def of_points(values: Array) -> Any:
        return dr.gather(mi.Float, mi.Float(np.ascontiguousarray(values, dtype=np.float32)), point)

    first = mesh.vertices[mesh.plate.faces[samples.face, 0]]
    p, q = (slope[samples.face] for slope in mesh.slopes)
    z = first[:, 2] + p * (samples.x - first[:, 0]) + q * (samples.y - first[:, 1])
    slope_x, slope_y = of_points(p), of_points(q)
    turn = mi.Float(lane - point * azimuths) + of_points(generator.uniform(size=count))
    up, across = dr.sincos(turn * (2.0 * np.pi / azimuths))
    x, y, z = (of_points(values) for values in (samples.x, samples.y, z))
    rise = horizon_tangent(mesh.heights, mesh.plate.size_mm, x, y, z, across, up)
    lowest = dr.atan(dr.maximum(rise, slope_x * across + slope_y * up))

    frame = mi.Frame3f(dr.normalize(mi.Vector3f(-slope_x, -slope_y, 1.0)))
    si = dr.zeros(mi.SurfaceInteraction3f, count * azimuths)
    si.n, si.sh_frame, si.wi = frame.n, frame, frame.to_local(mi.Vector3f(0.0, 0.0, 1.0))
    half = 0.5 * (0.5 * np.pi - lowest)
    total = dr.zeros(mi.Float, count * azimuths)
    for node, weight in zip(*np.polynomial.legendre.leggauss(ELEVATIONS), strict=True):
        sine, cosine = dr.sincos(lowest + half * (1.0 + float(node)))
        toward = mi.Vector3f(cosine * across, cosine * up, sine)
        value = bsdf.eval(mi.BSDFContext(), si, frame.to_local(toward))
        total += float(weight) * half * cosine * (value[0] if mi.is_monochromatic else mi.luminance(value))
    each = np.asarray(total, dtype=np.float64).reshape(count, azimuths)
    return np.asarray(each.sum(1) * (2.0 * np.pi / azimuths))
