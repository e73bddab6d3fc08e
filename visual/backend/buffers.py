"""Buffers of a Mitsuba mesh: the only module with their names.

Every ``params`` here is a result of ``mi.traverse``.
"""

from typing import Any

VERTEX_POSITIONS = "vertex_positions"
"""Mitsuba's name of the vertex buffer, interleaved x, y, z; 3.10 renames it."""
FACES = "faces"
"""Mitsuba's name of the index buffer."""
TEXCOORDS = "vertex_texcoords"
"""Mitsuba's name of the buffer of texture coordinates, interleaved u, v."""
HEIGHTS = "heights"
"""Name under which the height-field plugin exposes its samples."""


def write_geometry(params: Any, positions: Any, faces: Any) -> None:
    """Give a mesh new vertices (interleaved x, y, z) and new faces (three vertex indices each)."""
    params[FACES] = faces
    write_positions(params, positions)


def write_positions(params: Any, positions: Any) -> None:
    """Move the vertices of a mesh; its faces stay."""
    params[VERTEX_POSITIONS] = positions
    params.update()


def heights_key(params: Any) -> str:
    """Return the name of the plate's heights among the parameters.

    Raises:
        KeyError: There is no plate.
    """
    for key in params.keys():  # noqa: SIM118  # Mitsuba's own iteration yields pairs
        if key == HEIGHTS or key.endswith(f".{HEIGHTS}"):
            return key
    raise KeyError(HEIGHTS)


def set_heights(params: Any, heights: Any) -> None:
    """Put new heights into a loaded scene.

    Args:
        params: Parameters of a scene or of the plate.
        heights: ``rows * cols`` values in mm, as a flat Dr.Jit array, which may carry gradients, or as
            anything that such an array can be made of.

    Raises:
        ValueError: A value is not finite, or the number of samples differs.
    """
    params[heights_key(params)] = heights
    params.update()
