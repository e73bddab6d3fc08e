"""Readers of scans: height maps with holes, meshes seen from above, and points x, y, z as text.

Every file is hostile until it is read.
"""

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial import Delaunay, QhullError

from relief.ground.arrays import Array, Index
from relief.ground.errors import InputError, naming
from relief.ground.formats import GRIDS, HEIGHTS, MEASURED, MESHES, UNITS, is_mesh
from relief.ground.lengths import scale_of, within
from relief.ground.limits import LARGEST_SIDE, SMALLEST_SIDE
from relief.ground.progress import stage
from relief.heightmap import given_or_stored, load_content, required, unit_mm
from relief.reading.profilometers import is_measured
from relief.reading.samples import without_stand_ins
from relief.reading.text_grids import read_points
from relief.scans.scans import Scan, block_means, check_scan
from relief.solids.body import Body
from relief.solids.files.mesh import Mesh, check_units, read_mesh
from relief.solids.meshes.raster import rasterise

POINTS = (".xyz", *GRIDS)
"""Suffixes of files of points."""
SUFFIXES = tuple(dict.fromkeys((*HEIGHTS, *MESHES, *POINTS)))
"""Suffixes of the files that are read as scans."""
MOST_POINTS = 4_000_000
"""Most points on no grid; a million are joined to triangles in 10 seconds."""
FINEST_SIDE = 2048
"""Most samples a side on which triangles and points are sampled."""
LONGEST_EDGE = 6.0
"""Longest edge of a triangle between points, in median edges; a longer one spans a hole."""
LEVELLED_DEGREES = 3.0
"""Least angle between the mean normal of an open mesh and z of a mesh that is turned upright; registration
finds smaller tilts."""
OPEN = 0.3
"""Least length of the mean unit normal of an open mesh; that of a closed body is 0."""
ON_GRID = 1e-3
"""Share of the distance of neighbours by which points of a grid may be off it."""
MOST_SHARED = 0.01
"""Largest share of points that lie on the sample of another one, on a grid."""


@dataclass(frozen=True)
class ScanLengths:
    """Lengths that a file of a scan may lack; None takes the file's, or the default.

    Attributes:
        units: of x, y and z of a mesh or of points, or of the heights of a height map that holds numbers, a
            key of `UNITS`; mm by default.
        size_mm: width of a height map.
        relief_mm: height of white above black of a picture.
        height_scale: mm for a height of 1 of a height map that holds numbers, or for a z of 1 of points.
    """

    units: str | None = None
    size_mm: float | None = None
    relief_mm: float | None = None
    height_scale: float | None = None


def read_scan(path: str | os.PathLike[str], lengths: ScanLengths | None = None) -> Scan:
    """Read a scan.

    Args:
        path: PNG or TIFF (grey is height), EXR, NPY or float TIFF (mm, not finite in holes), texts of such
            numbers; files of profilometers, with their size and unit; STL, OBJ, PLY, GLB, 3MF or STEP, seen
            from above; or lines of x, y and z in mm.
        lengths: lengths that the file lacks.

    Returns:
        The scan, cropped to its measured samples.

    Raises:
        InputError: the file cannot be read, a length is missing or is for another kind of file, or there are
            more holes than surface.
    """
    path, lengths = Path(path), lengths or ScanLengths()
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        expected = ", ".join(one for one in SUFFIXES if one not in MEASURED)
        raise InputError(f"{path}: not a scan: expected one of {expected}, or of a profilometer")
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    with stage(f"reading {path.name}"):
        is_text = suffix in POINTS and not is_measured(path)
        # Fewer columns than a scan has samples are those of points.
        points = read_points(path, SMALLEST_SIDE - 1) if is_text else None
        if is_text and points is None and suffix not in HEIGHTS:
            raise InputError(f"{path}: holds {SMALLEST_SIDE} columns or more, not points; name a table .txt")
        if points is None and not is_mesh(path):
            return check_scan(_of_height_map(path, lengths))
        for name in ("size_mm", "relief_mm", *(["height_scale"] if points is None else [])):
            if getattr(lengths, name) is not None:
                kind = "a mesh has units" if points is None else "points have units and height_scale"
                raise InputError(f"{path}: {name}: is for height maps; {kind}")
        if points is None:
            return check_scan(_of_mesh(read_mesh(path, units=lengths.units)))
        check_units(path, lengths.units)
        without_stand_ins(points[:, 2], usual=False)
        return check_scan(_of_points(points * _units_mm(path, lengths), str(path)))


