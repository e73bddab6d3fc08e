"""Files of every kind that docs/reference/formats.md promises, with the values that they hold."""

from collections.abc import Callable, Iterator
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import tifffile
from numpy.typing import NDArray
from PIL import Image, ImageOps

HIGH, WIDE = 40, 56
Values = NDArray[np.float64]
Writer = Callable[[Path], Values]
"""Writes a file, and returns (rows, cols) in units of white, or numbers, NaN where nothing was measured."""
WHOLE = ("uint8", "uint16", "uint32")
NUMBERS = ("int8", "int16", "int32", "float16", "float32", "float64")
TO_UPRIGHT = {2: 2, 3: 3, 4: 4, 5: 5, 6: 8, 7: 7, 8: 6}
"""Orientation that undoes each one."""


def surface() -> Values:
    """Heights from 0 to 1, without symmetry."""
    y, x = np.mgrid[0:HIGH, 0:WIDE]
    heights = np.sin(x / 5.0) * np.cos(y / 7.0) + 0.03 * x + (y < 9) * (x < 20)
    return np.asarray((heights - heights.min()) / np.ptp(heights))


def stored(kind: str, holes: bool = False) -> NDArray[Any]:
    """The surface in numbers of a type: grey up to white, or numbers about 100."""
    of = np.dtype(kind)
    if of.kind == "f":
        values = (90.0 + 30.0 * surface()).astype(of)
        return np.where(_hole(), np.nan, values).astype(of) if holes else values
    top = np.iinfo(of).max if of.kind == "u" else 100
    return np.rint(top * surface()).astype(of)


def _hole() -> NDArray[np.bool_]:
    y, x = np.mgrid[0:HIGH, 0:WIDE]
    return np.asarray((x > 30) & (x < 41) & (y > 5) & (y < 17))


def true(values: NDArray[Any], holes: bool = False) -> Values:
    """What a reader is to make of stored values."""
    top = np.iinfo(values.dtype).max if values.dtype.kind == "u" else 1
    return np.where(_hole() if holes else False, np.nan, values.astype(np.float64) / top)


def turned(values: NDArray[Any], orientation: int) -> NDArray[Any]:
    """The rows that a file of this orientation stores of upright values."""
    ways: dict[int, Callable[[NDArray[Any]], NDArray[Any]]] = {
        1: lambda a: a,
        2: lambda a: a[:, ::-1],
        3: lambda a: a[::-1, ::-1],
        4: lambda a: a[::-1],
        5: lambda a: a.swapaxes(0, 1),
        6: lambda a: a.swapaxes(0, 1)[::-1],
        7: lambda a: a.swapaxes(0, 1)[::-1, ::-1],
        8: lambda a: a.swapaxes(0, 1)[:, ::-1],
    }
    return np.ascontiguousarray(ways[orientation](values))


def promised() -> Iterator[tuple[str, str, Writer]]:
    """Name, suffix and writer of each file."""
    yield from _tiffs()
    yield from _pictures()
    yield from _numbers()
    yield from _texts()


def _tiff(values: NDArray[Any], truth: Values, **options: Any) -> Writer:
    def write(path: Path) -> Values:
        tifffile.imwrite(path, values, **({"photometric": "minisblack"} | options))
        return truth

    return write


