"""Archives of 3MF: models in XML, with objects of triangles, components, colours, and what is built."""

import io
import re
import zipfile
from array import array
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import IO
from xml.parsers import expat

import numpy as np

from relief.ground.arrays import Array, FloatArray
from relief.ground.errors import InputError
from relief.ground.lengths import shown
from relief.solids.files.parsed_mesh import LARGEST_FILE, MOST_FACES, MOST_VERTICES, check_count
from relief.solids.files.slicer_notes import KINDS, paint_state, parse, rgb_of

MOST_ENTRIES = 10_000
"""Most files in the archive; slicers write a few for each plate."""
MOST_REFERENCES = 100_000
"""Most objects, components and items in the models, built or not."""
MOST_ELEMENTS, DEEPEST_ELEMENT = MOST_VERTICES + 2 * MOST_FACES, 64
"""Most XML elements of all models, which take ten seconds, and most within one another."""
LONGEST_TRANSFORM = 1000
"""Most characters of a transform: twelve numbers."""
IDENTITY = np.vstack([np.eye(3), np.zeros(3)])
OTHER_MODEL = "http://schemas.microsoft.com/3dmanufacturing/production/2015/06}path"
"""Attribute of an item or component whose object lies in another model of the archive."""
EXTENSION = re.compile(r"https?://schemas\.[^/]+/3dmanufacturing/(\w+)/.*")
"""The namespace of an extension of the 3MF consortium, with its name."""
READ = ("core", "material", "production", "trianglesets")
"""Extensions of the consortium that are read, or that do not change the body."""
SLICERS = re.compile(r"https?://[\w.]*(slic3r\.org|bambulab\.com|ultimaker\.com|prusa3d\.com)/.*")
"""Namespaces of slicers, whose notes are read."""
UNREAD_COLOURS = ("texture2dgroup", "compositematerials", "multiproperties")
"""Properties of the materials extension whose colours are not read."""
PAINTS = re.compile(r"(?:.*})?(?:mmu_segmentation|paint_color)")
"""Attributes by which slicers paint a triangle with a filament."""


@dataclass(frozen=True)
class Reference:
    """An item of the build or a component of an object: which object, of which model, and where it lies."""

    model: str
    number: str
    transform: Array
    printable: bool = True


@dataclass
class Object:
    """An object: coordinates of its vertices, corners of its triangles, and what it is composed of.

    Attributes:
        kind: A value of `KINDS` by settings of Cura; empty for a part of the body.
        colour: Number of a group of colours, and of one of these; 0 and -1 without.
        marks: Rows of six for the triangles with colours of their own: the triangle, a group and three of its
            colours, and the state of its paint.
    """

    type: str
    name: str = ""
    kind: str = ""
    colour: tuple[int, int] = (0, -1)
    vertices: "array[float]" = field(default_factory=lambda: array("d"))
    faces: "array[int]" = field(default_factory=lambda: array("q"))
    marks: "array[int]" = field(default_factory=lambda: array("q"))
    components: list[Reference] = field(default_factory=list)


@dataclass
class Model:
    """A model of the archive: its unit and what it builds."""

    unit: str = "millimeter"
    items: list[Reference] = field(default_factory=list)


@contextmanager
def opened(content: bytes, path: Path) -> Iterator[zipfile.ZipFile]:
    """The archive of a 3MF. Raises InputError if it has too many files."""
    check_count(content.count(b"PK\1\2"), "files in the archive", path, MOST_ENTRIES)
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        yield archive


