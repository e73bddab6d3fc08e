"""Meshes: read from files of other programs, checked as solids, and unrolled around a point."""

from relief.solids.meshes.intersections import self_intersections
from relief.solids.meshes.mesh import Mesh, read_mesh
from relief.solids.meshes.solid import check_solid, outer_body

__all__ = ["Mesh", "check_solid", "outer_body", "read_mesh", "self_intersections"]
