"""Meshes of a project with texture.

The faces of a textured body take the place of those of the file, with the attributes of the triangles in
which they lie.
"""

from array import array
from collections.abc import Sequence
from typing import NamedTuple
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

import numpy as np

from relief.ground.arrays import Array, Flags, Index
from relief.solids.body import Body, Part
from relief.solids.export.threemf_writer import TRIANGLE, VERTEX
from relief.solids.export.written_numbers import rows_as_text
from relief.solids.files.parsed_mesh import Piece
from relief.solids.files.slicer_notes import NEGATIVE, PAINT, Notes
from relief.solids.meshes.neighbourhood import connected, edge_pairs

PAINTS = (
    *("mmu_segmentation", "custom_supports", "custom_seam", "fuzzy_skin"),
    *("paint_color", "paint_supports", "paint_seam", "paint_fuzzy_skin"),
)
"""Attributes in which slicers note how a triangle is divided and painted."""


class Textured(NamedTuple):
    """A body of a file with texture.

    Attributes:
        pieces: Of the file.
        unit_mm: mm of the unit in which it was read.
        body: In mm.
        source: (m,) face of the file in which each face of the body lies, -1 for none.
        fine: Number of the faces with texture, which come first.
    """

    pieces: Sequence[Piece]
    unit_mm: float
    body: Body
    source: Index
    fine: int

    def owners(self) -> tuple[Index, Flags]:
        """(m,) the piece of each face, that of most faces of its shell, and which pieces have changed."""
        first = np.array([piece.first for piece in self.pieces])
        own = np.where(self.source < 0, -1, np.searchsorted(first, self.source, "right") - 1)
        shell = connected(edge_pairs(self.body.faces) // 3, len(own))
        known = own >= 0
        pairs, votes = np.unique(np.stack([shell[known], own[known]]), axis=1, return_counts=True)
        winner = np.zeros(len(own), np.int64)
        order = np.argsort(votes, kind="stable")
        winner[pairs[0, order]] = pairs[1, order]
        changed = np.zeros(len(first), bool)
        changed[winner[shell[: self.fine]]] = True
        # Pieces united with one of them change too, those without a face left, and those that the same
        # negative volumes cut.
        changed[own[known & np.isin(shell, shell[: self.fine])]] = True
        left = np.bincount(own[known], minlength=len(first)) > 0
        changed |= [piece.span[1] > piece.span[0] for piece in self.pieces] & ~left
        cuts = {piece.cut for piece, one in zip(self.pieces, changed, strict=True) if one} - {None}
        changed |= [piece.cut in cuts for piece in self.pieces]
        return winner[shell], changed

    def parts(self) -> list[Part]:
        """The pieces, each with its name, where they lie."""
        owner, _ = self.owners()
        rows = _rows_of_each(owner, len(self.pieces))
        pieces = zip(self.pieces, rows, strict=True)
        return [Part(piece.name, self.body.part(own)) for piece, own in pieces if len(own)]


class _Mesh(NamedTuple):
    """The mesh of an object as a file has it, and the other attributes of its triangles by their numbers."""

    vertices: Array
    faces: Index
    extras: list[dict[str, str]]
    extra: Index


class TexturedMeshes:
    """Texts of the meshes of a project.

    Attributes:
        changed: Places of items and components that hold texture.
        cuts: Places whose negative volumes are cut out of meshes with texture.
        lost: Number of triangles whose paint is left out, as it divides them and they carry texture.
    """

    def __init__(self, notes: Notes, textured: Textured) -> None:
        self._notes, self._textured, self.lost = notes, textured, 0
        owner, changed = textured.owners()
        self._rows = _rows_of_each(owner, len(textured.pieces))
        pieces = [piece for piece, one in zip(textured.pieces, changed, strict=True) if one]
        self.changed = {piece.path[:k] for piece in pieces for k in range(1, len(piece.path) + 1)}
        self.cuts = {piece.cut for piece in pieces}
        self._number_of = {(piece.path, piece.span): k for k, piece in enumerate(textured.pieces)}

    def text(
        self, mesh: bytes, path: tuple[int, ...], number: str, parent: str
    ) -> tuple[bytes, list[tuple[int, int] | None], int]:
        """A mesh with texture, the spans of its volumes, None for one that is gone, and triangles added.

        Args:
            mesh: Its text in the file.
            path: Its place, as of `Piece`.
            number: Of its object.
            parent: Number of the object that this is a component of; empty for an item.
        """
        was, textured = _mesh(mesh), self._textured
        prefix = mesh[1 : mesh.index(b"mesh")].decode()
        vertices: list[bytes] = []
        triangles: list[bytes] = []
        spans: list[tuple[int, int] | None] = []
        first = count = 0
        for volume in self._notes.volumes_of(number, parent, path[-1], len(was.faces)):
            start, end = volume.span or (0, len(was.faces))
            own = self._number_of.get((path, (start, end)))
            rows = np.zeros(0, np.int64) if own is None else self._rows[own]
            if (volume.kind == NEGATIVE and path in self.cuts) or (own is not None and not len(rows)):
                spans.append(None)
                continue
            if own is None:
                body = Body(was.vertices, was.faces).part(slice(start, end))
                extra, extras = was.extra[start:end], was.extras
            else:
                body = _local(textured.body.part(rows), textured, own)
                extra, extras = self._inherited(rows, was, textured.pieces[own])
            faces = body.faces
            vertices += rows_as_text(VERTEX.replace("<", f"<{prefix}"), body.vertices)
            order = np.argsort(extra, kind="stable")
            for run in np.split(order, np.flatnonzero(np.diff(extra[order])) + 1):
                more = "".join(f" {name}={quoteattr(value)}" for name, value in extras[extra[run[0]]].items())
                template = TRIANGLE.replace("<", f"<{prefix}").replace("/>", more.replace("%", "%%") + "/>")
                triangles += rows_as_text(template, faces[run] + first)
            spans.append((count, count + len(faces)))
            first, count = first + len(body.vertices), count + len(faces)
        tags = [f"<{prefix}mesh><{prefix}vertices>", f"</{prefix}vertices><{prefix}triangles>"]
        tags.append(f"</{prefix}triangles></{prefix}mesh>")
        opening, middle, closing = (tag.encode() for tag in tags)
        new = b"".join([opening, *vertices, middle, *triangles, closing])
        return new, spans, count - len(was.faces)

    def _inherited(self, rows: Index, was: _Mesh, piece: Piece) -> tuple[Index, list[dict[str, str]]]:
        """Attributes of faces, (k,) numbers, of the file's triangles in which they lie, as numbers of a list.

        Paint that divides a triangle stays on whole triangles of the file alone.
        """
        source = self._textured.source
        face = source[rows] - piece.first + piece.span[0]
        # Faces that close a hole, and those of pieces united with this one, lie in none of its triangles.
        face = np.where((face < piece.span[0]) | (face >= piece.span[1]), -1, face)
        again = np.bincount(face + 1)[face + 1]
        whole = (rows >= self._textured.fine) & (again == 1) & (piece.cut is None) & (face >= 0)
        extra = np.where(face < 0, 0, was.extra[face])
        undivided = [
            {name: value for name, value in each.items() if not _divides(name, value)} for each in was.extras
        ]
        lost = np.array([one != other for one, other in zip(was.extras, undivided, strict=True)])
        self.lost += len(np.unique(face[~whole & lost[extra]]))
        return np.where(whole, extra, extra + len(was.extras)), [*was.extras, *undivided]


def _rows_of_each(owner: Index, count: int) -> list[Index]:
    """Numbers, rising, of the faces of each of some owners, by the owner (m,) of each face."""
    order = np.argsort(owner, kind="stable")
    return np.split(order, np.searchsorted(owner[order], np.arange(1, count)))


def _local(body: Body, textured: Textured, number: int) -> Body:
    """A body of a piece in the unit and the coordinates of the object's mesh."""
    placement = textured.pieces[number].placement
    vertices = (body.vertices / textured.unit_mm - placement[3]) @ np.linalg.inv(placement[:3])
    return Body(vertices, body.faces[:, :: int(np.sign(np.linalg.det(placement[:3])))])


def _divides(name: str, value: str) -> bool:
    return name.rpartition(":")[2] in PAINTS and not PAINT.fullmatch(value)


def _mesh(text: bytes) -> _Mesh:
    """The mesh of an element's text."""
    vertices, faces, extra = array("d"), array("q"), array("q")
    numbers: dict[tuple[tuple[str, str], ...], int] = {(): 0}

    def start(full_name: str, attributes: dict[str, str]) -> None:
        name = full_name.rpartition(":")[2]
        if name == "vertex":
            vertices.extend(float(attributes[axis]) for axis in "xyz")
        elif name == "triangle":
            faces.extend(int(attributes.pop(corner)) for corner in ("v1", "v2", "v3"))
            extra.append(numbers.setdefault(tuple(attributes.items()), len(numbers)))

    parser = expat.ParserCreate()
    parser.StartElementHandler = start
    parser.Parse(text, True)
    tables = np.array(vertices).reshape(-1, 3), np.array(faces).reshape(-1, 3)
    return _Mesh(*tables, [dict(each) for each in numbers], np.array(extra))
