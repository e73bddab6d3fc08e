"""Reader of PLY: elements of properties, each a number or a list of numbers, binary or as text."""

import re
import struct
from array import array
from dataclasses import dataclass, field, replace
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from relief.ground.arrays import Array, Index
from relief.ground.errors import InputError
from relief.ground.lengths import shown
from relief.solids.files.parsed_mesh import MOST_FACES, MOST_VERTICES, Parsed, check_count, triangulated

HEADER = re.compile(rb"ply\s.*?\bend_header[ \t]*(?:\r\n|\n|\r)", re.DOTALL)
LONGEST_HEADER = 1 << 16
"""Most bytes of the header."""
ORDERS = {"ascii": "=", "binary_little_endian": "<", "binary_big_endian": ">"}
"""Order of the bytes by format; the numbers of a text are read into double precision first."""
TYPES = {
    **{"char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I"},
    **{"int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I"},
    **{"float": "f", "double": "d", "float32": "f", "float64": "d"},
}
"""Letters of numpy and `struct` by the names of types."""
MOST_NUMBERS = 8 * MOST_VERTICES
"""Most numbers of a text: position, normal and colour of each vertex, and the corners of faces."""
MOST_LISTED, LONGEST_LIST = 3 * MOST_VERTICES, 1 << 20
"""Most numbers of all lists of an element, three for each corner of a face, and of one list."""
CORNERS = ("vertex_indices", "vertex_index")
COORDINATES = (("texture_u", "texture_v"), ("u", "v"), ("s", "t"))
"""Names that programs give to the corners of faces, and to the texture coordinates of vertices."""
COLOURS = ("red", "green", "blue")
"""Names of the colours of vertices and faces; whole numbers count to 255, others to 1."""
READ = frozenset(("x", "y", "z", "texcoord", *COLOURS, *CORNERS, *chain.from_iterable(COORDINATES)))
"""Names of the properties that are read; the others are passed over."""


class Property(NamedTuple):
    """A property: its name, its type, and the type of the length of a list, "" for a single number."""

    name: str
    type: str
    length: str


@dataclass
class Element:
    """An element of the header: how many there are, their properties, and the types that are stated."""

    name: str
    count: int
    properties: list[Property] = field(default_factory=list)
    stated: dict[str, str] = field(default_factory=dict)


class Lists(NamedTuple):
    """Lengths (m,) of lists, and their numbers, one list after the other."""

    lengths: Index
    numbers: Array


def read_ply(content: bytes, path: Path) -> Parsed:
    """Read a PLY of faces, binary or ASCII; polygons become triangles. Raises InputError."""
    header = HEADER.match(content[:LONGEST_HEADER])
    if header is None:
        raise InputError(f"{path}: damaged or not a PLY: has no header")
    order, elements = _elements(header.group().decode("latin-1"), path)
    data = memoryview(content)[header.end() :]
    if order == ORDERS["ascii"]:
        data = _as_numbers(data.tobytes(), path)
        elements = [_as_doubles(element) for element in elements]
    values: dict[str, dict[str, Any]] = {}
    at = 0
    for element in elements:
        values[element.name], at = _rows(element, data, at, order, path)
    vertices, faces = values.get("vertex", {}), values.get("face", {})
    corners = next((faces[name] for name in CORNERS if isinstance(faces.get(name), Lists)), None)
    if not isinstance(corners, Lists) or not vertices:
        raise InputError(f"{path}: has no triangles; a mesh of triangles is needed, no points or curves")
    numbers = corners.numbers.astype(np.int64)
    if (numbers != corners.numbers).any():
        raise InputError(f"{path}: damaged: numbers of vertices are no whole numbers")
    check_count(int(np.maximum(corners.lengths - 2, 0).sum()), "faces", path)
    positions = np.stack([vertices[name] for name in "xyz"], axis=1)
    places = triangulated(positions, numbers, corners.lengths, path)
    triangles = numbers[places]
    uv: Array | None = None
    at_corners = faces.get("texcoord")
    pair = next((names for names in COORDINATES if {*names} <= vertices.keys()), None)
    if isinstance(at_corners, Lists) and np.array_equal(at_corners.lengths, 2 * corners.lengths):
        uv = at_corners.numbers.reshape(-1, 2)[places]
    elif pair is not None:
        uv = np.stack([vertices[name] for name in pair], axis=1)[triangles]
    colours: Array | None = None
    if (of_vertices := _colours(elements, "vertex", vertices)) is not None:
        colours = of_vertices[triangles]
    elif (of_faces := _colours(elements, "face", faces)) is not None:
        number = np.repeat(np.arange(len(corners.lengths)), np.maximum(corners.lengths - 2, 0))
        colours = np.repeat(of_faces[number][:, None], 3, axis=1)
    return Parsed(positions, triangles, uv, colours=colours)


