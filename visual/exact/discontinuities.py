"""Discontinuities of pictures: the part of the derivative that is not radiance by slope.

A picture jumps at two kinds of edges that move with the heights: boundaries of shadows
(`visual.exact.shadow_edges`) and primary-visibility edges, the outlines of faces as the camera sees them
(`visual.exact.visibility_edges`). The derivative is the speed of an edge times the jump of radiance across
it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from relief.ground.arrays import Array
from visual.exact.pair_radiance import LitPlate
from visual.exact.shadow_edges import SHADOW_EDGE_SAMPLES, Entries, ShadowEdges, shadow_entries
from visual.exact.visibility_edges import VISIBILITY_EDGE_SAMPLES, VisibilityEdges
from visual.geometry.topology import PlateTopology
from visual.lights.near import LightSet

SHADOW_SHARE, VISIBILITY_SHARE = 0.5, 0.25
"""Shares of the edge samples kept under lights of many directions, each of which adds a small share of the
picture."""
FULL_SUN, LOW_SUN = 1.5, 4
"""Cotangent of a light's elevation from which on shadow edges get more samples, in proportion, and at most
so many times as many. Under a light at 10 degrees, seen at 45, three gradients of gravel are 8 to 11 % off
with 8 samples along each edge, 3 to 6 with 32."""


class EdgeSamples(NamedTuple):
    """Numbers of samples along each edge that casts a shadow and along each primary-visibility edge.

    Shadow edges have so many under a high light, and up to `LOW_SUN` times as many under a low one. Under
    lights of many directions they have `ambient`; None: `SHADOW_SHARE` of `shadows`.
    """

    shadows: int = SHADOW_EDGE_SAMPLES
    visibility: int = VISIBILITY_EDGE_SAMPLES
    ambient: int | None = None


@dataclass(frozen=True)
class Jitter:
    """Fixed positions along the edges of the plate, so that two reliefs differ by geometry alone.

    Attributes:
        shadows: (edges, samples) in [0, 1), of edges that cast shadows, as many as a low light needs.
        visibility: (edges, samples) in [0, 1), of primary-visibility edges.
        ambient: number of positions along shadow edges under lights of many directions.
    """

    shadows: Array
    visibility: Array
    ambient: int

    def of_shadows(self, lights: LightSet) -> Array:
        """(edges, samples): the first positions along shadow edges, as many as these lights are worth."""
        high = self.shadows.shape[1] // LOW_SUN
        if len(lights) != 1:
            return self.shadows[:, : self.ambient]
        ((x, y, z),) = lights.toward_from(np.zeros(1, dtype=int), np.zeros((1, 3)))
        longer = np.hypot(x, y) / max(z, 1e-9) / FULL_SUN
        return self.shadows[:, : int(high * np.clip(longer, 1.0, LOW_SUN))]

    def of_visibility(self, many: bool) -> Array:
        """(edges, samples): the positions along primary-visibility edges, or fewer under many lights."""
        count = self.visibility.shape[1]
        return self.visibility[:, : max(1, int(VISIBILITY_SHARE * count)) if many else count]


def edge_jitter(plate: PlateTopology, generator: np.random.Generator, samples: EdgeSamples) -> Jitter:
    """Random positions along every edge of the plate."""
    edges = len(plate.edge_start)
    shadows = generator.uniform(size=(edges, samples.shadows))
    visibility = generator.uniform(size=(edges, samples.visibility))
    more = generator.uniform(size=(edges, (LOW_SUN - 1) * samples.shadows))
    ambient = samples.ambient or max(1, int(SHADOW_SHARE * samples.shadows))
    return Jitter(np.concatenate((shadows, more), axis=1), visibility, ambient)


def discontinuity_entries(
    lit: LitPlate, shadows: ShadowEdges, edges: VisibilityEdges | None
) -> list[Entries]:
    """Jacobian entries, d radiance / d mm, of a picture of a plate.

    Args:
        lit: the plate before the camera, under its lights.
        shadows: boundaries of the shadows of these lights.
        edges: primary-visibility edges of this camera; None if it looks straight down.
    """
    mesh, camera = lit.mesh, lit.camera
    seen = shadows.seen(mesh.scene, camera)
    if lit.shading is None:
        lost = lit.at_points(seen.light, seen.receiver, seen.point)
    else:
        lost = lit.shading.radiance[seen.light, seen.receiver]
    entries = [shadow_entries(mesh.plate, camera, seen, lost)]
    if edges is not None:
        entries.append(edges.entries(mesh.plate, _radiance_beside(lit, edges)))
    return entries


def _radiance_beside(lit: LitPlate, edges: VisibilityEdges) -> Array:
    """(2, samples): radiance on either side of primary-visibility edges."""
    mesh, face = lit.mesh, edges.face.ravel()
    met, missed = np.flatnonzero(face >= 0), np.flatnonzero(face < 0)
    points = mesh.lifted(face[met], edges.x.ravel()[met], edges.y.ravel()[met])
    places, radiance = lit.places(points), np.zeros(len(face))
    directions = edges.direction.reshape(-1, 3)
    radiance[missed] = lit.light.background(directions[missed])
    if not len(met):
        return radiance.reshape(edges.face.shape)
    if lit.camera.perspective or lit.shading is None or lit.near:
        # Both sides are shaded at one point: at two middles the radiance would differ by the position, too.
        unlit = lit.shade(lit.lights, face[met], -directions[met], places).radiance
    else:
        unlit = lit.shading.radiance[:, face[met]]
    for number in range(len(lit.lights)):
        radiance[met] += np.where(lit.lit_by(number, face[met], points), unlit[number], 0.0)
    reflections = lit.reflections(face[met], -directions[met], places)
    if reflections is not None:
        every = reflections.lit(mesh, face[met], points, np.arange(len(met)))
        for seeing, shown in zip(every, reflections.shading.radiance, strict=True):
            radiance[met] += np.where(seeing, shown, 0.0)
    return radiance.reshape(edges.face.shape)
