"""Readers of STL and OBJ."""

import codecs
import re
from array import array
from contextlib import suppress
from itertools import chain, islice
from pathlib import Path

import numpy as np

from relief.ground.errors import InputError
from relief.solids.body import TRIANGLE
from relief.solids.files.parsed_mesh import (
    MOST_FACES,
    MOST_VERTICES,
    Parsed,
    check_count,
    check_numbers,
    triangulated,
)

STL_HEAD = 84
"""Bytes before the triangles of a binary STL file: a comment, and the number of triangles."""
STREAMED = (0, 0xFFFFFFFF)
"""Numbers of triangles that programs write into a pipe, before they know how many there will be."""
STL_VERTEX = re.compile(
    rb"(?im)^(?:end)?solid\b.{0,1000}?(?=\bfacet\s+normal\b|$)|\bvertex\s+(\S*)\s*(\S*)\s*(\S*)"
)
"""A vertex in text, or the name of a solid, which may hold any word and ends at the first facet in its line.
A number that is missing is matched as no text, which is refused."""
CONTROL = re.compile(rb"[\x00-\x08\x0e-\x1f]")
"""Control characters that no text has; the header and the first triangle of a binary STL have some."""
OBJ_LINE = re.compile(rb"(?im)^(v|vt|f)[ \t]+([^\n#]*)")
"""A vertex, a pair of texture coordinates or a face of an OBJ, without the comment behind it."""
LONGEST_LINE = 1 << 20
"""Most bytes of a line of an OBJ: a face of a hundred thousand corners."""
MOST_LINES = 4 * MOST_VERTICES
"""Most lines of a text: an OBJ has one for each vertex, normal, texture coordinate and face."""
BYTE_ORDER_MARKS = {
    codecs.BOM_UTF8: "utf-8",
    codecs.BOM_UTF16_LE: "utf-16-le",
    codecs.BOM_UTF16_BE: "utf-16-be",
}
"""Encodings of texts by their first bytes."""


