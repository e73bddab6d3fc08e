"""Reader of 3MF: a zip archive with objects of triangles, components of them, and a list of what is built."""

import io
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from lxml import etree

from relief.body import Body, Part, joined
from relief.common.arrays import Array, Index
from relief.common.errors import InputError
from relief.meshes.parsed import LARGEST_FILE, Parsed
from relief.meshes.text_formats import check_count

UNIT_MM = {
    "micron": 1e-3,
    "millimeter": 1.0,
    "centimeter": 10.0,
    "meter": 1000.0,
    "inch": 25.4,
    "foot": 304.8,
}
"""Millimetres in the units that the 3MF core specification names."""
MOST_BODIES, DEEPEST = 10_000, 16
"""Most bodies that are built, and most components within one another."""
IDENTITY = np.vstack([np.eye(3), np.zeros(3)])
OTHER_MODEL = "{http://schemas.microsoft.com/3dmanufacturing/production/2015/06}path"
"""Attribute of an item or component whose object lies in another model of the archive."""
Solid = tuple[Array, Index]


def read_3mf(content: bytes, path: Path) -> Parsed:
    """Read all bodies that a 3MF file builds, each at its place. Raises InputError."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        models = [entry for entry in archive.infolist() if entry.filename.lower().endswith(".model")]
        if not models:
            raise InputError(f"{path}: damaged or not a 3MF: holds no 3D/3dmodel.model")
        if sum(entry.file_size for entry in models) > 2 * LARGEST_FILE:
            raise InputError(f"{path}: unpacks to more than {2 * LARGEST_FILE} bytes; decimate the mesh")
        roots = {f"/{entry.filename}": _root(archive.read(entry), path) for entry in models}
    # The model that builds something; some slicers keep objects in models of their own.
    main = next((name for name, root in roots.items() if root.find("{*}build/{*}item") is not None), None)
    if main is None:
        raise InputError(f"{path}: builds nothing: put an object on the plate and save again")
    unit = roots[main].get("unit", "millimeter")
    if unit not in UNIT_MM:
        raise InputError(f"{path}: unit: {unit!r} is not one of {', '.join(UNIT_MM)}")
    objects = {
        (name, element.get("id")): element
        for name, root in roots.items()
        for element in root.iterfind("{*}resources/{*}object")
    }
    bodies = _Bodies(objects, path)
    for item in roots[main].iterfind("{*}build/{*}item"):
        bodies.add(main, item, _transform(item.get("transform"), path), 0)
    return Parsed(*bodies.joined(), unit_mm=UNIT_MM[unit])


def _root(content: bytes, path: Path) -> Any:
    """The root of a model, without entities, which could name other files or grow without bound."""
    if b"<!DOCTYPE" in content or b"<!ENTITY" in content:
        raise InputError(f"{path}: declares entities, which a 3MF file does not need")
    parser = etree.XMLParser(resolve_entities=False, no_network=True, huge_tree=True, load_dtd=False)
    return etree.fromstring(content, parser)


def _transform(text: str | None, path: Path) -> Array:
    """(4, 3) of a row vector (x, y, z, 1)."""
    if text is None:
        return IDENTITY
    numbers = np.array(text.split(), dtype=np.float64)
    if numbers.shape != (12,) or not np.isfinite(numbers).all():
        raise InputError(f"{path}: transform: is not twelve numbers")
    return numbers.reshape(4, 3)


class _Bodies:
    """Bodies that are built, gathered through components.

    Objects are found by the name of their model and their number.
    """

    def __init__(self, objects: dict[tuple[str, str], Any], path: Path) -> None:
        self._objects, self._path = objects, path
        self._read: dict[tuple[str, str], Solid] = {}
        self._built: list[Part] = []
        self._faces = self._visited = 0

    def add(self, model: str, reference: Any, transform: Array, depth: int) -> None:
        """Add what an item or a component of a model refers to."""
        self._visited += 1
        if depth > DEEPEST or self._visited > MOST_BODIES:
            raise InputError(f"{self._path}: more than {MOST_BODIES} bodies, or {DEEPEST} within one another")
        key = (reference.get(OTHER_MODEL, model), reference.get("objectid", ""))
        element = self._objects.get(key)
        if element is None:
            raise InputError(f"{self._path}: object {key[1]!r} is built and not there")
        if element.find("{*}mesh") is not None:
            vertices, faces = self._solid(key, element.find("{*}mesh"))
            self._faces += len(faces)
            check_count(self._faces, "faces", self._path)
            self._built.append(Part("", Body(vertices, faces), transform))
        for component in element.iterfind("{*}components/{*}component"):
            inner = _transform(component.get("transform"), self._path)
            joined = np.vstack([inner[:3] @ transform[:3], inner[3] @ transform[:3] + transform[3]])
            self.add(key[0], component, joined, depth + 1)

    def _solid(self, key: tuple[str, str], mesh: Any) -> Solid:
        if key not in self._read:
            corners = mesh.iterfind("{*}triangles/{*}triangle")
            triangles = [(each.get("v1"), each.get("v2"), each.get("v3")) for each in corners]
            points = mesh.iterfind("{*}vertices/{*}vertex")
            vertices = [(each.get("x"), each.get("y"), each.get("z")) for each in points]
            faces = np.array(triangles, dtype=np.int64).reshape(-1, 3)
            if faces.size and not 0 <= faces.min() <= faces.max() < len(vertices):
                raise InputError(f"{self._path}: faces name vertices that the file does not have")
            self._read[key] = (np.array(vertices, dtype=np.float64).reshape(-1, 3), faces)
        return self._read[key]

    def joined(self) -> Body:
        """All bodies as one."""
        if not self._built:
            raise InputError(f"{self._path}: builds nothing: put an object on the plate and save again")
        return joined(self._built)
