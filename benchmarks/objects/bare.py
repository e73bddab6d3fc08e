"""Whether what carries no texture comes out of `retouch wrap` as it came in.

python -m benchmarks.objects.bare [--seeds N] [--parts] [--as before] [--again] [NAME ...]

Triangles of a file are *touched* where the share of the relief is above 0 somewhere, *rim* where they share
an edge with touched ones, and *bare* elsewhere. The classes come from masks at dense samples of the file's
own triangles, and what was written is read back: bare triangles have to be there to the last bit of single
precision, rim triangles divided in their own planes, and the whole closed and without crossings.

Random masks, falloffs, heights and textures on the twenty parts of `benchmarks/objects/parts`, a seed each;
resumable. `--parts` wraps the parts and their eight finer exports without a mask instead, at 200,000
triangles, and `--as before` keeps these numbers as those to compare with.
"""

import signal
import time
from argparse import Namespace
from collections import Counter
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import pyvista as pv
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

import retouch
from benchmarks.objects.bundled import TEXTURE
from benchmarks.objects.parts.__main__ import HERE, NAMES
from benchmarks.objects.random_unions import pierced
from benchmarks.shared.common import kept, load, parser_of, table
from optimize.settings.skins import load_skin
from optimize.verification.solids.mesh_feel import feel_of
from relief.ground.arrays import Array, Index, extents, units
from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.files import read_mesh
from relief.solids.wrapping.masks import Points, mask_at

RESULT, COMMAND = "bare", "benchmarks.objects.bare"
SEEDS, SEED_FACES, FACES, PLACES = 200, 60_000, 200_000, 12
"""Random masks, triangles of their parts and of the unmasked ones, and places that are felt of these."""
MOST_CPU_S = 180.0
"""CPU seconds after which a wrap is ended, as of benchmarks.objects.parts."""
TILES = ("leather-tile", "gravel-tile", "bark-tile")
SPACING_MM = 0.25
"""Largest distance of the samples of a triangle, mm: well below the 2 mm over which textures end."""
TOUCHED = 1e-6
"""Share of the relief from which a place carries texture: 1 nm of a relief of 1 mm."""
BOTTOM_MM, LEAST_BOTTOM_MM2 = 0.002, 4.0
"""Height, mm, up to which triangles that point down are the bottom, and its least area, mm²."""
FAR_MM = 2.5
"""Distance from any texture, mm, at which touched triangles lie on the file: their even edges are 1 mm."""
RIM_UM = 1.0
"""Largest distance of rim triangles from the file, µm."""
LEAST_MM2 = 20.0
"""Least area of a random mask, in areas with the whole relief, mm²; smaller ones are drawn again."""
TURNS = (20.0, 40.0, 60.0, 180.0)
"""Largest angles, degrees, between neighbours that may share a normal; the last one takes all."""
PIECE_MM = 0.1
"""Least radius of the pieces by which triangles near one another are sought, mm."""
FEW_PAIRS = 1_000_000
"""Pairs of triangles that are compared as they are, without a search."""
Chosen = NDArray[np.bool_]


class Samples:
    """Samples of the triangles of a body, corners included.

    Attributes:
        face: (n,) triangles.
        weights: (n, 3) barycentric coordinates.
        at: (n, 3) mm.
    """

    def __init__(self, body: Body, spacing_mm: float = SPACING_MM) -> None:
        """Take rows of samples along the longest side of each triangle."""
        corners = body.vertices[body.faces]
        sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
        longest = sides.max(axis=1)
        heights = 2.0 * body.areas / np.maximum(longest, 1e-30)
        count = np.maximum(np.ceil(heights / spacing_mm).astype(np.int64), 1)
        row_face, row = _repeated(count + 1)
        up = row / count[row_face]
        along = np.ceil((1.0 - up) * longest[row_face] / spacing_mm).astype(np.int64)
        along = np.where(row == count[row_face], 0, np.maximum(along, 1))
        of_row, number = _repeated(along + 1)
        self.face, up = row_face[of_row], up[of_row]
        right = number / np.maximum(along[of_row], 1)
        turned = np.stack([(1.0 - up) * (1.0 - right), (1.0 - up) * right, up], axis=1)
        self.weights = np.empty_like(turned)
        corner = (np.argmax(sides, axis=1)[self.face, None] + np.arange(3)) % 3
        np.put_along_axis(self.weights, corner, turned, axis=1)
        self.at = np.einsum("nc,ncd->nd", self.weights, corners[self.face])