def read_stl(content: bytes, path: Path) -> Parsed:
    """Read a binary or ASCII STL. Raises InputError."""
    count, lines = int.from_bytes(content[80:STL_HEAD], "little"), tuple[str, ...]()
    exact = len(content) >= STL_HEAD and STL_HEAD + count * TRIANGLE.itemsize == len(content)
    text = b"" if exact else _text(content, path)
    if exact or text[:5].lower() != b"solid" or CONTROL.search(text[: STL_HEAD + TRIANGLE.itemsize]):
        if not exact:
            count, line = _held(content, text, count, path)
            lines = (line,)
        check_count(count, "triangles", path)
        corners = np.frombuffer(content, TRIANGLE, count, STL_HEAD)["corners"].astype(np.float64)
    else:
        vertices = (vertex.groups() for vertex in STL_VERTEX.finditer(text) if vertex[1] is not None)
        numbers = chain.from_iterable(islice(vertices, MOST_VERTICES + 1))
        corners = np.fromiter(map(float, numbers), np.float64)
        check_count(-(-len(corners) // 9), "triangles", path)
        if len(corners) % 9:
            raise InputError(f"{path}: damaged: {len(corners) // 3} vertices do not make whole triangles")
    corners = corners.reshape(-1, 3)
    return Parsed(corners, np.arange(len(corners)).reshape(-1, 3), warnings=lines)


def _held(content: bytes, text: bytes, stated: int, path: Path) -> tuple[int, str]:
    """Number of triangles of a binary STL whose header states another one than the file holds, and a line.

    Programs that write into a pipe cannot go back to the header. Others add bytes behind the triangles.
    Raises InputError for files that end within a triangle, and for what is no STL.
    """
    fault = f"{path}: damaged or not an STL:"
    if text and CONTROL.search(text[: STL_HEAD + TRIANGLE.itemsize]) is None:
        raise InputError(f"{fault} is a text that does not begin with the word solid")
    if len(content) < STL_HEAD:
        raise InputError(f"{fault} has {len(content)} bytes, fewer than the {STL_HEAD} of the header")
    held, more = divmod(len(content) - STL_HEAD, TRIANGLE.itemsize)
    line = f"the header states {stated} triangles"
    behind = content[STL_HEAD + stated * TRIANGLE.itemsize :]
    if 0 < stated <= held and (more or not any(behind)):
        return stated, f"{line}; {len(behind)} bytes behind them are left out"
    if held and (not more or stated in STREAMED):
        rest = f", without {more} bytes behind them" if more else ""
        return held, f"{line}; the {held} that the file holds are read{rest}"
    raise InputError(f"{fault} {line}, the file holds {held}" + (f" and {more} bytes" if more else ""))


def read_obj(content: bytes, path: Path) -> Parsed:
    """Read an OBJ with texture coordinates and colours; what it says of materials and normals is passed over.

    Polygons become triangles. Negative numbers count back from the last vertex before the face.

    Raises:
        InputError: A line is too long, holds no vertex or face, or there is more than is read.
    """
    vertices, coordinates, faces, pairs = array("d"), array("d"), array("q"), array("q")
    colours, lengths = array("f"), array("q")
    for line in OBJ_LINE.finditer(_text(content, path).replace(b"\\\n", b" ")):
        word, rest = line.groups()
        if len(rest) > LONGEST_LINE:
            raise InputError(f"{path}: has a line of more than {LONGEST_LINE} bytes")
        if word in b"vV":
            x, y, z, *more = rest.split()
            vertices.extend((float(x), float(y), float(z)))
            # Three more numbers are a colour, which programs write behind the position; one is a weight.
            if len(more) >= 3:
                with suppress(ValueError):
                    red, green, blue = map(float, more[-3:])
                    colours.extend((red, green, blue))
        elif word in b"fF":
            corners = rest.split()
            if b"/" in rest:
                both = [corner.split(b"/") for corner in corners]
                corners = [corner[0] for corner in both]
                if coordinates and all(len(corner) > 1 and corner[1] for corner in both):
                    pairs.extend(_counted([int(corner[1]) for corner in both], len(coordinates) // 2))
            faces.extend(_counted([int(corner) for corner in corners], len(vertices) // 3))
            lengths.append(len(corners))
        else:
            u, v = [*rest.split(None, 2), b"0"][:2]
            coordinates.extend((float(u), float(v)))
        if len(faces) > 3 * MOST_FACES or max(len(vertices), len(coordinates)) > 3 * MOST_VERTICES:
            break
    check_count(len(faces) - 2 * len(lengths), "faces", path)
    check_count(max(len(vertices) // 3, len(coordinates) // 2), "vertices", path, MOST_VERTICES)
    points, corners = np.array(vertices).reshape(-1, 3), np.array(faces, np.int64)
    places = triangulated(points, corners, np.array(lengths, np.int64), path)
    uv = None
    # Only where all corners have texture coordinates do they place a texture.
    if faces and len(pairs) == len(faces):
        numbers = np.array(pairs)
        check_numbers(numbers, len(coordinates) // 2, "texture coordinates", path)
        uv = np.array(coordinates).reshape(-1, 2)[numbers][places]
    painted = None
    if colours and len(colours) == len(vertices):
        painted = np.array(colours).reshape(-1, 3)[corners[places]]
    return Parsed(points, corners[places], uv, colours=painted)


def _counted(numbers: list[int], count: int) -> list[int]:
    """Corners of a polygon, from 0, whose numbers begin at 1 or count back."""
    if len(numbers) < 3 or 0 in numbers:
        raise ValueError(f"a face of the corners {numbers[:3]}")
    return [number - 1 if number > 0 else count + number for number in numbers]


def _text(content: bytes, path: Path) -> bytes:
    """A text in UTF-8 without its byte order mark, with line feeds for all kinds of line ends.

    Spaces at the begin of lines and empty lines are left out. Raises InputError if there are too many lines.
    """
    for mark, encoding in BYTE_ORDER_MARKS.items():
        if content.startswith(mark):
            content = content[len(mark) :]
            if encoding != "utf-8":
                content = content.decode(encoding, "replace").encode()
    content = content.replace(b"\r", b"\n") if b"\r" in content else content
    content = re.sub(rb"\n[ \t\n]+", b"\n", content.lstrip())
    check_count(content.count(b"\n"), "lines", path, MOST_LINES)
    return content
