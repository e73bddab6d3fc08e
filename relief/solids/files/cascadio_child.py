"""Child process that divides a STEP file into triangles: the CAD kernel can crash or never return.

`python cascadio_child.py FINE_MM`: the file comes from standard input; out come a line with the largest
distance of facets from the surface, mm, not below FINE_MM, and a GLB.
"""

import json
import os
import sys
from contextlib import suppress

MEMORY = 4 << 30
"""Most bytes of address space of the process; a file of 100 MB takes 1.8 GB."""
COARSE_MM, ANGLE = 0.08, 0.2
"""Largest distance, mm, of facets from the surface in a first try, which shows the size of a part, and angle,
rad, between them in all. Parabolas over arcs of 0.2 rad are within a hundredth of their chord height."""
ENOUGH = 200_000
"""Triangles, about, to which parts are divided; larger ones have coarser facets. The kernel takes
half a minute for as many on one torus."""


def main() -> None:
    # Messages of the kernel must not mix with the GLB.
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)
    with suppress(ImportError, ValueError, OSError):
        import resource

        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
    import cascadio

    data = sys.stdin.buffer.read()

    def glb(chord_mm: float) -> bytes:
        return cascadio.load(data, "step", tol_linear=chord_mm, tol_angular=ANGLE, use_parallel=False)

    content, chord_mm = glb(COARSE_MM), COARSE_MM
    if content:
        # The number of triangles of round faces grows no faster than the distance falls.
        finer = min(COARSE_MM, max(float(sys.argv[1]), COARSE_MM * _count(content) / ENOUGH))
        if finer < COARSE_MM:
            content, chord_mm = glb(finer), finer
    out.write(f"{chord_mm:g}\n".encode() + content)
    out.close()
    # The kernel may crash when it is taken down.
    os._exit(0)


def _count(content: bytes) -> int:
    """Number of the triangles of a GLB, each part once."""
    document = json.loads(content[20 : 20 + int.from_bytes(content[12:16], "little")])
    used = [
        each["indices"]
        for mesh in document.get("meshes", [])
        for each in mesh["primitives"]
        if "indices" in each
    ]
    return sum(document["accessors"][index]["count"] for index in used) // 3


if __name__ == "__main__":
    main()