def _repeated(count: Index) -> tuple[Index, Index]:
    """Items, each as often as its count (n,), and numbers from 0 within each."""
    item = np.repeat(np.arange(len(count)), count)
    return item, np.arange(len(item)) - np.repeat(np.cumsum(count) - count, count)


def shares_at(
    samples: Samples,
    body: Body,
    mask: str | None,
    falloff_mm: float,
    colours: Array | None = None,
) -> Array:
    """Shares (n,) of the relief at samples of a body by a mask.

    Masks by angles take the normals of triangles, and means around corners over neighbours that turn by less
    than some angles, for each sample those that give it the largest share: which of them a smooth surface has
    is for `retouch wrap` to say.
    """
    if mask is None:
        return np.ones(len(samples.face))
    painted = None if colours is None else np.einsum("nc,ncd->nd", samples.weights, colours[samples.face])
    normals = [np.repeat(units(body.normals)[:, None], 3, axis=1)]
    if "angle" in mask:
        normals += [_corner_normals(body, turn) for turn in TURNS]
    return np.max([_shares(mask, samples, each, painted, falloff_mm) for each in normals], axis=0)


def _shares(mask: str, samples: Samples, normals: Array, colours: Array | None, falloff_mm: float) -> Array:
    """Shares (n,) at samples by unit normals (faces, 3, 3) at the corners."""
    there = units(np.einsum("nc,ncd->nd", samples.weights, normals[samples.face]))
    return mask_at(mask, Points(samples.at, there, None, {}, colours), falloff_mm)


def _corner_normals(body: Body, turn_deg: float) -> Array:
    """(faces, 3, 3) normals at corners, means over triangles that turn by less than an angle, by theirs."""
    corners, count = body.vertices[body.faces], 3 * len(body.faces)
    on, back = (units(np.roll(corners, step, axis=1) - corners) for step in (-1, 1))
    angles = np.arccos(np.clip((on * back).sum(axis=2), -1.0, 1.0)).ravel()
    normals = np.repeat(units(body.normals), 3, axis=0)
    at = sp.csr_matrix((np.ones(count), (np.arange(count), body.faces.ravel())))
    one, other = (at @ at.T).nonzero()
    near = (normals[one] * normals[other]).sum(axis=1) >= np.cos(np.radians(turn_deg)) - 1e-9
    around = sp.csr_matrix((angles[other[near]], (one[near], other[near])), (count, count))
    return units(np.asarray(around @ normals)).reshape(-1, 3, 3)


def left_alone(body: Body) -> Chosen:
    """(faces,) those of a flat bottom and of sealed hollows, which carry no texture unless asked for."""
    corners, normals, areas = body.vertices[body.faces], body.normals, body.areas
    lowest = (corners[:, :, 2] <= body.vertices[:, 2].min() + BOTTOM_MM).all(axis=1)
    bottom = lowest & (normals[:, 2] < -0.9999 * np.linalg.norm(normals, axis=1))
    pairs = np.concatenate([body.faces[:, :2], body.faces[:, 1:]])
    shell = _components(pairs, len(body.vertices))[body.faces[:, 0]]
    volume = np.bincount(shell, np.einsum("nd,nd->n", corners[:, 0], normals))
    return np.asarray(bottom & (areas[bottom].sum() >= LEAST_BOTTOM_MM2) | (volume < 0.0)[shell])


def _components(pairs: Index, count: int) -> Index:
    graph = sp.coo_matrix((np.ones(len(pairs), np.int8), pairs.T), (count, count))
    return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)


