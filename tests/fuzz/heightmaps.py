"""Height maps of every kind: PNG, TIFF, EXR and NPY, with hostile headers, samples and bytes."""

from __future__ import annotations

import io
import struct
import tempfile
import zlib
from pathlib import Path
from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from tests.fuzz.case import HOSTILE, WORDS, Case, chance, edited, png_resealed, several_edits

SIDES = (*(16,) * 12, 17, 24, 32, 1, 2, 15, 0)
"""Samples a side; 16 is the least that is read."""
LENGTHS = (None, None, 1.0, 10.0, 0.1, 1000.0, 1e-6, 0.0, -1.0, 1e300, "nan", "inf", "x")
"""Values of the options `size_mm`, `relief_mm` and `height_scale`; texts stand for what JSON lacks."""
COMPRESSIONS = ("NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24", "B44", "B44A", "DWAA", "DWAB")

Samples = NDArray[Any]


@st.composite
def samples(draw: st.DrawFn, dtypes: tuple[str, ...]) -> Samples:
    """(rows, cols) samples of one of these types: noise, a constant or a few hostile values in zeros."""
    rows = draw(st.sampled_from(SIDES))
    cols = draw(st.sampled_from((rows,) * 10 + (rows + 1, 16)))
    kind = np.dtype(draw(st.sampled_from(dtypes)))
    random = np.random.default_rng(draw(st.integers(0, 1000)))
    if kind.kind == "f":
        high = draw(st.sampled_from((*(1.0,) * 6, 3.0, 3.0000005, 4.0, 1e30)))
        with np.errstate(over="ignore"):
            values = (random.random((rows, cols)) * high).astype(kind)
    else:
        limits = np.iinfo(kind.str)
        top = draw(st.sampled_from((limits.max, limits.max, 1, 4095)))
        values = random.integers(0, min(top, limits.max), (rows, cols), kind, endpoint=True)
    if kind.kind == "f" and values.size and chance(draw, 5):
        with np.errstate(over="ignore"):
            values.flat[0] = draw(st.sampled_from((np.nan, np.inf, -np.inf, -1e-9, -1.0, 1e308)))
    return values


def _chunk(kind: bytes, body: bytes) -> bytes:
    return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))


@st.composite
def pngs(draw: st.DrawFn) -> bytes:
    """PNG of any bit depth and kind of colour, sound or not, with text and transparency."""
    side = draw(st.sampled_from(SIDES))
    height = draw(st.sampled_from((side,) * 60 + (side + 1, *WORDS)))
    depth, colour = draw(
        st.sampled_from([(d, 0) for d in (1, 2, 4, 8, 16)] * 2)
        | st.sampled_from([(8, 2), (16, 2), (8, 4), (16, 4), (8, 6), (16, 6), (1, 3), (2, 3), (4, 3), (8, 3)])
        | st.tuples(st.sampled_from((1, 8, 16, 0, 3, 255)), st.sampled_from((0, 1, 2, 3, 4, 5, 6, 255)))
    )
    channels = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}.get(colour, 1)
    row = -(-side * channels * min(depth, 16) // 8)
    random = np.random.default_rng(draw(st.integers(0, 1000)))
    rows = random.integers(0, 256, (min(height, 40), max(1, row + 1)), np.uint8)
    rows[:, 0] = draw(st.sampled_from((*(0,) * 8, 1, 4, 9)))
    if channels > 1 and draw(st.booleans()):
        rows[:, 1:] = 128
    interlaced = draw(st.sampled_from((*(0,) * 8, 1, 2)))
    header = struct.pack(">IIBBBBB", side, height, depth, colour, 0, 0, interlaced)
    chunks = [_chunk(b"IHDR", header)]
    if colour == 3 or chance(draw, 8):
        palette = random.integers(0, 256, 3 * draw(st.sampled_from((0, 1, 2, 16, 256, 300))), np.uint8)
        chunks.append(_chunk(b"PLTE", palette.tobytes()))
    if chance(draw, 6):
        name = draw(st.sampled_from((b"tRNS", b"gAMA", b"sBIT", b"acTL", b"iCCP")))
        chunks.append(_chunk(name, draw(st.binary(max_size=12))))
    for _ in range(draw(st.sampled_from((0, 0, 1, 2)))):
        key = draw(st.sampled_from(("retouch.size_mm", "retouch.relief_mm", "retouch.size_mm ", "x")))
        value = draw(st.just("1.5") | st.sampled_from(("10", "10.0", *HOSTILE))).encode()
        kind = draw(st.sampled_from((b"tEXt", b"zTXt", b"iTXt")))
        between = {b"tEXt": b"\0", b"zTXt": b"\0\0", b"iTXt": b"\0\0\0\0\0"}[kind]
        packed = zlib.compress(value * draw(st.sampled_from((1, 1, 1, 5000)))) if kind == b"zTXt" else value
        chunks.append(_chunk(kind, key.encode() + between + packed))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        [*chunks, _chunk(b"IDAT", zlib.compress(rows.tobytes(), 1)), _chunk(b"IEND", b"")]
    )


