"""Case of the fuzzing: the files of a folder and what is done with them; byte edits of every kind."""

from __future__ import annotations

import base64
import json
import struct
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from hypothesis import strategies as st

Files = Mapping[str, bytes]
"""Contents by name, relative to the folder of a case."""
Edit = Callable[[bytes], bytes]

HOSTILE = (
    *("nan", "inf", "-inf", "1e300", "-1e300", "1e-300", "-1", "-0.0", "0", "1", "2", "16", "0.5", "1e400"),
    *("9" * 400, "1" + "0" * 30, "4294967296", "2147483648", "65537", "true", "", " ", "é", "\u202e", "a\nb"),
    *("../plate.exr", "plate.exr", "absent", ".", "..", "/", "$x", "${x}", "%s", "{}", "x" * 300),
)
"""Texts that a value may be: numbers at and beyond every bound, and words of no meaning."""
WORDS = (0, 1, 2, 15, 16, 17, 0x7F, 0x80, 0xFF, 0x7FFF, 0x8000, 0xFFFF, 0x7FFFFFFF, 0x80000000, 0xFFFFFFFF)
"""Whole numbers at the bounds of their types, for headers of two and of four bytes."""


@dataclass(frozen=True)
class Case:
    """Files of a folder, and what is done with them.

    Attributes:
        kind: Kind of the input, a key of `tests.fuzz.kinds.KINDS`.
        files: Contents by name.
        arguments: Of the reader; a list of numbers, texts and None.
        command: Of the whole command; empty for a reader alone.
    """

    kind: str
    files: Files
    arguments: Sequence[Any] = ()
    command: tuple[str, ...] = ()

    def __repr__(self) -> str:
        sizes = ", ".join(f"{name} ({len(content)} bytes)" for name, content in sorted(self.files.items()))
        return f"<{self.kind}: {sizes}; {list(self.arguments)}; {' '.join(self.command)}>"

    def as_json(self) -> dict[str, Any]:
        """The case as JSON, from which `of_json` makes the same case."""
        files = {name: base64.b64encode(content).decode() for name, content in self.files.items()}
        return {
            "kind": self.kind,
            "files": files,
            "arguments": json.loads(json.dumps(list(self.arguments))),
            "command": list(self.command),
        }

    @classmethod
    def of_json(cls, saved: Mapping[str, Any]) -> Case:
        """The case that `as_json` saved."""
        files = {name: base64.b64decode(text) for name, text in saved["files"].items()}
        return cls(saved["kind"], files, saved["arguments"], tuple(saved["command"]))


def chance(draw: st.DrawFn, one_in: int) -> bool:
    """True for one case in so many; the smallest case has False."""
    return draw(st.integers(1, one_in)) == one_in


def _place(content: bytes, at: int) -> int:
    return at % max(1, len(content))


def _replaced(content: bytes, at: int, new: bytes, removed: int) -> bytes:
    return content[:at] + new + content[at + removed :]


@st.composite
def edits(draw: st.DrawFn) -> Edit:
    """One change of some bytes; half of the changes are near the begin of the file, where headers are."""
    at = draw(st.integers(0, 300) | st.integers(0, 2**30))
    what = draw(st.sampled_from(("flip", "byte", "short", "long", "cut", "drop", "repeat", "insert")))
    if what == "flip":
        bit = draw(st.integers(0, 7))
        return lambda c: _replaced(c, p := _place(c, at), bytes([(c or b"\0")[p] ^ 1 << bit]), 1)
    if what == "byte":
        byte = bytes([draw(st.sampled_from((0, 0xFF, 0x7F, 0x80, 0x22, 0x3C, 0x0A)) | st.integers(0, 255))])
        return lambda c: _replaced(c, _place(c, at), byte, 1)
    if what in ("short", "long"):
        size, order = (2 if what == "short" else 4), draw(st.sampled_from("<>"))
        word = draw(st.sampled_from(WORDS)) & (256**size - 1)
        new = struct.pack(order + ("H" if size == 2 else "I"), word)
        return lambda c: _replaced(c, _place(c, at), new, size)
    if what == "cut":
        return lambda c: c[: _place(c, at)]
    length = draw(st.integers(1, 64))
    if what == "drop":
        return lambda c: _replaced(c, _place(c, at), b"", length)
    if what == "repeat":
        return lambda c: _replaced(c, p := _place(c, at), c[p : p + length] * 2, length)
    text = draw(st.sampled_from((*HOSTILE, "[" * 20_000))).encode()
    return lambda c: _replaced(c, _place(c, at), text, 0)


def edited(content: bytes, changes: Sequence[Edit]) -> bytes:
    """The bytes after some changes, one after the other."""
    for change in changes:
        content = change(content)
    return content


def several_edits(most: int = 4) -> st.SearchStrategy[list[Edit]]:
    """None to `most` changes; two of three cases have none, because most changes end at the first check."""
    return st.one_of(st.just([]), st.just([]), st.lists(edits(), min_size=1, max_size=most))


def png_resealed(content: bytes) -> bytes:
    """A PNG with the checksum of each chunk made right again."""
    at, parts = 8, [content[:8]]
    while at + 12 <= len(content):
        length = int.from_bytes(content[at : at + 4], "big")
        body = content[at + 4 : at + 8 + length]
        parts += [content[at : at + 4], body, struct.pack(">I", zlib.crc32(body))]
        at += 12 + length
    return b"".join([*parts, content[at:]])
