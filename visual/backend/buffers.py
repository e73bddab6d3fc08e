"""Buffers of a Mitsuba mesh: the only place that knows their names.

``params`` is always what ``mi.traverse`` returns.
"""

from typing import Any

VERTEX_POSITIONS = "vertex_positions"
"""Mitsuba's name of the vertex buffer, interleaved x, y, z; 3.10 renames it."""
FACES = "faces"
"""Mitsuba's name of the index buffer."""
HEIGHTS = "heights"
"""Name under which the height-field plugin exposes its samples."""


def write_geometry(params: Any, positions: Any, faces: Any) -> None:
    """Give a Mitsuba mesh (its ``mi.traverse`` parameters) vertices and faces."""
    params[FACES] = faces
    params[VERTEX_POSITIONS] = positions
    params.update()


def write_positions(params: Any, positions: Any) -> None:
    """Move the vertices of a Mitsuba mesh (its ``mi.traverse`` parameters), keeping the faces."""
    params[VERTEX_POSITIONS] = positions
    params.update()


def heights_key(params: Any) -> str:
    """Name of the plate's heights among ``mi.traverse`` parameters; KeyError if there is no plate."""
    for key in params.keys():  # noqa: SIM118  # Mitsuba's own iteration yields pairs
        if key == HEIGHTS or key.endswith(f".{HEIGHTS}"):
            return key
    raise KeyError(HEIGHTS)


def set_heights(params: Any, heights: Any) -> None:
    """Put new heights into a kept scene.

    ``params``: ``mi.traverse`` of a scene or of the plate. ``heights``: flat Dr.Jit array or anything that
    one can be made of, ``rows * cols`` values in mm. A Dr.Jit array may carry gradients. Raises ValueError
    when a value is not finite or the number of samples differs.
    """
    params[heights_key(params)] = heights
    params.update()
