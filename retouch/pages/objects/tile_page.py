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
    rows, cols = surface.shape
    millions = 100.0 * TRIANGLES_PER_EDGE2 / edge_mm**2 / 1e6
    sides = f"{surface.width_mm:.4g} x {surface.height_mm:.4g}"
    lines = [
        (
            "Tile",
            f"{sides} mm, {cols} x {rows} pixels of 16 bits, seamless. Depth {depth_mm:.4g} mm from black, "
            "the lowest point, to white; mid level 0, so that the texture only adds. Project it along the "
            "normals.",
        ),
        (
            "BumpMesh",
            "Mode Cubic (Box), or Cylindrical around an upright axis. Size U and V "
            f"{max(surface.size_mm):.4g} mm; Texture height {depth_mm:.4g} mm; Symmetric displacement off; "
            f"Resolution {edge_mm:.2g} mm; Output Triangles {millions:.2g} million or more for each cm² of "
            "surface.",
        ),
        (
            "Blender",
            f"Image: Non-Color. Displace: Strength {depth_mm:.4g}, Midlevel 0, Coordinates Object with an "
            f"empty of scale {surface.width_mm / 2:.4g} x {surface.height_mm / 2:.4g}, which projects along "
            f"its z; around curves Coordinates UV, {sides} mm to a unit. Edges of {edge_mm:.2g} mm or less. "
            "All for 1 unit = 1 mm.",
        ),
        (
            "Feel",
            "With edges of that length the roughness of six bundled tiles on a flat face stays within 0.2 "
            "JND in BumpMesh, which reads 8 bits; with its default Resolution bricks feel 3 JND rougher.",
        ),
    ]
    write_atomically(path, render_page("tile.html.j2", scripts=(), pair={"title": name}, lines=lines))
