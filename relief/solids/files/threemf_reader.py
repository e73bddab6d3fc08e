"""Reader of 3MF: the body that is built of volumes at their places, less negative volumes, with colours."""

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from relief.ground.arrays import Array, FloatArray, Index
from relief.ground.errors import InputError
from relief.ground.formats import UNITS
from relief.ground.lengths import shown
from relief.solids.body import Body, Part, joined
from relief.solids.files.parsed_mesh import MOST_VERTICES, Parsed, Piece, check_count, check_numbers
from relief.solids.files.slicer_notes import NEGATIVE, Notes
from relief.solids.files.threemf_archive import IDENTITY, Archive, Object, Reference, opened

UNIT_NAMES = {
    "micron": "um",
    "millimeter": "mm",
    "centimeter": "cm",
    "meter": "m",
    "inch": "in",
    "foot": "ft",
}
UNIT_MM = {name: UNITS[unit] for name, unit in UNIT_NAMES.items()}
"""Millimetres in the units of the 3MF core specification, which are those of `UNITS` by other names."""
MOST_BODIES, DEEPEST = 10_000, 16
"""Most volumes that are built, and most components within one another."""
NO_BODY = ("support", "solidsupport", "other")
"""Types of objects that are no part of the body: section 4.1 of the 3MF core specification 1.3."""
UNPRINTED = "supports or items that are not printed"


def read_3mf(content: bytes, path: Path) -> Parsed:
    """Read all bodies that a 3MF file builds, each at its place.

    Items with ``printable="0"``, as slicers write them, supports and the modifiers of slicers are no part of
    the body. Negative volumes are cut out of it.

    Raises:
        InputError: The archive or its models are damaged, build nothing, hold more than is read, or need an
            extension that is not read; a negative volume cannot be cut out.
    """
    with opened(content, path) as archive:
        models, notes = Archive(archive, path), Notes(archive, path)
    if models.main is None:
        raise InputError(f"{path}: builds nothing: put an object on the plate and save again")
    if models.main.unit not in UNIT_MM:
        raise InputError(f"{path}: unit: {shown(models.main.unit)!r} is not one of {', '.join(UNIT_MM)}")
    bodies = _Bodies(models, notes, path)
    for place, item in enumerate(models.main.items):
        bodies.add(item, IDENTITY, (place,), "")
    return bodies.parsed(UNIT_MM[models.main.unit])


class _Built(NamedTuple):
    """A volume at its place: its body, colours of corners (m, 3, 3) or None, and the faces' numbers."""

    piece: Piece
    body: Body
    colours: FloatArray | None
    origin: Index