def _units_mm(path: Path, lengths: ScanLengths) -> Array:
    """(3,) mm for x, y and z of 1. Raises InputError."""
    with naming(path):
        height_scale = within("height_scale", lengths.height_scale)
    unit = UNITS[lengths.units or "mm"]
    return np.array([unit, unit, unit if height_scale is None else height_scale])


def _of_height_map(path: Path, lengths: ScanLengths) -> Scan:
    content = load_content(path)
    for wrong in ("relief_mm",) if content.holds_numbers else ("height_scale", "units"):
        if getattr(lengths, wrong) is not None:
            kind = "numbers" if content.holds_numbers else "grey"
            raise InputError(f"{path}: {wrong}: is for another kind of height map; this one holds {kind}")
    with naming(path):
        scale = within("height_scale", scale_of(lengths.units, lengths.height_scale))
        size_mm, relief_mm = within("size_mm", lengths.size_mm), within("relief_mm", lengths.relief_mm)
    width_mm = given_or_stored(content, "size_mm", size_mm)
    grid = f"the file, a grid of {content.width} x {content.height} heights,"
    width_mm = required("size_mm", width_mm, f"the width of the scan in mm, which {grid} does not say", path)
    values = without_stand_ins(content.values, usual=False) if content.holds_numbers else content.values
    heights = values * unit_mm(content, relief_mm, scale)
    return Scan(heights, width_mm / heights.shape[1], str(path))


def _of_mesh(mesh: Mesh) -> Scan:
    """The upper side of a mesh, which lies with its relief upward if it is a body."""
    normals = mesh.body.normals
    total = normals.sum(axis=0)
    length = float(np.linalg.norm(total))
    vertices = mesh.body.vertices
    if length > OPEN * float(np.linalg.norm(normals, axis=1).sum()):
        # Faces may be turned inside out, so the mean normal counts upward.
        up = total / length * (1.0 if total[2] >= 0.0 else -1.0)
        if up[2] < np.cos(np.radians(LEVELLED_DEGREES)):
            vertices = vertices @ _upright(up).T
            normals = Body(vertices, mesh.body.faces).normals
    area_mm2 = 0.5 * float(np.abs(normals[:, 2]).sum())
    # Of a plate one half of the area is the bottom, which has next to no vertices.
    closed = length <= OPEN * float(np.linalg.norm(normals, axis=1).sum())
    area_mm2 *= 0.5 if closed else 1.0
    pitch_mm = float(np.sqrt(area_mm2 / len(vertices)))
    return _of_triangles(vertices, mesh.body.faces, pitch_mm, str(mesh.path))


def _upright(up: Array) -> Array:
    """(3, 3) rotation that brings a unit vector, which does not point down, to z on the shortest way."""
    x, y, z = up
    share = 1.0 / (1.0 + z)
    return np.array(
        [[1.0 - x * x * share, -x * y * share, -x], [-x * y * share, 1.0 - y * y * share, -y], up]
    )


def _of_triangles(vertices: Array, faces: Index, pitch_mm: float, name: str) -> Scan:
    """Triangles seen from above, at samples of this pitch, or as near as their number allows."""
    middle = 0.5 * (vertices.max(axis=0) + vertices.min(axis=0))
    size_mm = float(np.ptp(vertices[:, :2], axis=0).max())
    if not size_mm > 0.0 or not pitch_mm > 0.0:
        raise InputError(f"{name}: has no extent seen from above")
    samples = int(np.clip(round(size_mm / pitch_mm), SMALLEST_SIDE, FINEST_SIDE))
    corners = (vertices - middle)[faces]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    # Upright faces cover no sample.
    seen = np.abs(normals[:, 2]) > 1e-9 * np.linalg.norm(normals, axis=1)
    corners, normals = corners[seen], normals[seen]
    slopes = np.repeat((-normals[:, :2] / normals[:, 2:])[:, None], 3, axis=1)
    heights = rasterise(corners, slopes, size_mm, samples)
    heights = np.where(np.isfinite(heights), heights, np.nan)
    # Linear interpolation at places that lie anywhere between vertices blurs by this on average.
    return Scan(heights, size_mm / samples, name, variance_mm2=pitch_mm**2 / 6.0)


