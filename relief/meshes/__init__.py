"""Meshes: read from files of other programs, checked as solids, and unrolled around a point."""

from relief.meshes.intersections import self_intersections
from relief.meshes.mesh import Mesh, read_mesh
from relief.meshes.repair import mended, united_parts
from relief.meshes.solid import check_solid, outer_body

__all__ = ["Mesh", "check_solid", "mended", "outer_body", "read_mesh", "self_intersections", "united_parts"]
