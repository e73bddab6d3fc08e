"""Bodies for tests of meshes."""

import io

import numpy as np

from relief.solids.body import Body, Part
from relief.solids.export.parts import writer_of

CUBE = np.array(
    [
        *([0, 2, 1], [1, 2, 3], [4, 5, 6], [5, 7, 6], [0, 1, 4], [1, 5, 4]),
        *([2, 6, 3], [3, 6, 7], [0, 4, 2], [2, 4, 6], [1, 3, 5], [3, 7, 5]),
    ]
)


def cube(side: float = 20.0, at: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> Body:
    """A cube with one corner at a point."""
    corners = np.array([[x, y, z] for z in (0.0, 1.0) for y in (0.0, 1.0) for x in (0.0, 1.0)])
    return Body(corners * side + at, CUBE)


def joined(*bodies: Body) -> Body:
    """Bodies as one."""
    starts = np.cumsum([0, *(len(body.vertices) for body in bodies)])
    faces = [body.faces + start for body, start in zip(bodies, starts, strict=False)]
    return Body(np.concatenate([body.vertices for body in bodies]), np.concatenate(faces))


def stl(body: Body) -> bytes:
    """A body as a binary STL file."""
    return _file_of(body, ".stl")


def ply(body: Body) -> bytes:
    """A body as a binary PLY file."""
    return _file_of(body, ".ply")


def _file_of(body: Body, suffix: str) -> bytes:
    file = io.BytesIO()
    writer_of(suffix).write([Part("body", body)], file)
    return file.getvalue()


def torus(centre: tuple[float, float, float], axes: tuple[int, int, int], radius: float, tube: float) -> Body:
    """A torus around the last of three axes."""
    n, m = 48, 24
    u, v = np.meshgrid(np.arange(n) * 2 * np.pi / n, np.arange(m) * 2 * np.pi / m, indexing="ij")
    rim = radius + tube * np.cos(v)
    points = np.stack([rim * np.cos(u), rim * np.sin(u), tube * np.sin(v)], axis=-1).reshape(-1, 3)
    i, j = np.meshgrid(np.arange(n), np.arange(m), indexing="ij")
    a, b = (i * m + j).ravel(), ((i + 1) % n * m + j).ravel()
    c, d = (i * m + (j + 1) % m).ravel(), ((i + 1) % n * m + (j + 1) % m).ravel()
    faces = np.concatenate([np.stack([a, b, c], axis=-1), np.stack([b, d, c], axis=-1)])
    return Body(points[:, np.argsort(axes)] + centre, faces)