def _of_points(points: Array, name: str) -> Scan:
    """Points on a grid as its samples; any others as triangles between them."""
    points = points[np.isfinite(points[:, 2])]
    if lost := np.count_nonzero(~np.isfinite(points[:, :2]).all(axis=1)):
        raise InputError(f"{name}: {lost} of its points have a height, but x or y is no number")
    if len(points) < SMALLEST_SIDE**2:
        raise InputError(f"{name}: {len(points)} points; at least {SMALLEST_SIDE**2} are needed")
    scan = _on_grid(points, name)
    if scan is not None:
        return scan
    for columns in ((1, 2, 0), (0, 2, 1)):
        if _on_grid(points[:, columns], name) is not None:
            pair = f"columns {columns[0] + 1} and {columns[1] + 1} lie on a grid, and not the first two"
            raise InputError(f"{name}: {pair}; x, y and z stand in this order, or a line above names them")
    if len(points) > MOST_POINTS:
        raise InputError(f"{name}: {len(points)} points on no grid; at most {MOST_POINTS} are read")
    try:
        faces = Delaunay(points[:, :2] - points[:, :2].mean(axis=0)).simplices
    except QhullError as error:
        raise InputError(f"{name}: the points lie on a line") from error
    edges = np.stack([np.hypot(*(points[faces[:, n]] - points[faces[:, n - 1]])[:, :2].T) for n in range(3)])
    typical = float(np.median(edges))
    kept = faces[edges.max(axis=0) <= LONGEST_EDGE * typical]
    if not len(kept):
        raise InputError(f"{name}: the points lie too unevenly to be joined to a surface")
    pitch_mm = float(np.sqrt(_area_mm2(points, kept) / len(points)))
    return _of_triangles(points, kept.astype(np.int64), pitch_mm, name)


def _area_mm2(points: Array, faces: Index) -> float:
    one, other = ((points[faces[:, n]] - points[faces[:, 0]])[:, :2] for n in (1, 2))
    return 0.5 * float(np.abs(one[:, 0] * other[:, 1] - one[:, 1] * other[:, 0]).sum())


def _on_grid(points: Array, name: str) -> Scan | None:
    """The samples of points (n, 3), all finite, that lie on a grid along x and y; None if they do not."""
    places, pitches = [], []
    for values in points[:, :2].T:
        steps = np.diff(np.unique(values))
        steps = steps[steps > ON_GRID * steps.max()] if len(steps) else steps
        if not len(steps):
            return None
        # Rounding in the text makes steps differ, and missing columns make some of them longer.
        pitch = float(np.median(steps))
        at = (values - values.min()) / pitch
        pitch *= float(at.max() / max(1.0, np.rint(at.max())))
        at = (values - values.min()) / pitch
        if np.abs(at - np.rint(at)).max() > 20.0 * ON_GRID + 0.1:
            return None
        places.append(np.rint(at).astype(np.int64))
        pitches.append(pitch)
    cols, rows = (int(each.max()) + 1 for each in places)
    coarse = max(pitches)
    if max(rows, cols) > LARGEST_SIDE or rows * cols > 4 * len(points):
        return None
    heights = np.full((rows, cols), np.nan)
    heights[rows - 1 - places[1], places[0]] = points[:, 2]
    if np.isfinite(heights).sum() < (1.0 - MOST_SHARED) * len(points):
        return None
    times = [max(1, round(coarse / pitch)) for pitch in pitches]
    if abs(pitches[0] * times[0] - pitches[1] * times[1]) > 0.01 * coarse:
        return None
    return Scan(block_means(heights, times[1], times[0]), pitches[0] * times[0], name)