class Archive:
    """Models and objects of an archive, parsed chunk by chunk, so that no tree of their XML is in memory.

    Attributes:
        main: The model that builds something; some slicers keep objects in models of their own.
        objects: By the name of their model and their number.
        lines: About content that is left out.
    """

    def __init__(self, archive: zipfile.ZipFile, path: Path) -> None:
        """Read all models. Raises InputError."""
        self.objects: dict[tuple[str, str], Object] = {}
        self.lines: list[str] = []
        self._path, self._name = path, ""
        self._open: list[str] = []
        self._object, self._group = Object(""), ("", 0)
        self._elements = self._references = self._vertices = self._faces = self._divided = 0
        self._unread: set[str] = set()
        self._spans: dict[tuple[str, int], tuple[int, int]] = {}
        self._colours = array("B")
        models = []
        for entry in model_entries(archive, path):
            with archive.open(entry) as file:
                models.append(self._read(f"/{entry.filename}", file))
        self.main = next((model for model in models if model.items), None)
        self.lines += [f"leaves out the extension {shown(name)} of the file" for name in sorted(self._unread)]
        if self._divided:
            self.lines.append(f"takes no colours from triangles that are painted in parts: {self._divided}")

    def colours(
        self, model: str, of: Object, span: tuple[int, int], filaments: FloatArray, extruder: int
    ) -> FloatArray | None:
        """(m, 3, 3) colours of the corners of some triangles of an object; None: they have none.

        Args:
            model: Of the object.
            of: The object.
            span: Number of the first triangle, and the number after the last.
            filaments: (k, 3) colours of the filaments of all extruders.
            extruder: That prints the triangles without paint, from 1; 0 is the first.
        """
        # The first row is that of all triangles without a mark.
        rows = np.append([-1, *of.colour[:1], *3 * of.colour[1:], 0], np.array(of.marks)).reshape(-1, 6)
        rows = rows[np.append(True, (rows[1:, 0] >= span[0]) & (rows[1:, 0] < span[1]))]
        groups, group = np.unique(rows[:, 1], return_inverse=True)
        first, count = np.array([self._spans.get((model, int(number)), (0, 0)) for number in groups]).T
        known = ((rows[:, 2:5] >= 0) & (rows[:, 2:5] < count[group.ravel(), None])).all(axis=1)
        if not known.any() and not len(filaments):
            return None
        table = np.concatenate([np.ones((1, 3)), filaments, np.array(self._colours).reshape(-1, 3) / 255])
        state = np.where(rows[:, 5] > 0, rows[:, 5], max(extruder, 1)).clip(max=len(filaments))
        own = first[group.ravel(), None] + rows[:, 2:5] + 1 + len(filaments)
        at = np.where((known & (rows[:, 5] <= 0))[:, None], own, state[:, None])
        colours = np.repeat(table[at[:1]].astype(np.float32), span[1] - span[0], axis=0)
        colours[rows[1:, 0] - span[0]] = table[at[1:]]
        return colours

    def _read(self, name: str, file: IO[bytes]) -> Model:
        """Read a model of the archive. Raises InputError."""
        self._model, self._name, self._open = Model(), name, []
        self._prefixes: dict[str, str] = {}
        self._parser = parser = expat.ParserCreate(namespace_separator="}")
        parser.StartNamespaceDeclHandler = lambda prefix, uri: self._prefixes.update({prefix or "": uri})
        parser.StartElementHandler = self._start
        parser.EndElementHandler = self._end
        parse(file, parser, self._path)
        return self._model

    def _end(self, name: str) -> None:
        self._open.pop()
        self._parser.CharacterDataHandler = None

    def _start(self, full_name: str, attributes: dict[str, str]) -> None:
        uri, _, name = full_name.rpartition("}")
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
            if len(attributes) > 3:
                self._mark(attributes)
        elif name == "vertex" and above == "vertices" and self._open[-3] == "mesh":
            self._vertices += 1
            check_count(self._vertices, "vertices", self._path, MOST_VERTICES)
            x, y, z = attributes["x"], attributes["y"], attributes["z"]
            self._object.vertices.extend((float(x), float(y), float(z)))
        elif name == "object" and above == "resources":
            self._start_object(attributes)
        elif name == "component" and above == "components":
            self._object.components.append(self._reference(attributes))
        elif name == "item" and above == "build":
            self._model.items.append(self._reference(attributes))
        elif not above:
            self._model.unit = attributes.get("unit", "millimeter")
            self._check_required(attributes.get("requiredextensions", ""))
        else:
            self._start_note(uri, name, attributes)

    def _check_required(self, prefixes: str) -> None:
        """Refuse a file whose reader must know an extension that is not read."""
        self._parser.StartNamespaceDeclHandler = None
        for prefix in prefixes.split():
            uri = self._prefixes.get(prefix, prefix)
            if (name := _unread_extension(uri)) or not (EXTENSION.fullmatch(uri) or SLICERS.fullmatch(uri)):
                fault = f"requires the extension {shown(name or uri)}, which is not read"
                raise InputError(f"{self._path}: {fault}; save it as plain meshes")

    def _start_object(self, attributes: dict[str, str]) -> None:
        colour = int(attributes.get("pid", 0)), int(attributes.get("pindex", -1))
        self._object = Object(attributes.get("type", "model"), attributes.get("name", ""), colour=colour)
        key = (self._name, self._key(attributes, "id"))
        if key in self.objects:
            raise InputError(f"{self._path}: has two objects of the number {shown(key[1])!r}")
        self.objects[key] = self._object

    def _start_note(self, uri: str, name: str, attributes: dict[str, str]) -> None:
        """Take colours, and settings of objects; note what is not read."""
        if name in ("colorgroup", "basematerials"):
            self._group = (self._name, int(attributes["id"]))
            self._spans[self._group] = len(self._colours) // 3, 0
        elif name in ("color", "base") and self._open[-2] in ("colorgroup", "basematerials"):
            self._colours.extend(rgb_of(attributes.get("color", attributes.get("displaycolor", ""))))
            first = self._spans[self._group][0]
            self._spans[self._group] = first, len(self._colours) // 3 - first
        elif name in ("metadata", "setting") and "object" in self._open:
            # Cura writes <metadata name="cura:infill_mesh">True</metadata>, and once <setting key=...>.
            key = attributes.get("name", attributes.get("key", "")).rpartition(":")[2]
            if key.endswith("_mesh") and key in KINDS:
                self._setting = (KINDS[key], "")
                self._parser.CharacterDataHandler = self._take_setting
        elif (extension := _unread_extension(uri)) and len(self._unread) < 9:
            self._unread.add(extension)
        elif name in UNREAD_COLOURS:
            self._unread.add(f"material ({name})")

    def _take_setting(self, text: str) -> None:
        kind, before = self._setting
        self._setting = kind, (before + text)[:9]
        if self._setting[1].strip().lower() == "true":
            self._object.kind = kind

    def _mark(self, attributes: dict[str, str]) -> None:
        """Note the colours of the last triangle."""
        first = int(attributes.get("p1", self._object.colour[1]))
        own = int(attributes.get("pid", self._object.colour[0])), first
        state = next((paint_state(text) for name, text in attributes.items() if PAINTS.fullmatch(name)), 0)
        self._divided += state < 0
        others = (int(attributes.get(name, first)) for name in ("p2", "p3"))
        self._object.marks.extend((len(self._object.faces) // 3 - 1, *own, *others, state))

    def _key(self, attributes: dict[str, str], name: str) -> str:
        self._references += 1
        check_count(self._references, "objects, components and items", self._path, MOST_REFERENCES)
        return attributes.get(name, "")

    def _reference(self, attributes: dict[str, str]) -> Reference:
        transform = _transform(attributes.get("transform"), self._path)
        model = attributes.get(OTHER_MODEL, self._name)
        printed = attributes.get("printable", "1") not in ("0", "false")
        return Reference(model, self._key(attributes, "objectid"), transform, printed)


def model_entries(archive: zipfile.ZipFile, path: Path) -> list[zipfile.ZipInfo]:
    """Entries of the models of an archive. Raises InputError if there are none, or they hold too much."""
    models = [entry for entry in archive.infolist() if entry.filename.lower().endswith(".model")]
    if not models:
        raise InputError(f"{path}: damaged or not a 3MF: holds no 3D/3dmodel.model")
    if sum(entry.file_size for entry in models) > LARGEST_FILE:
        raise InputError(f"{path}: unpacks to more than {LARGEST_FILE} bytes; decimate the mesh")
    for entry in models:
        if entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
            raise InputError(f"{path}: {shown(entry.filename)}: is not compressed by deflate")
    return models


@lru_cache(maxsize=64)
def _unread_extension(uri: str) -> str:
    """Name of an extension of the consortium that is not read; empty for others."""
    match = EXTENSION.fullmatch(uri)
    return match[1] if match and match[1] not in READ else ""


def _transform(text: str | None, path: Path) -> Array:
    """(4, 3) of a row vector (x, y, z, 1)."""
    if text is None:
        return IDENTITY
    numbers = np.array(text[: LONGEST_TRANSFORM + 1].split(), dtype=np.float64)
    if len(text) > LONGEST_TRANSFORM or numbers.shape != (12,) or not np.isfinite(numbers).all():
        raise InputError(f"{path}: transform: is not twelve numbers")
    return numbers.reshape(4, 3)