class _Bodies:
    """Volumes that are built, gathered through components."""

    def __init__(self, archive: Archive, notes: Notes, path: Path) -> None:
        self._archive, self._notes, self._path = archive, notes, path
        self._meshes: dict[tuple[str, str], Body] = {}
        self._built: list[_Built] = []
        self._negative: dict[tuple[int, ...], list[Body]] = {}
        self._left_out: Counter[str] = Counter()
        self._vertices = self._faces = self._visited = self._first = 0

    def add(self, reference: Reference, above: Array, path: tuple[int, ...], parent: str) -> None:
        """Add what an item or a component refers to.

        Args:
            reference: The item or the component.
            above: (4, 3) placement of what it is a component of.
            path: Its place, as of `Piece`.
            parent: Number of the object that it is a component of; empty for an item.
        """
        self._visited += 1
        if len(path) > DEEPEST + 1 or self._visited > MOST_BODIES:
            raise InputError(f"{self._path}: more than {MOST_BODIES} bodies, or {DEEPEST} within one another")
        key = (reference.model, reference.number)
        referred = self._archive.objects.get(key)
        if not reference.printable:
            self._left_out[UNPRINTED] += 1
            return
        if referred is None:
            raise InputError(f"{self._path}: object {shown(key[1])!r} is built and not there")
        if referred.type in NO_BODY:
            self._left_out[UNPRINTED] += 1
            return
        inner = reference.transform
        transform = np.vstack([inner[:3] @ above[:3], inner[3] @ above[:3] + above[3]])
        if referred.faces:
            self._add_mesh(key, referred, transform, path, parent)
        for place, component in enumerate(referred.components):
            self.add(component, transform, (*path, place), key[1])

    def _add_mesh(
        self, key: tuple[str, str], referred: Object, transform: Array, path: tuple[int, ...], parent: str
    ) -> None:
        """Add the volumes of an object's mesh."""
        mesh = self._mesh(key, referred)
        self._faces += len(mesh.faces)
        self._vertices += len(mesh.vertices)
        check_count(self._faces, "faces", self._path)
        check_count(self._vertices, "vertices", self._path, MOST_VERTICES)
        for volume in self._notes.volumes_of(key[1], parent, path[-1], len(mesh.faces)):
            self._visited += 1
            start, end = volume.span or (0, len(mesh.faces))
            body = Part("", mesh.part(slice(start, end)), transform).placed
            kind = referred.kind or volume.kind
            if kind == NEGATIVE:
                # A component is cut out of those beside it, a volume out of the others of its mesh.
                self._negative.setdefault(path if volume.span else path[:-1], []).append(body)
            elif kind:
                self._left_out[kind] += 1
            else:
                name = volume.name or referred.name or self._path.stem
                piece = Piece(name, self._first, path, (start, end), transform)
                colours = self._archive.colours(
                    key[0], referred, (start, end), self._notes.filaments, volume.extruder
                )
                self._built.append(_Built(piece, body, colours, np.arange(end - start)))
                self._first += end - start

    def _mesh(self, key: tuple[str, str], referred: Object) -> Body:
        if key not in self._meshes:
            vertices, faces = (np.array(each).reshape(-1, 3) for each in (referred.vertices, referred.faces))
            check_numbers(faces, len(vertices), "vertices", self._path)
            self._meshes[key] = Body(vertices, faces)
        return self._meshes[key]

    def parsed(self, unit_mm: float) -> Parsed:
        """All bodies as one. Raises InputError if there is none."""
        if not self._built:
            only = " but " + " and ".join(self._left_out).replace(" or ", " and ") if self._left_out else ""
            raise InputError(f"{self._path}: builds nothing{only}: put an object on the plate and save again")
        lines = [f"leaves out {kind}: {count}" for kind, count in self._left_out.items()]
        if count := sum(map(len, self._negative.values())):
            lines.append(f"cuts out {NEGATIVE}: {count}")
        built = [self._cut(each) for each in self._built]
        colours = None
        if any(each.colours is not None for each in built):
            colours = np.concatenate([_or_white(each) for each in built])
        numbers = [np.where(each.origin < 0, -1, each.piece.first + each.origin) for each in built]
        return Parsed(
            *joined([Part("", each.body) for each in built]),
            unit_mm=unit_mm,
            warnings=(*lines, *self._archive.lines),
            colours=colours,
            pieces=tuple(each.piece for each in built),
            origin=np.concatenate(numbers),
        )

    def _cut(self, built: _Built) -> _Built:
        """A volume less the negative volumes of its object."""
        # Boolean operations take time to load, and few files need them.
        from relief.solids.meshes.shells import without

        path = built.piece.path
        where = next((at for at in (path, path[:-1]) if at in self._negative and at), None)
        if where is None:
            return built
        cut = without(_welded(built.body), [_welded(body) for body in self._negative[where]])
        if cut is None:
            fault = "negative volumes cannot be cut out, as it is open, or nothing is left"
            raise InputError(f"{self._path}: {shown(built.piece.name)}: {fault}; repair it in the slicer")
        body, origin = cut
        colours = built.colours
        if colours is not None:
            # Walls of the cut have the colour of the volume's first face.
            colours = np.repeat(colours[origin.clip(0)].mean(axis=1, keepdims=True), 3, axis=1)
        return _Built(replace(built.piece, cut=where), body, colours, origin)


def _or_white(built: _Built) -> FloatArray:
    """Colours (m, 3, 3) of a volume: white for one without."""
    white = np.ones((len(built.body.faces), 3, 3), np.float32)
    return white if built.colours is None else built.colours


def _welded(body: Body) -> Body:
    """The body with one position per vertex."""
    vertices, number = np.unique(body.vertices, axis=0, return_inverse=True)
    return Body(vertices, number.ravel()[body.faces])