def _tiffs() -> Iterator[tuple[str, str, Writer]]:
    layouts: dict[str, dict[str, Any]] = {
        "strips": {"rowsperstrip": 7},
        "tiles": {"tile": (16, 32)},
        "big": {"bigtiff": True, "byteorder": ">"},
        "big-endian": {"byteorder": ">"},
        "zlib": {"compression": "zlib", "predictor": True},
        "lzw": {"compression": "lzw"},
        "packbits": {"compression": "packbits"},
        "zstd": {"compression": "zstd", "tile": (32, 16)},
        "lzma": {"compression": "lzma"},
    }
    for kind, (layout, options) in product((*WHOLE, *NUMBERS), layouts.items()):
        if layout == "zlib" and kind == "float64":
            options = {"compression": "zlib"}
        yield f"tiff-{kind}-{layout}", ".tif", _tiff(stored(kind), true(stored(kind)), **options)
    for kind, orientation in product((*WHOLE, "int16", "float32"), range(2, 9)):
        tag = [(274, "H", 1, orientation, True)]
        values = turned(stored(kind), orientation)
        yield (
            f"tiff-{kind}-orientation-{orientation}",
            ".tif",
            _tiff(values, true(stored(kind)), extratags=tag),
        )
    for kind, marker in product(
        ("uint8", "uint16", "int16", "int32", "float32", "float64"), (0.0, -9999.0, 7.0)
    ):
        of = np.dtype(kind)
        if of.kind == "u" and marker < 0.0:
            continue
        values = np.where(_hole(), of.type(marker), np.maximum(stored(kind), 8)).astype(of)
        truth = true(np.maximum(stored(kind), 8).astype(of), holes=True)
        of_gdal: list[Any] = [(42113, "s", 0, f"{marker:g}", True)]
        yield f"tiff-{kind}-no-data-{marker:g}", ".tif", _tiff(values, truth, extratags=of_gdal)
    for kind in ("float16", "float32", "float64"):
        values = stored(kind, holes=True)
        yield f"tiff-{kind}-nan", ".tif", _tiff(values, values.astype(np.float64))
    for kind, planes in product((*WHOLE, "float32"), ("contig", "separate")):
        values = np.repeat(stored(kind)[..., None], 3, 2)
        values = np.ascontiguousarray(np.moveaxis(values, -1, 0)) if planes == "separate" else values
        truth = true(stored(kind))
        yield (
            f"tiff-{kind}-rgb-{planes}",
            ".tif",
            _tiff(values, truth, photometric="rgb", planarconfig=planes),
        )
    for kind in ("uint8", "uint16"):
        grey = stored(kind)
        full = np.full_like(grey, np.iinfo(grey.dtype).max)
        options = {"extrasamples": ["unassalpha"]}
        yield f"tiff-{kind}-alpha", ".tif", _tiff(np.stack([grey, full], -1), true(grey), **options)
        yield f"tiff-{kind}-white", ".tif", _tiff(full - grey, true(grey), photometric="miniswhite")
        yield f"tiff-{kind}-thumbnail", ".tif", _with_thumbnail(grey)
        yield f"tiff-{kind}-mask", ".tif", _with_mask(grey)