@st.composite
def tiffs(draw: st.DrawFn) -> bytes:
    """TIFF of whole or floating-point numbers, of any photometric interpretation."""
    import tifffile

    values = draw(samples(("u1", "u1", "u2", "f4", "f8", "f2", "i1", "i2", "u4")))
    file = io.BytesIO()
    if not values.size:
        return b"II*\0\x08\0\0\0"
    tags: tuple[list[Any], ...] = ([], [], [(274, "H", 1, 6, True)], [(42113, "s", 0, "0", True)])
    photometric = draw(st.sampled_from(("minisblack", "minisblack", "miniswhite", "rgb", "palette")))
    if photometric == "rgb":
        values = np.repeat(values[..., None], draw(st.sampled_from((3, 4))), axis=-1)
    try:
        tifffile.imwrite(
            file,
            values,
            photometric=photometric,
            byteorder=draw(st.sampled_from("<>")),
            compression=draw(st.sampled_from((None, None, "zlib", "lzw", "packbits", "zstd", "lzma"))),
            rowsperstrip=draw(st.sampled_from((None, 1, 5))),
            extratags=draw(st.sampled_from(tags)),
            metadata=None,
        )
    except (ValueError, TypeError, KeyError, ZeroDivisionError):
        return b"II*\0\x08\0\0\0"
    return file.getvalue()


@st.composite
def exrs(draw: st.DrawFn) -> bytes:
    """EXR with channels of any name and type, and hostile lengths in its header."""
    import OpenEXR

    values = draw(samples(("f4", "f4", "f2", "u4")))
    if not values.size:
        return b"v/1\x01\x02\0\0\0"
    names = draw(
        st.sampled_from(
            (("Y",), ("Y",), ("Z",), ("R", "G", "B"), ("R",), ("Y", "A"), ("é",), ("RY", "BY", "Y"))
        )
    )
    channels = {
        name: values + values.dtype.type(draw(st.sampled_from((0, 0, 0, 1)))) if place else values
        for place, name in enumerate(names)
    }
    header: dict[str, Any] = {
        "compression": getattr(OpenEXR, f"{draw(st.sampled_from(COMPRESSIONS))}_COMPRESSION"),
        "type": OpenEXR.scanlineimage,
    }
    for key in draw(st.sampled_from(((), (), ("size_mm",), ("size_mm", "relief_mm")))):
        text = draw(st.just("1.5") | st.sampled_from(("10", *HOSTILE)))
        header[f"retouch.{key}"] = _number(text) if draw(st.booleans()) else text
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "a.exr")
        try:
            OpenEXR.File(header, channels).write(str(path))
        except (RuntimeError, ValueError, TypeError):
            return b"v/1\x01\x02\0\0\0"
        return path.read_bytes()