def check(file: Body, out: Body, samples: Samples, share: Array, still: Chosen) -> dict[str, Any]:
    """How a body that was written differs from that of the file where no texture lies.

    Args:
        file: The body as its file holds it, mm, each position once.
        out: The body as it was written, read back.
        samples: Of the file's body.
        share: (n,) of the relief at the samples, 0 to 1.
        still: (faces,) of the file, those that carry no texture whatever their shares are.

    Returns:
        Counts and distances by name; those of `WRONG` are 0 or small in a right one.
    """
    share = np.where(still[samples.face], 0.0, share)
    touched = np.bincount(samples.face, share > TOUCHED, len(file.faces)) > 0
    rim = _beside(file.faces, touched) & ~touched
    bare = ~touched & ~rim
    verbatim = among(triangles_of(out), triangles_of(file))
    missing = ~among(triangles_of(file), triangles_of(out))
    corners = np.unique(file.faces[rim])
    here = among(_rows(file.vertices[corners]), _rows(out.vertices))
    carries = share > TOUCHED
    # Without texture, but in a triangle that has some elsewhere.
    far = np.flatnonzero(touched[samples.face] & ~carries)
    if len(far) and carries.any():
        far = far[
            cKDTree(samples.at[carries]).query(samples.at[far], distance_upper_bound=FAR_MM)[0] > FAR_MM
        ]
    return {
        "triangles": len(out.faces),
        "touched": int(touched.sum()),
        "rim": int(rim.sum()),
        "bare": int(bare.sum()),
        "open_edges": open_edges(out),
        "fans": max(extra_fans(out) - extra_fans(file), 0),
        "crossings": crossings(out, ~verbatim),
        "bare_missing": int((missing & bare).sum()),
        "rim_um": 1e3 * farthest(samples.at[rim[samples.face]], out),
        "rim_vertices_missing": int((~here).sum()),
        "far_um": 1e3 * farthest(samples.at[far], out),
    }


WRONG = {
    "open_edges": 0,
    "fans": 0,
    "crossings": 0,
    "bare_missing": 0,
    "rim_um": RIM_UM,
    "rim_vertices_missing": 0,
    "far_um": RIM_UM,
}
"""Numbers of `check`, and the largest of each that is right."""


def faults(row: Mapping[str, Any]) -> list[str]:
    """The numbers of `check` that are not right, as "rim_um 312"."""
    return [f"{name} {row[name]:.4g}" for name, most in WRONG.items() if row[name] > most]


def triangles_of(body: Body) -> NDArray[np.void]:
    """(faces,) the corners of triangles in single precision, from the lowest corner on, as one item each."""
    at = _rows(body.vertices)
    corner = np.unique(at, return_inverse=True)[1][body.faces]
    turn = (np.argmin(corner, axis=1)[:, None] + np.arange(3)) % 3
    return _rows(body.vertices[np.take_along_axis(body.faces, turn, axis=1)].reshape(-1, 9))


def _rows(numbers: Array) -> NDArray[np.void]:
    """(n,) rows (n, k) in single precision as one item each; adding 0 makes -0 and 0 the same bytes."""
    single = np.ascontiguousarray(numbers.astype(np.float32) + np.float32(0.0))
    return single.view(np.dtype((np.void, 4 * single.shape[1]))).ravel()


def among(rows: NDArray[np.void], others: NDArray[np.void]) -> Chosen:
    """(n,) whether rows are among others."""
    number = np.unique(np.concatenate([rows, others]), return_inverse=True)[1]
    return np.isin(number[: len(rows)], number[len(rows) :])


def _half_edges(faces: Index) -> tuple[Index, Index]:
    """Numbers (3 m,) of the directed edges of triangles (m, 3), and of the same edges the other way."""
    start, end = faces.ravel().astype(np.int64), np.roll(faces, -1, axis=1).ravel().astype(np.int64)
    return start << 32 | end, end << 32 | start


def _beside(faces: Index, chosen: Chosen) -> Chosen:
    """(m,) whether triangles share an edge with chosen ones."""
    way, back = _half_edges(faces)
    edges = np.minimum(way, back)
    beside = np.isin(edges, edges[np.repeat(chosen, 3)]).reshape(-1, 3)
    return np.asarray(beside.any(axis=1), dtype=bool)


def open_edges(body: Body) -> int:
    """Number of edges that do not have as many triangles on one side as on the other."""
    way, back = _half_edges(body.faces)
    edges, number = np.unique(np.minimum(way, back), return_inverse=True)
    return int(np.count_nonzero(np.bincount(number, np.where(way < back, 1.0, -1.0), len(edges))))


