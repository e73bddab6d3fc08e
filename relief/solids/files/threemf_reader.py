"""Reader of 3MF: a zip archive with objects of triangles, components of them, and a list of what is built."""

import io
import zipfile
from array import array
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO
from xml.parsers import expat

import numpy as np

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.formats import UNITS
from relief.ground.lengths import shown
from relief.solids.body import Body, Part, joined
from relief.solids.files.parsed_mesh import (
    LARGEST_FILE,
    MOST_FACES,
    MOST_VERTICES,
    Parsed,
    check_count,
    check_numbers,
)

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
"""Most bodies that are built, and most components within one another."""
MOST_ENTRIES = 10_000
"""Most files in the archive; slicers write a few for each plate."""
MOST_REFERENCES = 10 * MOST_BODIES
"""Most objects, components and items in the models, built or not."""
MOST_ELEMENTS, DEEPEST_ELEMENT = MOST_VERTICES + 2 * MOST_FACES, 64
"""Most XML elements of all models, which take ten seconds, and most within one another."""
CHUNK, LONGEST_TAG = 1 << 18, 1 << 20
"""Bytes of XML that are parsed at a time, and most bytes of a tag, which the parser holds as a whole."""
LONGEST_TRANSFORM = 1000
"""Most characters of a transform: twelve numbers."""
IDENTITY = np.vstack([np.eye(3), np.zeros(3)])
OTHER_MODEL = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06}path"
"""Attribute of an item or component whose object lies in another model of the archive."""
NO_BODY = ("support", "solidsupport", "other")
"""Types of objects that are no part of the body: section 4.1 of the 3MF core specification 1.3."""


@dataclass(frozen=True)
class _Reference:
    """An item of the build or a component of an object: which object, of which model, and where it lies."""

    model: str
    number: str
    transform: Array


@dataclass
class _Object:
    """An object: coordinates of its vertices, corners of its triangles, and what it is composed of."""

    type: str
    vertices: "array[float]" = field(default_factory=lambda: array("d"))
    faces: "array[int]" = field(default_factory=lambda: array("q"))
    components: list[_Reference] = field(default_factory=list)


@dataclass
class _Model:
    """A model of the archive: its unit and what it builds, without the items that are not printed."""

    unit: str = "millimeter"
    items: list[_Reference] = field(default_factory=list)
    unprinted: int = 0


def read_3mf(content: bytes, path: Path) -> Parsed:
    """Read all bodies that a 3MF file builds, each at its place.

    Items with ``printable="0"``, as slicers write them, and supports are no part of the body.

    Raises:
        InputError: The archive or its models are damaged, build nothing, or hold more than is read.
    """
    check_count(content.count(b"PK\1\2"), "files in the archive", path, MOST_ENTRIES)
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        models = [entry for entry in archive.infolist() if entry.filename.lower().endswith(".model")]
        if not models:
            raise InputError(f"{path}: damaged or not a 3MF: holds no 3D/3dmodel.model")
        if sum(entry.file_size for entry in models) > LARGEST_FILE:
            raise InputError(f"{path}: unpacks to more than {LARGEST_FILE} bytes; decimate the mesh")
        reader = _ArchiveReader(path)
        for entry in models:
            if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                raise InputError(f"{path}: {shown(entry.filename)}: is not compressed by deflate")
            with archive.open(entry) as file:
                reader.read(f"/{entry.filename}", file)
    # The model that builds something; some slicers keep objects in models of their own.
    main = next((model for model in reader.models if model.items or model.unprinted), None)
    if main is None:
        raise InputError(f"{path}: builds nothing: put an object on the plate and save again")
    if main.unit not in UNIT_MM:
        raise InputError(f"{path}: unit: {shown(main.unit)!r} is not one of {', '.join(UNIT_MM)}")
    bodies = _Bodies(reader.objects, path, main.unprinted)
    for item in main.items:
        bodies.add(item, IDENTITY, 0)
    left_out = f"leaves out {bodies.left_out} supports or items that are not printed"
    return Parsed(
        *bodies.joined(), unit_mm=UNIT_MM[main.unit], warnings=(left_out,) if bodies.left_out else ()
    )