def _with_thumbnail(grey: NDArray[Any]) -> Writer:
    def write(path: Path) -> Values:
        with tifffile.TiffWriter(path) as file:
            small = np.repeat((grey[::4, ::4, None] // 3).astype(np.uint8), 3, 2)
            file.write(small, photometric="rgb", subfiletype=1)
            file.write(grey, photometric="minisblack")
        return true(grey)

    return write


def _with_mask(grey: NDArray[Any]) -> Writer:
    def write(path: Path) -> Values:
        with tifffile.TiffWriter(path) as file:
            file.write(grey, photometric="minisblack")
            file.write(~_hole(), photometric="minisblack", subfiletype=4)
        return true(grey, holes=True)

    return write


def _saved(image: Image.Image, truth: Values, **options: Any) -> Writer:
    def write(path: Path) -> Values:
        image.save(path, **options)
        return truth

    return write


def _pictures() -> Iterator[tuple[str, str, Writer]]:
    grey = stored("uint8")
    for mode in ("L", "RGB", "RGBA", "LA", "P"):
        for suffix in (".png", ".tif"):
            yield f"{suffix[1:]}-{mode}", suffix, _saved(Image.fromarray(grey).convert(mode), true(grey))
    for suffix, options in ((".bmp", {}), (".gif", {}), (".pgm", {}), (".webp", {"lossless": True})):
        yield f"{suffix[1:]}", suffix, _saved(Image.fromarray(grey), true(grey), **options)
    deep = stored("uint16")
    yield "png-16", ".png", _saved(Image.fromarray(deep), true(deep))
    yield "pgm-16", ".pgm", _saved(Image.fromarray(deep), true(deep))
    for orientation, values in product(range(2, 9), (grey, deep)):
        exif = Image.Exif()
        exif[274] = orientation
        image = Image.fromarray(turned(values, orientation))
        name = f"png-{values.dtype}-orientation-{orientation}"
        yield name, ".png", _saved(image, true(values), exif=exif)
    two = (surface() > 0.5).astype(np.uint8)
    image = Image.fromarray(two * 255).convert("1")
    for suffix in (".png", ".tif", ".bmp"):
        yield f"{suffix[1:]}-1", suffix, _saved(image, two.astype(np.float64))
    yield "png-inverted", ".png", _saved(ImageOps.invert(Image.fromarray(255 - grey)), true(grey))


def _numbers() -> Iterator[tuple[str, str, Writer]]:
    for kind, order, holes in product(("<f8", ">f8", "<f4", ">f4", "<f2", ">f2"), "CF", (False, True)):
        values = np.asarray(stored(kind[1:], holes).astype(kind), order=order)  # type: ignore[call-overload]
        yield f"npy-{kind}-{order}-{holes}", ".npy", _array(values)
    for kind, order in product(("u1", "<u2", ">u4", "<u8", "i1", ">i2", "<i4", "<i8"), "CF"):
        values = np.asarray(np.rint(100 * surface()).astype(kind), order=order)  # type: ignore[call-overload]
        yield f"npy-{kind}-{order}", ".npy", _array(values)
    for kind in ("f4", "f8"):
        yield f"npy-{kind}-rgb", ".npy", _array(np.repeat(stored(kind)[..., None], 3, 2))
        yield f"npy-{kind}-one", ".npy", _array(stored(kind)[..., None])
    compressions = ("NO", "RLE", "ZIPS", "ZIP", "PIZ", "PXR24")
    for compression, kind, holes in product(compressions, ("float32", "float16", "uint32"), (False, True)):
        if kind == "uint32" and holes:
            continue
        values = stored("float32", holes) if kind != "uint32" else np.rint(100 * surface())
        yield f"exr-{compression}-{kind}-{holes}", ".exr", _exr({"Y": values.astype(kind)}, compression)
    grey = stored("float32")
    other = grey[::-1].copy()
    for names in ("Z", "RGB", "height", "RGBA", "YA", "Z+R"):
        channels = {name: grey for name in ((*names,) if names.isupper() else (names,)) if name != "+"}
        channels |= {"A": np.ones_like(grey)} if "A" in names else {}
        channels |= {"R": other} if "+" in names else {}
        yield f"exr-{names}", ".exr", _exr(channels, "ZIP")


def _array(values: NDArray[Any]) -> Writer:
    def write(path: Path) -> Values:
        np.save(path, values)
        return (values if values.ndim == 2 else values[..., 0]).astype(np.float64)

    return write


def _exr(channels: dict[str, NDArray[Any]], compression: str) -> Writer:
    def write(path: Path) -> Values:
        header = {
            "compression": getattr(OpenEXR, f"{compression}_COMPRESSION"),
            "type": OpenEXR.scanlineimage,
        }
        OpenEXR.File(header, dict(channels)).write(str(path))
        first = next(channels[name] for name in ("Y", "Z", *channels) if name in channels)
        return first.astype(np.float64)

    return write


def _texts() -> Iterator[tuple[str, str, Writer]]:
    for sign, holes, point, ends in product((",", ";", "\t", " "), ("", "nan", "---"), ".,", ("\n", "\r\n")):
        if (sign == "," and point == ",") or (holes == "" and sign == " "):
            continue
        yield f"text-{sign!r}-{holes}-{point}-{ends!r}", ".csv", _table(sign, holes, point, ends)
    for sign, holes, code in product(",;\t", ("BAD", "#N/A", ""), ("utf-8-sig", "utf-16")):
        point = "." if sign == "," else ","
        heading = sign.join(f"h.{column}" for column in range(WIDE)) + "\n"
        yield f"text-{sign!r}-{holes}-{code}", ".txt", _table(sign, holes, point, "\r\n", heading, code)
    heading = f"ncols {WIDE}\nnrows {HIGH}\nxllcorner 5\nyllcorner 6\ncellsize 0.5\n"
    for no_data in ("-9999", "-32768", "0"):
        lines = f"{heading}NODATA_value {no_data}\n"
        yield f"asc-{no_data}", ".asc", _table(" ", no_data, ".", "\n", lines)
    yield "asc-no-marker", ".asc", _table(" ", "-9999", ".", "\n", heading)
    yield (
        "asc-capitals",
        ".asc",
        _table("\t", "-9999", ".", "\r\n", heading.upper().replace("CORNER", "CENTER")),
    )
    yield "asc-wrapped", ".asc", _table("\n", "-9999", ".", "\n", heading)


def _table(
    sign: str, holes: str, point: str, ends: str, heading: str = "", encoding: str = "utf-8"
) -> Writer:
    values = np.round(90.0 + 30.0 * surface(), 4)

    def write(path: Path) -> Values:
        cells = np.vectorize(lambda value: f"{value:.4f}".replace(".", point))(values).astype(object)
        cells[_hole()] = holes
        text = heading.replace("\n", ends) + ends.join(sign.join(row) for row in cells) + ends
        path.write_bytes(text.encode(encoding))
        return np.where(_hole(), np.nan, values)

    return write
