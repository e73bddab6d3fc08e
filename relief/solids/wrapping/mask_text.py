"""Texts of masks: comparisons, names and pictures, joined by & and |, turned round by not, in parentheses.

not binds before &, and & before |. A name or a file with one of these signs stands in quotation marks.
"""

import re
from dataclasses import dataclass

from relief.ground.errors import InputError
from relief.ground.lengths import shown

GRAMMAR = (
    "z>2, z>2..5, angle<60, angle:-x<30, turn>90, outside, a picture, colour, colour:red or a region's name, "
    "several joined by & or |, with not and parentheses"
)
"""The grammar of masks, for messages."""
LONGEST = 1000
"""Most characters of a mask."""
DEEPEST = 20
"""Deepest nesting of parentheses."""
TOKEN = re.compile(r"""\s*(?:([&|()])|"([^"]*)"|'([^']*)'|(not)(?=[\s(]|$)|([^&|()"'\s][^&|()"']*))""")
"""A sign, a name in quotation marks, the word not, or anything else up to the next sign."""


@dataclass(frozen=True)
class MaskPart:
    """A part of a mask that is not divided further.

    Attributes:
        text: A comparison, a name or a file.
        inverted: Whether what it leaves out is meant.
    """

    text: str
    inverted: bool


@dataclass(frozen=True)
class Joined:
    """Masks that are joined.

    Attributes:
        parts: At least two.
        any: Whether one of them is enough; else all are needed.
    """

    parts: "tuple[Mask, ...]"
    any: bool


Mask = MaskPart | Joined


def mask_of(text: str) -> Mask:
    """The mask of a text, with every not brought to its parts. Raises InputError."""
    if not text.strip() or len(text) > LONGEST:
        raise InputError(f"mask: {text[:40]!r} is no mask; expected {GRAMMAR}")
    return _MaskParser(text).whole()


class _MaskParser:
    def __init__(self, text: str) -> None:
        self._text, self._at, self._depth = text, 0, 0

    def whole(self) -> Mask:
        mask = self._any(inverted=False)
        if self._peek() != "":
            raise self._refusal(f"{self._peek()} has no beginning")
        return mask

    def _any(self, inverted: bool) -> Mask:
        parts = [self._all(inverted)]
        while self._taken("|"):
            parts.append(self._all(inverted))
        # By De Morgan's laws not (a | b) is not a & not b.
        return parts[0] if len(parts) == 1 else Joined(tuple(parts), any=not inverted)

    def _all(self, inverted: bool) -> Mask:
        parts = [self._one(inverted)]
        while self._taken("&"):
            parts.append(self._one(inverted))
        return parts[0] if len(parts) == 1 else Joined(tuple(parts), any=inverted)

    def _one(self, inverted: bool) -> Mask:
        match = TOKEN.match(self._text, self._at)
        while match and match[4]:
            inverted, self._at = not inverted, match.end()
            match = TOKEN.match(self._text, self._at)
        if match is None or (match[1] and match[1] != "("):
            raise self._refusal("a part is missing")
        self._at = match.end()
        if not match[1]:
            text = next(part for part in match.group(2, 3, 5) if part is not None)
            return MaskPart(text.strip(), inverted)
        self._depth += 1
        if self._depth > DEEPEST:
            raise self._refusal(f"has more than {DEEPEST} parentheses within one another")
        mask = self._any(inverted)
        if not self._taken(")"):
            raise self._refusal("a parenthesis is open")
        self._depth -= 1
        return mask

    def _peek(self) -> str:
        """The next characters; empty at the end."""
        return self._text[self._at :].strip()[:20]

    def _taken(self, sign: str) -> bool:
        """Whether a sign follows, which is passed then."""
        match = TOKEN.match(self._text, self._at)
        if match is None or match[1] != sign:
            return False
        self._at = match.end()
        return True

    def _refusal(self, fault: str) -> InputError:
        return InputError(f"mask: {shown(self._text)!r}: {fault}; expected {GRAMMAR}")
