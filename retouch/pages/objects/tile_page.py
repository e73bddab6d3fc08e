"""The page beside an exported tile: what to type into programs that displace a surface by a picture."""

from pathlib import Path

from relief.ground.files import write_atomically
from relief.surface import Surface
from retouch.pages.rendering import render_page

TRIANGLES_PER_EDGE2 = 6.2
"""Triangles of BumpMesh 1.2 for each square of its Resolution: halving leaves most edges shorter."""


def write_tile_page(path: Path, name: str, surface: Surface, depth_mm: float, edge_mm: float) -> None:
    """Write a page of four lines, atomically: the tile, each program and the feel that is left.

    Args:
        path: of the page.
        name: of the picture.
        surface: of the picture, whose black is the tile's lowest point.
        depth_mm: height of white above black, mm.
        edge_mm: longest edge of the mesh that is displaced, mm.
    """
    page = render_page(
        "tile.html.j2",
        pair={"title": name},
        surface=surface,
        depth_mm=depth_mm,
        edge_mm=edge_mm,
        millions=100.0 * TRIANGLES_PER_EDGE2 / edge_mm**2 / 1e6,
    )
    write_atomically(path, page)
