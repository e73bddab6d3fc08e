"""Files of G-code: plain text, a project with sliced plates (`.gcode.3mf`), and PrusaSlicer's binary form."""

import io
import re
import struct
import zipfile
import zlib
from collections.abc import Iterator
from pathlib import Path

from relief.ground.errors import InputError, require_extra
from relief.ground.files import damage_named, read_limited

LARGEST_TEXT = 1 << 28
"""Most bytes of a file and of its G-code: seven million moves."""
MOST_ENTRIES = 10_000
"""Most files in a project."""
PLATE = re.compile(r"/?Metadata/plate_(\d{1,4})\.gcode", re.IGNORECASE)
LARGEST_BLOCK = 1 << 24
"""Most bytes of a block of a binary file; PrusaSlicer's hold 64 KB of G-code."""
GCODE, THUMBNAIL, KINDS = 1, 5, 6
"""Types of blocks, and how many there are: the others hold settings, as `key=value`."""
WINDOWS = {2: 11, 3: 12}
"""Bits of the window of heatshrink by the number of the compression."""
PACKED = b"0123456789. \nGX"
"""Characters that MeatPack packs into four bits; the sixteenth number stands for a character in full."""
SIGNAL = re.compile(rb"\xff\xff(.)", re.DOTALL)
"""A command to the unpacker of MeatPack: packing on, off, or off at the end; lines without or with spaces."""
ON, OFF, RESET, NO_SPACES, SPACES = 251, 250, 249, 247, 246


def open_gcode(path: Path) -> tuple[bytes, tuple[str, ...]]:
    """Text of a file of G-code, and lines about what was left out.

    Args:
        path: of the file; its content says which form it has.

    Raises:
        InputError: the file cannot be read, is too large, damaged or no G-code.
    """
    content = read_limited(path, LARGEST_TEXT)
    if content.startswith(b"PK\3\4"):
        with damage_named(path, "a project with G-code"):
            return _plate(content, path)
    if content.startswith(b"GCDE"):
        with damage_named(path, "binary G-code"):
            return b"".join(_texts(memoryview(content), path)), ()
    if b"\0" in content:
        raise InputError(f"{path}: is no G-code: holds bytes that no text has")
    return content, ()


def _plate(content: bytes, path: Path) -> tuple[bytes, tuple[str, ...]]:
    """G-code of the first sliced plate of a project."""
    if content.count(b"PK\1\2") > MOST_ENTRIES:
        raise InputError(f"{path}: has more than {MOST_ENTRIES} files in the archive")
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        plates = {int(found[1]): name for name in archive.namelist() if (found := PLATE.fullmatch(name))}
        if not plates:
            raise InputError(f"{path}: holds no G-code; slice a plate and export the sliced file")
        first = min(plates)
        with archive.open(plates[first]) as file:
            text = file.read(LARGEST_TEXT + 1)
    if len(text) > LARGEST_TEXT:
        raise InputError(f"{path}: plate {first} unpacks to more than {LARGEST_TEXT} bytes")
    others = ", ".join(str(number) for number in sorted(plates) if number != first)
    return text, (f"holds several plates: plate {first} is read, not {others}",) if others else ()


def _texts(content: memoryview, path: Path) -> Iterator[bytes]:
    """Settings of a binary file as comments, and G-code, block by block."""
    version, checksum = struct.unpack_from("<IH", content, 4)
    if version != 1 or checksum > 1:
        raise InputError(f"{path}: version {version} of binary G-code is not read; export a text file")
    at, total = 10, 0
    while at < len(content):
        kind, compression, size = struct.unpack_from("<HHI", content, at)
        head = 12 if compression else 8
        packed = struct.unpack_from("<I", content, at + 8)[0] if compression else size
        data = at + head + (6 if kind == THUMBNAIL else 2)
        end = data + packed + 4 * checksum
        total += size
        if kind >= KINDS or max(size, packed) > LARGEST_BLOCK or end > len(content) or total > LARGEST_TEXT:
            raise InputError(f"{path}: is cut off, damaged, or too large, at byte {at}")
        stated = int.from_bytes(content[end - 4 : end], "little")
        if checksum and zlib.crc32(content[at : data + packed]) != stated:
            raise InputError(f"{path}: is damaged: the checksum of the block at byte {at} is another")
        if kind != THUMBNAIL:
            block = _unpacked(bytes(content[data : data + packed]), compression, path)
            if len(block) != size:
                raise InputError(f"{path}: is damaged: the block at byte {at} unpacks to another length")
            encoding = struct.unpack_from("<H", content, at + head)[0]
            settings = b"; " + block.replace(b"\n", b"\n; ") + b"\n"
            yield _text(block, encoding) if kind == GCODE else settings
        at = end


def _unpacked(block: bytes, compression: int, path: Path) -> bytes:
    """Data of a block."""
    if compression < 2:
        return zlib.decompressobj().decompress(block, LARGEST_BLOCK + 1) if compression else block
    require_extra("bgcode", "heatshrink2", path)
    import heatshrink2

    return bytes(heatshrink2.decompress(block, window_sz2=WINDOWS[compression], lookahead_sz2=4))


def _text(block: bytes, encoding: int) -> bytes:
    """Text of a block of G-code: as it is, or in MeatPack, with or without comments."""
    if encoding > 2:
        raise ValueError(f"encoding {encoding} of a block of G-code is not known")
    parts = SIGNAL.split(block) if encoding else [block]
    texts, packed, alphabet = [parts[0]], False, PACKED
    for command, part in zip(parts[1::2], parts[2::2], strict=True):
        code = command[0]
        if code in (NO_SPACES, SPACES):
            alphabet = PACKED.replace(b" ", b"E") if code == NO_SPACES else PACKED
        packed = code == ON or (packed and code not in (OFF, RESET))
        texts.append(_unpaired(part, alphabet) if packed else part)
    return b"".join(texts)


def _unpaired(part: bytes, alphabet: bytes) -> bytes:
    """Characters of packed pairs: the first in the lower four bits; 15 stands for one behind the pair."""
    characters, rest = bytearray(), iter(part)
    for byte in rest:
        for code in (byte & 15, byte >> 4):
            characters.append(alphabet[code] if code < 15 else next(rest, 10))
    return bytes(characters)