def _colours(elements: list[Element], name: str, values: dict[str, Any]) -> Array | None:
    """Colours (n, 3) in sRGB, from 0 to 1, of vertices or faces; None if they have none."""
    if not {*COLOURS} <= values.keys() or any(isinstance(values[each], Lists) for each in COLOURS):
        return None
    # Numbers of a text are read in double precision, whatever the header states.
    types = next(element.stated for element in elements if element.name == name)
    whole = types.get("red", "f") not in "fd"
    return np.stack([values[each] for each in COLOURS], axis=1) / (255.0 if whole else 1.0)


def _elements(header: str, path: Path) -> tuple[str, list[Element]]:
    """Order of the bytes, and the elements of a header. Raises InputError."""
    order, elements = None, list[Element]()
    for line in header.splitlines():
        match line.split():
            case ["format", name, *_]:
                order = ORDERS.get(name)
            case ["element", name, count]:
                elements.append(Element(name, int(count)))
            case ["property", "list", length, type, name]:
                elements[-1].properties.append(Property(name, TYPES[type], TYPES[length]))
            case ["property", type, name]:
                elements[-1].properties.append(Property(name, TYPES[type], ""))
                elements[-1].stated[name] = TYPES[type]
    if order is None:
        raise InputError(f"{path}: damaged or not a PLY: format: is not one of {', '.join(ORDERS)}")
    for element in elements:
        name, most = shown(element.name), MOST_VERTICES if element.name == "vertex" else MOST_FACES
        check_count(element.count, f"elements {name}", path, most)
        if element.count < 0 or len({each.name for each in element.properties}) < len(element.properties):
            raise InputError(f"{path}: damaged: element {name}: has a negative count or a property twice")
    if len({element.name for element in elements}) < len(elements):
        raise InputError(f"{path}: damaged: names an element twice")
    return order, elements


def _as_numbers(text: bytes, path: Path) -> memoryview:
    """The bytes of all numbers of a text in double precision. Raises InputError."""
    check_count(sum(text.count(space) for space in (b" ", b"\t", b"\n")), "numbers", path, MOST_NUMBERS)
    numbers: Any = np.fromstring(text, sep=" ")
    return memoryview(numbers).cast("B")


def _as_doubles(element: Element) -> Element:
    doubles = [Property(name, "d", "d" if length else "") for name, _, length in element.properties]
    return Element(element.name, element.count, doubles, element.stated)


def _rows(element: Element, data: memoryview, at: int, order: str, path: Path) -> tuple[dict[str, Any], int]:
    """Values of an element by property, and where the next element begins. Raises InputError."""
    if not (element.count and element.properties):
        return {}, at
    # In most files all lists of a property are as long as the first, and numpy reads all rows at once.
    lists, _ = _walked(replace(element, count=1), data, at, order, path)
    fields: list[Any] = []
    for name, type, length in element.properties:
        if length:
            fields.append((f"length of {name}", order + length))
        fields.append((name, order + type, lists[name].numbers.shape if length else ()))
    kind = np.dtype(fields)
    end = at + element.count * kind.itemsize
    rows = np.frombuffer(data, kind, element.count if end <= len(data) else 1, at)
    if len(rows) < element.count or any(np.ptp(rows[f"length of {name}"]) for name in lists):
        if not lists:
            raise InputError(f"{path}: damaged: ends within the elements {shown(element.name)}")
        return _walked(element, data, at, order, path)
    values: dict[str, Any] = {}
    for name in READ & {each.name for each in element.properties}:
        numbers = rows[name].ravel()
        check_count(len(numbers), f"numbers of {shown(name)}", path, MOST_LISTED)
        lengths = np.full(element.count, len(numbers) // element.count)
        values[name] = Lists(lengths, numbers) if name in lists else numbers.astype(np.float64)
    return values, end


def _walked(
    element: Element, data: memoryview, at: int, order: str, path: Path
) -> tuple[dict[str, Any], int]:
    """Values of the lists of an element, row by row, as lists may differ in length. Raises InputError."""
    check_count(element.count * len(element.properties), "lists", path, MOST_VERTICES)
    lists = {each.name: (array("q"), array("d")) for each in element.properties if each.length}
    sizes = {letter: struct.calcsize(order + letter) for letter in TYPES.values()}
    total = 0
    for _ in range(element.count):
        for name, type, length_type in element.properties:
            if length_type:
                (length,) = map(int, struct.unpack_from(order + length_type, data, at))
                lengths, numbers = lists[name]
                total += length
                if not 0 <= length <= LONGEST_LIST or total > MOST_LISTED:
                    most = f"{LONGEST_LIST}, and {MOST_LISTED} in all lists"
                    raise InputError(f"{path}: has a list of {length} numbers; at most {most}, are read")
                at += sizes[length_type]
                lengths.append(length)
                numbers.extend(struct.unpack_from(f"{order}{length}{type}", data, at))
                at += length * sizes[type]
            else:
                at += sizes[type]
    return {
        name: Lists(np.array(lengths), np.array(numbers)) for name, (lengths, numbers) in lists.items()
    }, at
