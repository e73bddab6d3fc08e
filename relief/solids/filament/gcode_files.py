"""Files of G-code: their text and what they state beside the text."""

import io
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from relief.ground.errors import InputError
from relief.ground.files import read_limited

LARGEST_TEXT = 1 << 28
"""Most bytes of G-code, packed and unpacked: seven million lines."""


@dataclass(frozen=True)
class GcodeText:
    """Text of a file.

    Attributes:
        content: G-code.
        settings: what the file states beside its G-code.
        warnings: lines about content that was left out.
    """

    content: bytes
    settings: Mapping[str, str] = field(default_factory=dict)
    warnings: tuple[str, ...] = ()

    def lines(self) -> io.TextIOWrapper:
        """Lines of the text."""
        return io.TextIOWrapper(io.BytesIO(self.content), "utf-8", errors="replace", newline=None)


def open_gcode(path: Path) -> GcodeText:
    """Read a file of G-code. Raises InputError."""
    content = read_limited(path, LARGEST_TEXT)
    if b"\0" in content[:4096]:
        raise InputError(f"{path}: is no G-code")
    return GcodeText(content)