def _number(text: str) -> float | str:
    try:
        return float(text)
    except (ValueError, OverflowError):
        return text


DTYPES = ("<f8", "<f4", "<f2", ">f8", "<i4", "|u1", "|b1", "<c16", "|O", "<U4", "<M8[s]", "<f16", "x", "V0")


@st.composite
def npys(draw: st.DrawFn) -> bytes:
    """NPY whose header need not agree with its data."""
    values = draw(samples(("f8", "f8", "f4", "i4", "u1")))
    if draw(st.booleans()):
        file = io.BytesIO()
        np.save(file, values)
        return file.getvalue()
    sides = st.sampled_from((values.shape[0], values.shape[0], 16, 0, -1, 2**31, 2**62, 10**30))
    shape = tuple(draw(st.lists(sides, max_size=3)))
    kind = draw(st.sampled_from((values.dtype.str,) * 4 + DTYPES))
    order = draw(st.sampled_from(("False", "False", "True", "1", "None")))
    described = f"{{'descr': {kind!r}, 'fortran_order': {order}, 'shape': {shape!r}, }}"
    text = draw(
        st.sampled_from((described,) * 5 + ("{}", "[" * 3000, "{'descr': 1}", "__import__('os')", "9" * 5000))
    )
    version = draw(st.sampled_from((b"\x01\0",) * 4 + (b"\x02\0", b"\x03\0", b"\x09\0")))
    size = struct.pack("<H" if version == b"\x01\0" else "<I", len(text.encode()) + 1)
    return b"\x93NUMPY" + version + size + text.encode() + b"\n" + values.tobytes()


@st.composite
def texts(draw: st.DrawFn) -> bytes:
    """A grid of numbers with any delimiter, with or without the heading of ESRI."""
    values = draw(samples(("f4", "f4", "u1")))
    sign = draw(st.sampled_from((",", ";", "\t", " ", "x")))
    rows = [sign.join(f"{value:.4g}" for value in row) for row in values[:40]]
    cols, count = (draw(st.sampled_from((side, side, side, *WORDS))) for side in (values.shape[1], len(rows)))
    heading = (
        f"ncols {cols}\nnrows {count}\ncellsize 1\nNODATA_value {draw(st.sampled_from(('0', 'x', '-9999')))}"
    )
    lines = draw(st.sampled_from(([], [heading], ["x,y"], ["#" * 9]))) + rows
    return draw(st.sampled_from(("\n", "\r\n", "\r"))).join(lines).encode()


SORTS = {"png": pngs(), "tif": tiffs(), "exr": exrs(), "npy": npys(), "csv": texts(), "asc": texts()}


@st.composite
def height_maps(draw: st.DrawFn, whole: bool) -> Case:
    """A height map, and the options it is read with."""
    sort = draw(st.sampled_from((*SORTS, "png", "exr")))
    changes = draw(several_edits()) if chance(draw, 2) else []
    content = edited(draw(SORTS[sort]), changes)
    if sort == "png" and changes and draw(st.booleans()):
        content = png_resealed(content)
    name = "plate." + draw(st.sampled_from((sort,) * 30 + tuple(SORTS)))
    options: list[Any] = [None, 1.0, None]
    if chance(draw, 5):
        options = [draw(st.sampled_from(LENGTHS)) for _ in range(3)]
    if not whole:
        return Case("height maps", {name: content}, [name, *options])
    flags = ("--size-mm", "--relief-mm", "--height-scale")
    given = [f"{flag}={value}" for flag, value in zip(flags, options, strict=True) if value is not None]
    exports = (("-o", "out.stl"), ("-o", "out.glb"), ("-o", "heights.png"), ("--repeat=2x2", "-o", "out.3mf"))
    verbs = (("evaluate", name, "--json"), *(("export", name, *more) for more in exports))
    verb = draw(st.sampled_from(verbs))
    return Case("height maps", {name: content}, [], (*verb, *given))
