"""Meshes: read from files of other programs, checked as solids, and unrolled around a point."""

from relief.meshes.intersections import self_intersections
from relief.meshes.mesh import Mesh, read_mesh
from relief.meshes.solid import check_solid, outer_body

__all__ = ["Mesh", "check_solid", "outer_body", "read_mesh", "self_intersections"]
