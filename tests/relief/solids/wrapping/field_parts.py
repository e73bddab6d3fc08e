"""Small parts as strangers draw them: planes beside shallow features, meant facets, hollows, narrow gaps."""

import numpy as np
import trimesh
from manifold3d import Manifold, Mesh

from relief.solids.body import Body
from tests.relief.solids.meshes.bodies import joined


def body_of(shape: Manifold) -> Body:
    """The triangles of a Manifold."""
    mesh = shape.to_mesh64()
    return Body(np.array(mesh.vert_properties)[:, :3], np.array(mesh.tri_verts, dtype=np.int64))


def block(size, middle=(0.0, 0.0, 0.0)) -> Body:
    """A box of twelve triangles around a point, mm."""
    return body_of(Manifold.cube(size, True).translate(middle))


def cylinder(radius: float, height: float, sides: int) -> Body:
    """A cylinder that stands on z = 0, its discs fans from their corners."""
    return body_of(Manifold.cylinder(height, radius, circular_segments=sides))


def plate_with_a_dot() -> Body:
    """A plate of 60 x 40 x 2 mm with a spherical dot, 1.6 mm wide and 0.2 mm high, as braille has."""
    radius = (0.8**2 + 0.2**2) / 0.4
    dot = Manifold.sphere(radius, 64).translate((15.0, 12.0, 2.2 - radius)).trim_by_plane((0, 0, 1), 1.0)
    return body_of(Manifold.cube((60.0, 40.0, 2.0)) + dot)


def low_poly_ball() -> Body:
    """A ball of 20 mm radius of 80 triangles, whose edges are meant."""
    mesh = trimesh.creation.icosphere(subdivisions=1, radius=20.0)
    return Body(np.array(mesh.vertices), np.array(mesh.faces))


def sealed_box() -> Body:
    """A box of 40 x 40 x 30 mm with a sealed hollow, walls of 3 mm."""
    hollow = block((34.0, 34.0, 24.0), (0.0, 0.0, 15.0))
    inverted = Body(hollow.vertices, hollow.faces[:, ::-1])
    return joined(block((40.0, 40.0, 30.0), (0.0, 0.0, 15.0)), inverted)


def plug_in_a_bore() -> Body:
    """A block with a tapered bore and in it a plug, 0.02 mm from the walls."""
    bore = Manifold.cylinder(6.01, 2.87, 2.97, 72).translate((0.0, 0.0, 2.0))
    plug = Manifold.cylinder(3.0, 2.85, circular_segments=72).translate((0.0, 0.0, 1.0))
    return body_of(Manifold.cube((30.0, 30.0, 8.0), True).translate((0.0, 0.0, 4.0)) - bore + plug)


def volume_below(body: Body, z: float) -> float:
    """Volume of what lies below a height, mm³."""
    mesh = Mesh(body.vertices.astype(np.float32), body.faces.astype(np.uint32))
    return float(Manifold(mesh).trim_by_plane((0.0, 0.0, -1.0), -z).volume())


def gridded(body: Body, edge_mm: float) -> Body:
    """The same surface in triangles with edges up to a length, each vertex once."""
    vertices, faces = trimesh.remesh.subdivide_to_size(body.vertices, body.faces, edge_mm, max_iter=20)
    vertices, number = np.unique(vertices, axis=0, return_inverse=True)
    return Body(vertices, number.ravel()[faces])
