"""XML of a package as bytes in which some elements change, and all others stay to the last byte."""

import re
from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from xml.parsers import expat
from xml.sax.saxutils import quoteattr

TAG = re.compile(rb"<[^\"'>]*(?:\"[^\"]*\"[^\"'>]*|'[^']*'[^\"'>]*)*>")
"""A tag; values of attributes may hold its end."""
ATTRIBUTE = re.compile(rb"(\s+)([^\s=]+)(\s*=\s*)(?:\"[^\"]*\"|'[^']*')")
"""An attribute of a tag."""

Edit = tuple[int, int, bytes]
"""Place of the first byte that is replaced, of the one after the last, and what takes their place."""


@dataclass
class Element:
    """An element of a text.

    Attributes:
        name: Its tag, with the prefix of the namespace.
        attributes: By their names with prefixes.
        start: Place of its first byte.
        tag: Place after its first tag.
        end: Place after its last byte.
        within: The elements of interest in it, in their order.
    """

    name: str
    attributes: dict[str, str]
    start: int
    tag: int
    end: int = 0
    within: "list[Element]" = field(default_factory=list)

    @property
    def local(self) -> str:
        """The name without its prefix."""
        return self.name.rpartition(":")[2]

    @property
    def value(self) -> str:
        """The attribute of a note that holds its value."""
        return self.attributes.get("value", "")

    def inner(self, *names: str) -> "list[Element]":
        """The elements of some names in it, at any depth of those of interest."""
        nested = [each for one in self.within for each in (one, *one.inner(*names))]
        return [each for each in nested if each.local in names]

    def with_attributes(self, text: bytes, **values: str | int) -> Edit:
        """An edit of its tag that changes attributes."""

        def changed(match: re.Match[bytes]) -> bytes:
            name = match[2].decode().rpartition(":")[2]
            value = quoteattr(str(values[name])).encode() if name in values else None
            return match[0] if value is None else match[1] + match[2] + match[3] + value

        return self.start, self.tag, ATTRIBUTE.sub(changed, text[self.start : self.tag])


def as_utf8(text: bytes) -> bytes:
    """A text in UTF-8, of one in UTF-8 or UTF-16."""
    if text[:2] not in (b"\xff\xfe", b"\xfe\xff"):
        return text
    return re.sub(r"""encoding=["'][^"']*["']""", 'encoding="UTF-8"', text.decode("utf-16"), count=1).encode()


def elements(text: bytes, names: Collection[str]) -> Element:
    """The root of an XML text, with those elements in it that have some local names."""
    root = Element("", {}, 0, 0, len(text))
    nested, depth = [root], []

    def start(name: str, attributes: dict[str, str]) -> None:
        chosen = name.rpartition(":")[2] in names
        depth.append(chosen)
        if chosen:
            at = parser.CurrentByteIndex
            match = TAG.match(text, at)
            element = Element(name, attributes, at, match.end() if match else at)
            nested[-1].within.append(element)
            nested.append(element)

    def end(name: str) -> None:
        if depth.pop():
            element = nested.pop()
            closed = text[element.tag - 2 : element.tag] == b"/>"
            element.end = element.tag if closed else text.index(b">", parser.CurrentByteIndex) + 1

    parser = expat.ParserCreate()
    parser.StartElementHandler, parser.EndElementHandler = start, end
    parser.Parse(text, True)
    return root


def edited(text: bytes, edits: Sequence[Edit], start: int = 0, end: int | None = None) -> bytes:
    """A part of a text with edits in it, none of which lies in another."""
    parts, at = [], start
    for first, last, new in sorted(edits):
        parts += [text[at:first], new]
        at = last
    return b"".join([*parts, text[at:end]])
