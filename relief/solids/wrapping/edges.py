"""Edge lengths and numbers of textured triangles: for a wrapping, and as a draft predicts them."""

from collections.abc import Sequence

import numpy as np

from relief.ground.arrays import Flags
from relief.ground.progress import say
from relief.solids.body import Body
from relief.solids.meshes.refining import AREA_PER_FACE, edge_for, expected_faces
from relief.solids.wrapping.file_surface import Settings
from relief.solids.wrapping.options import MOST_FACES
from relief.solids.wrapping.surfaces import ENOUGH_MM2, BaseSurface, check_count
from relief.solids.wrapping.texture_tiles import Covering

BYTES_A_FACE = 21.0
"""Bytes of a 3MF file for a triangle: 20.5 on a capsule and 20.8 on a knob, in gravel."""


def edge_of(
    body: Body, where: Flags, coverings: Sequence[Covering], settings: Settings, rest: int = 0
) -> float:
    """Longest edge of the textured triangles, mm; logs the face count.

    Args:
        body: The patch with texture.
        where: (faces,) triangles that carry texture.
        coverings: The textures.
        settings: How fine the triangles are.
        rest: Number of triangles beside the patch.
    """
    pitch, edge = _pitch(coverings, settings), settings.edge_mm
    if edge is None:
        # Longer edges than those of the patch leave the patch as it is.
        sides = body.vertices[body.faces[where]]
        longest = float(np.linalg.norm(np.roll(sides, -1, axis=1) - sides, axis=2).max())
        edge = max(pitch, min(edge_for(body, where, _most(body, where, settings, rest)), longest))
    count = expected_faces(body, edge, where) + rest
    if settings.edge_mm is not None:
        check_count(count, settings)
    finest = "printer" if settings.finest_mm == pitch else "texture"
    coarser = "" if edge <= 1.01 * pitch else f" (the {finest} has samples every {pitch:.3g} mm)"
    megabytes = max(BYTES_A_FACE * count / 1e6, 0.1)
    say(f"about {count:,} triangles with edges of {edge:.3g} mm{coarser}, {megabytes:.2g} MB as 3MF")
    return float(edge)


def expected_file(base: BaseSurface, coverings: Sequence[Covering], settings: Settings) -> tuple[float, int]:
    """Longest edge of the textured triangles, mm, and number of all triangles that `wrap` will write, about.

    Args:
        base: Surface of a draft of the same textures.
        coverings: The textures.
        settings: Settings of the file.
    """
    body, where, rest = base.body, base.textured, len(base.rest.faces)
    edge_mm = settings.edge_mm or _pitch(coverings, settings)
    others = int(np.count_nonzero(~where))
    # The base of the file has as many more triangles as its edges are shorter, of the same shapes.
    divided = expected_faces(body, base.file.coarser * edge_mm, where) - others
    count, most = others + round(base.file.coarser**2 * divided), _most(body, where, settings, rest)
    if settings.edge_mm is None and count > most:
        return float(np.sqrt(body.areas[where].sum() / (AREA_PER_FACE * most))), most + rest
    return edge_mm, count + rest


def _pitch(coverings: Sequence[Covering], settings: Settings) -> float:
    """Shortest useful edges of triangles, mm: those of the samples of the textures."""
    return max(settings.finest_mm, min(covering.tile.pitch_mm for covering in coverings))


def _most(body: Body, where: Flags, settings: Settings, rest: int) -> int:
    """Number of triangles that the settings allow a patch, beside those that stay."""
    if settings.faces:
        return max(settings.faces - rest, settings.faces // 2)
    enough = int(body.areas[where].sum() / ENOUGH_MM2) + int(np.count_nonzero(~where))
    return min(enough, MOST_FACES)