class _ArchiveReader:
    """Models and objects of an archive, parsed chunk by chunk, so that no tree of their XML is in memory.

    Attributes:
        models: In the order of the archive.
        objects: By the name of their model and their number.
    """

    def __init__(self, path: Path) -> None:
        self.models: list[_Model] = []
        self.objects: dict[tuple[str, str], _Object] = {}
        self._path, self._name = path, ""
        self._open: list[str] = []
        self._object = _Object("")
        self._elements = self._references = self._vertices = self._faces = 0

    def read(self, name: str, file: IO[bytes]) -> None:
        """Read a model of the archive. Raises InputError."""
        self.models.append(_Model())
        self._name, self._open = name, []
        parser = expat.ParserCreate(namespace_separator="}")
        parser.StartElementHandler = self._start
        parser.EndElementHandler = lambda name: self._open.pop()
        parser.StartDoctypeDeclHandler = self._refuse_doctype
        length = 0
        while chunk := file.read(CHUNK):
            parser.Parse(chunk, False)
            length += len(chunk)
            if length - parser.CurrentByteIndex > LONGEST_TAG:
                raise InputError(f"{self._path}: has a tag of more than {LONGEST_TAG} bytes")
        parser.Parse(b"", True)

    def _refuse_doctype(self, *declaration: object) -> None:
        # Entities could name other files or grow without bound; the specification forbids them.
        raise InputError(f"{self._path}: declares a document type (DOCTYPE), which a 3MF file must not have")

    def _start(self, full_name: str, attributes: dict[str, str]) -> None:
        name = full_name.rpartition("}")[2]
        above = self._open[-1] if self._open else ""
        self._open.append(name)
        self._elements += 1
        if self._elements > MOST_ELEMENTS or len(self._open) > DEEPEST_ELEMENT:
            limits = f"{MOST_ELEMENTS} XML elements, or {DEEPEST_ELEMENT} within one another"
            raise InputError(f"{self._path}: has more than {limits}; decimate the mesh")
        if name == "triangle" and above == "triangles" and self._open[-3] == "mesh":
            self._faces += 1
            check_count(self._faces, "faces", self._path)
            self._object.faces.extend((int(attributes["v1"]), int(attributes["v2"]), int(attributes["v3"])))
        elif name == "vertex" and above == "vertices" and self._open[-3] == "mesh":
            self._vertices += 1
            check_count(self._vertices, "vertices", self._path, MOST_VERTICES)
            x, y, z = attributes["x"], attributes["y"], attributes["z"]
            self._object.vertices.extend((float(x), float(y), float(z)))
        elif name == "model" and not above:
            self.models[-1].unit = attributes.get("unit", "millimeter")
        elif name == "object" and above == "resources":
            self._object = _Object(attributes.get("type", "model"))
            key = (self._name, self._key(attributes, "id"))
            if key in self.objects:
                raise InputError(f"{self._path}: has two objects of the number {shown(key[1])!r}")
            self.objects[key] = self._object
        elif name == "component" and above == "components":
            self._object.components.append(self._reference(attributes))
        elif name == "item" and above == "build":
            if attributes.get("printable", "1") in ("0", "false"):
                self.models[-1].unprinted += 1
            else:
                self.models[-1].items.append(self._reference(attributes))

    def _key(self, attributes: dict[str, str], name: str) -> str:
        self._references += 1
        check_count(self._references, "objects, components and items", self._path, MOST_REFERENCES)
        return attributes.get(name, "")

    def _reference(self, attributes: dict[str, str]) -> _Reference:
        transform = _transform(attributes.get("transform"), self._path)
        return _Reference(
            attributes.get(OTHER_MODEL, self._name), self._key(attributes, "objectid"), transform
        )


def _transform(text: str | None, path: Path) -> Array:
    """(4, 3) of a row vector (x, y, z, 1)."""
    if text is None:
        return IDENTITY
    numbers = np.array(text[: LONGEST_TRANSFORM + 1].split(), dtype=np.float64)
    if len(text) > LONGEST_TRANSFORM or numbers.shape != (12,) or not np.isfinite(numbers).all():
        raise InputError(f"{path}: transform: is not twelve numbers")
    return numbers.reshape(4, 3)


class _Bodies:
    """Bodies that are built, gathered through components.

    Attributes:
        left_out: Number of items and components that are no part of the body.
    """

    def __init__(self, objects: dict[tuple[str, str], _Object], path: Path, left_out: int) -> None:
        self._objects, self._path = objects, path
        self._bodies: dict[tuple[str, str], Body] = {}
        self._built: list[Part] = []
        self._vertices = self._faces = self._visited = 0
        self.left_out = left_out

    def add(self, reference: _Reference, above: Array, depth: int) -> None:
        """Add what an item or a component refers to, within what lies at `above`."""
        self._visited += 1
        if depth > DEEPEST or self._visited > MOST_BODIES:
            raise InputError(f"{self._path}: more than {MOST_BODIES} bodies, or {DEEPEST} within one another")
        key = (reference.model, reference.number)
        referred = self._objects.get(key)
        if referred is None:
            raise InputError(f"{self._path}: object {shown(key[1])!r} is built and not there")
        if referred.type in NO_BODY:
            self.left_out += 1
            return
        inner = reference.transform
        transform = np.vstack([inner[:3] @ above[:3], inner[3] @ above[:3] + above[3]])
        if referred.faces:
            body = self._body(key, referred)
            self._faces += len(body.faces)
            self._vertices += len(body.vertices)
            check_count(self._faces, "faces", self._path)
            check_count(self._vertices, "vertices", self._path, MOST_VERTICES)
            self._built.append(Part("", body, transform))
        for component in referred.components:
            self.add(component, transform, depth + 1)

    def _body(self, key: tuple[str, str], referred: _Object) -> Body:
        if key not in self._bodies:
            vertices, faces = (np.array(each).reshape(-1, 3) for each in (referred.vertices, referred.faces))
            check_numbers(faces, len(vertices), "vertices", self._path)
            self._bodies[key] = Body(vertices, faces)
        return self._bodies[key]

    def joined(self) -> Body:
        """All bodies as one."""
        if not self._built:
            only = " but supports and items that are not printed" if self.left_out else ""
            raise InputError(f"{self._path}: builds nothing{only}: put an object on the plate and save again")
        return joined(self._built)
