"""Parts of the benchmark from trimesh: run from the root.

python -m benchmarks.objects.parts.in_trimesh FOLDER

Lengths are in mm.
"""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import trimesh

from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts

LARGEST_MM, FINEST_MM = 0.6, 0.03
"""Standard deviation of the scanned pebble's bumps, mm, and of the noise of its points, mm."""


def capsule() -> trimesh.Trimesh:
    """A capsule of 18 mm radius, 66 mm long, in slivers along its length and at its poles."""
    mesh: trimesh.Trimesh = trimesh.creation.capsule(height=30.0, radius=18.0, count=[128, 256])
    return mesh


def scan() -> trimesh.Trimesh:
    """A pebble of 44 x 32 x 22 mm as a scanner gives it: bumps of 2 to 10 mm, and noise at every point."""
    mesh = trimesh.creation.icosphere(subdivisions=5)
    random = np.random.default_rng(0)
    points = mesh.vertices * (22.0, 16.0, 11.0)
    waves = random.normal(size=(60, 3)) / random.uniform(2.0, 10.0, (60, 1))
    bumps = np.cos(points @ waves.T + random.uniform(0.0, 2.0 * np.pi, 60)).sum(axis=1)
    away = LARGEST_MM * bumps / bumps.std() + FINEST_MM * random.normal(size=len(points))
    mesh.vertices = points + away[:, None] * mesh.vertex_normals
    return mesh


PARTS: dict[str, Callable[[], trimesh.Trimesh]] = {"capsule": capsule, "scan": scan}


def main() -> None:
    for name, make in PARTS.items():
        mesh = make()
        vertices = np.array(mesh.vertices, dtype=np.float64).round(4)
        path = write_parts(Path(sys.argv[1], f"{name}.3mf"), [Part(name, Body(vertices, mesh.faces))])
        print(f"{path}: {len(mesh.faces)} triangles, {path.stat().st_size // 1024} KiB", flush=True)


if __name__ == "__main__":
    main()