def extra_fans(body: Body) -> int:
    """Number of fans around vertices beyond one each, and of triangles at edges beyond two."""
    way, back = _half_edges(body.faces)
    order = np.argsort(np.minimum(way, back), kind="stable")
    sorted_ = np.minimum(way, back)[order]
    same = np.flatnonzero(sorted_[1:] == sorted_[:-1])
    one, other = order[same], order[same + 1]
    # A half-edge has its number's corner at its start; the next corner of the triangle is its end.
    ends = [3 * (half // 3) + (half % 3 + 1) % 3 for half in (one, other)]
    corner = body.faces.ravel()
    turned = corner[one] == corner[ends[1]]
    pairs = [np.where(turned, ends[1], other), np.where(turned, other, ends[1])]
    joined = np.concatenate([np.stack([one, pairs[0]], 1), np.stack([ends[0], pairs[1]], 1)])
    fans = int(_components(joined, len(corner)).max()) + 1
    return fans - len(np.unique(corner)) + len(same) - len(np.unique(sorted_[same]))


def crossings(body: Body, new: Chosen) -> int:
    """Number of pairs of triangles, one of them new (faces,), of which an edge passes through the other."""
    if not new.any():
        return 0
    corners = body.vertices[body.faces]
    low, high = extents(corners)
    pairs = []
    for one, other in _near(corners, new):
        meets = ((low[one] < high[other]) & (low[other] < high[one])).all(axis=1)
        pairs.append(np.unique(np.minimum(one, other)[meets] << 32 | np.maximum(one, other)[meets]))
    keys = np.unique(np.concatenate(pairs))
    one, other = keys >> 32, keys & 0xFFFFFFFF
    shared = (body.faces[one][:, :, None] == body.faces[other][:, None, :]).any(axis=2).sum(axis=1)
    one, other = one[shared < 2], other[shared < 2]
    return int((pierced(corners, one, other) | pierced(corners, other, one)).sum())


def _near(corners: Array, new: Chosen) -> Iterator[tuple[Index, Index]]:
    """Blocks of pairs of triangles (m, 3, 3) that may meet, at least one of each a new one (m,).

    Small ones are sought by their middles, wide ones near them by those of pieces. Then come the wide ones
    among themselves, as pieces of fans lie close together where they meet.
    """
    middle = corners.mean(axis=1)
    radius = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
    numbers = np.arange(len(corners))
    while new[numbers].any():
        fresh, count = numbers[new[numbers]], len(numbers)
        if len(fresh) * count <= FEW_PAIRS:
            yield np.repeat(fresh, count), np.tile(numbers, len(fresh))
            return
        most = max(float(np.quantile(radius[fresh], 0.9)), PIECE_MM)
        small, wide = numbers[radius[numbers] <= most], numbers[radius[numbers] > most]
        own, old = small[new[small]], small[~new[small]]
        tree = cKDTree(middle[own])
        one, other = own[tree.query_pairs(2.0 * most, output_type="ndarray")].T
        yield one, other
        for some, points, faces in (
            (own, middle[old], old),
            (own, *_pieces(corners, wide[~new[wide]], most, tree)),
            (small, *_pieces(corners, wide[new[wide]], most, cKDTree(middle[small]))),
        ):
            tree = cKDTree(middle[some])
            found = cKDTree(points).sparse_distance_matrix(tree, 2.0 * most, output_type="ndarray")
            yield faces[found["i"]], some[found["j"]]
        numbers = wide


def _pieces(corners: Array, face: Index, most_mm: float, near: cKDTree) -> tuple[Array, Index]:
    """Middles (k, 3) of pieces of triangles, (n,) numbers, no wider than a radius, mm, and their triangles.

    Pieces are left out that are too far from the middles of triangles of that radius, a tree.
    """
    middles, faces, corners = [np.empty((0, 3))], [face[:0]], corners[face]
    while len(face):
        middle = corners.mean(axis=1)
        radius = np.linalg.norm(corners - middle[:, None], axis=2).max(axis=1)
        beside = near.query(middle)[0] <= radius + most_mm
        wide = beside & (radius > most_mm)
        middles.append(middle[beside & ~wide])
        faces.append(face[beside & ~wide])
        corners, face = _halved(corners[wide]), np.tile(face[wide], 2)
    return np.concatenate(middles), np.concatenate(faces)


def _halved(corners: Array) -> Array:
    """Both halves (2 n, 3, 3) of triangles (n, 3, 3), divided at their longest sides."""
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    turn = (np.argmax(sides, axis=1)[:, None] + np.arange(3)) % 3
    a, b, c = np.moveaxis(np.take_along_axis(corners, turn[:, :, None], axis=1), 1, 0)
    middle = 0.5 * (a + b)
    return np.concatenate([np.stack([a, middle, c], 1), np.stack([middle, b, c], 1)])


def farthest(points: Array, body: Body) -> float:
    """Largest distance of points (n, 3) from the surface of a body, mm; 0 without points."""
    if not len(points):
        return 0.0
    faces: Any = body.faces
    surface = pv.PolyData.from_regular_faces(body.vertices, faces)
    _, nearest = surface.find_closest_cell(points, return_closest_point=True)
    return float(np.linalg.norm(nearest - points, axis=1).max())


def random_mask(random: np.random.Generator, body: Body) -> str:
    """One to three conditions of random kinds, joined by & and |, some of them inverted or with ramps."""
    text = _condition(random, body)
    for _ in range(random.integers(3)):
        other = _condition(random, body)
        other = f"not ({other})" if random.random() < 0.3 else other
        text = f"({text}) {random.choice(['&', '|'])} {other}"
    return text


def _condition(random: np.random.Generator, body: Body) -> str:
    """A half-space of x, y or z, an angle of normals or a turn about z, with one number or a ramp."""
    kind, sign = random.integers(5), random.choice(["<", ">"])
    if kind < 3:
        name, low, high = "xyz"[kind], *np.quantile(body.vertices[:, kind], (0.0, 1.0))
        start = random.uniform(low + 0.1 * (high - low), high - 0.1 * (high - low))
        width = random.uniform(0.3, 4.0)
    elif kind == 3:
        name = random.choice(["angle", "angle:-z", "angle:x", "angle:-y"])
        start, width = random.uniform(20.0, 120.0), random.uniform(5.0, 40.0)
    else:
        name, start, width = "turn", random.uniform(20.0, 340.0), random.uniform(5.0, 40.0)
    ramp = f"..{start + width:.3f}" if random.random() < 0.3 else ""
    return f"{name}{sign}{start:.3f}{ramp}"


def drawn(seed: int) -> tuple[str, dict[str, Any]]:
    """A part and options of `retouch wrap` by a seed, with a mask that leaves `LEAST_MM2` at least."""
    random = np.random.default_rng(seed)
    name = str(random.choice([name for name in NAMES if not name.endswith("-fine")]))
    body = read_mesh(HERE / f"{name}.3mf").body
    samples, still = Samples(body), left_alone(body)
    options: dict[str, Any] = {
        "texture": str(random.choice(TILES)),
        "falloff_mm": float(np.round(np.exp(random.uniform(np.log(0.3), np.log(4.0))), 2)),
        "level": float(random.integers(2)),
        "relief_mm": float(np.round(random.uniform(0.2, 0.8), 2)),
    }
    while True:
        mask = random_mask(random, body)
        share = np.where(still[samples.face], 0.0, shares_at(samples, body, mask, options["falloff_mm"]))
        count = np.bincount(samples.face, minlength=len(body.faces))
        mean = np.bincount(samples.face, share, len(body.faces)) / count
        if (mean * body.areas).sum() >= LEAST_MM2:
            return name, options | {"mask": mask}


def wrapped_and_checked(file: Path, suffix: str, texture: str, options: Mapping[str, Any]) -> dict[str, Any]:
    """Outcome of `retouch.wrap` on a file and numbers of `check`, or the line that refuses the file."""
    body = read_mesh(file).body
    samples, still = Samples(body), left_alone(body)
    with TemporaryDirectory() as folder:
        out, began = Path(folder) / f"out{suffix}", time.process_time()
        try:
            with limited(MOST_CPU_S):
                # Bores carry texture here as masks say, so that shares alone tell the classes.
                result = retouch.wrap(texture, file, out, quiet=True, keep_holes_mm=0.0, **options)
        except (InputError, TimeoutError) as fault:
            return {"refused": str(fault).replace(str(file), file.name), "cpu_s": time.process_time() - began}
        row = {"cpu_s": time.process_time() - began, "suffix": suffix}
        share = shares_at(samples, body, options.get("mask"), options.get("falloff_mm", 2.0))
        row |= check(body, read_mesh(out).body, samples, share, still)
        row["off_um"] = 1e3 * farthest(result.wrapped.original.vertices, body)
        row["lowered"] = result.wrapped.lowering.part
        if "mask" not in options:
            row |= felt(out, file)
        numbers = {name: value for name, value in result.as_json().items() if isinstance(value, int | float)}
    return row | {"faults": faults(row), "told": numbers}


@contextmanager
def limited(most_s: float) -> Iterator[None]:
    """Raise TimeoutError in what takes more CPU seconds than a limit."""

    def end(*_: object) -> None:
        raise TimeoutError(f"took more than {most_s:g} CPU s")

    before = signal.signal(signal.SIGPROF, end)
    signal.setitimer(signal.ITIMER_PROF, most_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


def felt(out: Path, file: Path) -> dict[str, Any]:
    """Roughness of a wrapped part over its own shape at a few places, where there are places to feel it."""
    try:
        feel = feel_of(read_mesh(out), load_skin("paper"), "layer", PLACES, read_mesh(file))
    except InputError as fault:
        return {"not_felt": str(fault)}
    return {"roughness": float(feel.values["roughness"].mean()), "places": len(feel.crops)}


def seeded(seed: int) -> dict[str, Any]:
    """Outcome of a random mask."""
    name, options = drawn(seed)
    suffix = (".stl", ".3mf")[seed % 2]
    texture = str(options.pop("texture"))
    row = wrapped_and_checked(HERE / f"{name}.3mf", suffix, texture, options | {"faces": SEED_FACES})
    return {"part": name, "texture": texture, **options, **row}


def without_mask(name: str) -> dict[str, Any]:
    """Outcome of a part without a mask."""
    return wrapped_and_checked(HERE / f"{name}.3mf", ".3mf", TEXTURE, {"faces": FACES})


def summary(rows: Mapping[str, Mapping[str, Any]]) -> str:
    """How many masks came out, how many of these have faults, and the lines of the others."""
    out = [row for row in rows.values() if "refused" not in row]
    counts = [
        (name, sum(row[name] > most for row in out), max(row[name] for row in out))
        for name, most in WRONG.items()
    ]
    lines = Counter(row["refused"] for row in rows.values() if "refused" in row)
    cpu = sum(row["cpu_s"] for row in rows.values())
    wrong = sum(bool(row["faults"]) for row in out)
    head = f"{len(out)} of {len(rows)} came out, {wrong} with faults; {cpu:.0f} CPU s"
    refusals = "\n".join(f"{count} refused: {line}" for line, count in lines.items())
    return "\n\n".join((head, table(("number", "masks with more", "most"), counts), refusals))


COLUMNS = (
    "triangles",
    "open_edges",
    "crossings",
    "lowered",
    "off_um",
    "roughness",
    "cpu_s",
    "bare_missing",
    "rim_um",
)
"""Numbers of parts without a mask in their table, each before and now."""


def compared(before: Mapping[str, Mapping[str, Any]], now: Mapping[str, Mapping[str, Any]]) -> str:
    """Parts without a mask, before / now."""
    rows = [
        (
            name,
            *(" / ".join(_shown(rows.get(name, {}).get(key)) for rows in (before, now)) for key in COLUMNS),
        )
        for name in sorted({*before, *now})
    ]
    return table(("part, before / now", *COLUMNS), rows)


def _shown(value: Any) -> str:
    return "-" if value is None else f"{value:.4g}" if isinstance(value, float) else f"{value:,}"


def run(options: Namespace) -> None:
    """Measure what is asked for and missing, and print the tables."""
    if options.parts:
        for name in options.names or NAMES:
            kept(RESULT, options.key, name, partial(without_mask, name), options.again)
        print(compared(load(RESULT).get("before", {}), load(RESULT).get("parts", {})))
    else:
        for seed in options.names or range(options.seeds):
            kept(RESULT, "masks", str(seed), partial(seeded, int(seed)), options.again)
        print(summary(load(RESULT)["masks"]))


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help="parts, or seeds")
    parser.add_argument("--seeds", type=int, default=SEEDS, metavar="N")
    parser.add_argument("--parts", action="store_true", help="the parts without a mask")
    parser.add_argument("--as", dest="key", default="parts", choices=("parts", "before"))
    parser.add_argument("--again", action="store_true", help="also what there are results of")
    run(parser.parse_args())


if __name__ == "__main__":
    main()
