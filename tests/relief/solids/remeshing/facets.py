"""Bodies of facets, as a CAD kernel writes round ones."""

import manifold3d
import numpy as np
import trimesh

from relief.solids.body import Body
from relief.solids.remeshing.even_mesh import even_mesh
from relief.solids.remeshing.patch import Patch
from relief.solids.remeshing.smooth_surface import smooth_surface

SECTIONS = 42
"""Facets around, as a CAD kernel writes them with 0.15 rad."""


def of(mesh):
    return Body(np.array(mesh.vertices, dtype=np.float64), np.array(mesh.faces))


def revolved(*profile):
    """A body of facets by the radii and heights of its profile: slivers from one point of it to the next."""
    mesh = trimesh.creation.revolve(np.array(profile, dtype=np.float64), sections=SECTIONS)
    mesh.merge_vertices()
    mesh.update_faces(mesh.nondegenerate_faces())
    return of(mesh)


def remeshed(body, edge_mm, uv=None):
    """The even mesh of a whole body, a patch without a border."""
    corners, none = np.broadcast_to(np.eye(3), (len(body.faces), 3, 3)), np.empty(0, np.int64)
    rise, facets = np.ones(len(body.vertices)), np.arange(len(body.faces))
    return even_mesh(Patch(smooth_surface(body), body, facets, corners, rise, 0, none, uv), edge_mm)


def arc(radius, at, start, stop, count):
    angles = np.linspace(start, stop, count)
    return np.stack([at[0] + radius * np.cos(angles), at[1] + radius * np.sin(angles)], axis=1)


def rounded(radius, sections):
    """A profile of an L with a fillet in its inner corner, drawn out by 12 mm: a bracket."""
    outline = [(0.0, 0.0), (20.0, 0.0), (20.0, 4.0)]
    outline += [tuple(at) for at in arc(radius, (4.0 + radius,) * 2, 1.5 * np.pi, np.pi, sections)]
    outline += [(4.0, 20.0), (0.0, 20.0)]
    solid = manifold3d.Manifold.extrude(manifold3d.CrossSection([outline]), 12.0).to_mesh()
    return Body(np.array(solid.vert_properties, dtype=np.float64), np.array(solid.tri_verts, dtype=np.int64))


ROD = revolved((0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0))
BALL = revolved(*arc(12.0, (0.0, 0.0), -0.5 * np.pi, 0.5 * np.pi, 22))
TORUS = of(trimesh.creation.torus(20.0, 6.0, major_sections=84, minor_sections=42))
CYLINDER = revolved((0.0, -15.0), (10.0, -15.0), (10.0, 15.0), (0.0, 15.0))
# In rows, as kernels write cones: normals are no straight lines along a facet that narrows to a half.
CONE = revolved((0.0, 0.0), *((12.0 - 0.35 * z, z) for z in np.linspace(0.0, 20.0, 9)), (0.0, 20.0))
LENS_LOW = -8.0 * np.cos(0.5)
LENS = revolved((0.0, LENS_LOW), *arc(8.0, (0.0, 0.0), -0.5 * np.pi + 0.5, 0.5 * np.pi, 16))
TUBE = revolved((4.0, -5.0), (8.0, -5.0), (8.0, 5.0), (4.0, 5.0), (4.0, -5.0))
