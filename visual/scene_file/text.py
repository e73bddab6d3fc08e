"""Scene files as text: the files that Mitsuba's parser would open, and the files that a scene may name."""

import difflib
import logging
import os
import re
import xml.etree.ElementTree as ElementTree
from collections.abc import Collection, Mapping
from pathlib import Path

from mitsuba_scenes import FOLDER
from relief.ground.errors import InputError
from visual.backend.messages import last_line

_log = logging.getLogger(__name__)

LARGEST_FILE = 1_000_000
"""Largest scene file, bytes: over a hundred times the bundled scenes."""
DEEPEST = 32
"""Largest depth of nested elements; the bundled scenes have four levels."""
MOST_INCLUDES = 32
"""Largest number of includes of a scene; a file counts each time, so that no scene doubles without end."""
LONGEST_NAME = 200
"""Most characters of an attribute other than a value, such as a name, which a message may repeat."""
MOST_ELEMENTS = 10_000
"""Largest number of elements of a scene; the bundled scenes have up to 70."""
LARGEST_EXPANDED = 10_000_000
"""Largest text of a scene whose `$parameters` are replaced, characters: defaults can double in a chain."""


class TextCheck:
    """Check of a scene file and of the files it includes, as text.

    Attributes:
        folder: in which all named files must lie.
        parameters: names of the `$parameters` so far.
        defaults: values that the file itself gives them.
        includes: number of includes so far.
        elements: number of elements so far.
        longest: characters of the longest value of a parameter so far.
        expanded: characters of all attributes so far, at most, once their parameters are replaced.
    """

    def __init__(self, folder: Path, defines: Mapping[str, str]) -> None:
        self.folder = folder
        self.parameters: set[str] = set()
        self.defaults: dict[str, str] = {}
        self.includes = self.elements = self.expanded = 0
        self.longest = max(map(len, defines.values()), default=0)

    def read(self, path: Path, including: tuple[Path, ...]) -> None:
        """Check a file and what it includes.

        Args:
            path: of the file.
            including: the files whose includes lead to this one.

        Raises:
            InputError: what is wrong, in one line that names the file.
        """
        if path.resolve() in including:
            raise InputError(f"{path}: <include>: the file includes itself")
        if path.stat().st_size > LARGEST_FILE:
            raise InputError(f"{path}: larger than {LARGEST_FILE} bytes; not read as a scene")
        data = path.read_bytes()
        if b"<!DOCTYPE" in data or b"<!ENTITY" in data:
            raise InputError(f"{path}: DOCTYPE: document types and entities are not allowed in a scene")
        elements = _Elements(path, self)
        # With a fixed encoding the parser cannot be led to see other elements than Mitsuba does.
        parser = ElementTree.XMLParser(target=elements, encoding="utf-8")
        try:
            parser.feed(data)
            parser.close()
        except ElementTree.ParseError as error:
            raise InputError(f"{path}: not well-formed XML: {last_line(error)}") from error
        for tag, name in elements.files:
            if "$" in name:
                raise InputError(f"{path}: <{tag}>: filename: a $parameter is not allowed here")
            file = file_of_scene(self.folder, name, f"{path}: <{tag}>")
            if tag == "include":
                self.includes += 1
                if self.includes > MOST_INCLUDES:
                    raise InputError(f"{path}: <include>: more than {MOST_INCLUDES} files are included")
                self.read(file, (*including, path.resolve()))


class _Elements:
    """Target of an XML parser: collects parameters and the files that parsing itself would open."""

    def __init__(self, path: Path, scene: TextCheck) -> None:
        self.path, self.scene = path, scene
        self.depth = 0
        self.files: list[tuple[str, str]] = []

    def start(self, tag: str, attributes: Mapping[str, str]) -> None:
        scene, where = self.scene, f"{self.path}: <{tag}>"
        self.depth += 1
        scene.elements += 1
        if self.depth > DEEPEST:
            raise InputError(f"{where}: nested more than {DEEPEST} levels deep")
        if tag == "path":
            raise InputError(f"{where}: search paths are not allowed; copy the files beside the scene")
        if scene.elements > MOST_ELEMENTS:
            raise InputError(f"{where}: more than {MOST_ELEMENTS} elements")
        if tag == "default" and "name" in attributes:
            scene.parameters.add(attributes["name"])
            scene.defaults.setdefault(attributes["name"], attributes.get("value", ""))
        for name, value in attributes.items():
            scene.parameters.update(re.findall(r"\$\{?(\w+)", value))
            if name not in ("value", "filename") and len(value) > LONGEST_NAME:
                raise InputError(f"{where}: {name}: longer than {LONGEST_NAME} characters")
            if "\\$" in value:
                raise InputError(f"{where}: {name}: \\$ is not allowed in a scene")
            length = len(value) + value.count("$") * scene.longest
            scene.expanded += length
            if scene.expanded > LARGEST_EXPANDED:
                raise InputError(f"{where}: {name}: longer than {LARGEST_EXPANDED} characters")
            if tag == "default":
                scene.longest = max(scene.longest, length)
            if name == "filename":
                self.files.append((tag, value))

    def end(self, _: str) -> None:
        self.depth -= 1

    def close(self) -> None:
        pass


def file_of_scene(folder: Path, name: str, where: str) -> Path:
    """The file that a scene names.

    Args:
        folder: of the scene; the file must exist in there, links followed.
        name: as the scene writes it.
        where: start of the error message.

    Raises:
        InputError: a file outside the folder, or none.
    """
    written = Path(name)
    try:
        file = (folder / written).resolve()
        is_file = file.is_file()
    except (OSError, RuntimeError, ValueError) as error:
        raise InputError(f"{where}: filename: {name[:LONGEST_NAME]!r}: {last_line(error)}") from error
    if written.is_absolute() or ".." in written.parts or "\\" in name or not file.is_relative_to(folder):
        raise InputError(f"{where}: filename: {name!r} is not inside the scene's folder")
    if not is_file and (FOLDER / written).is_file():
        # A copy of a bundled scene names textures that lie beside the original.
        _log.warning("%s: filename: %r is not beside the scene; the bundled file is taken", where, name)
        return FOLDER / written
    if not is_file:
        raise InputError(f"{where}: filename: {name!r}: no such file")
    return file


def file_of_user(folder: Path, name: str, where: str) -> Path:
    """The file that a user names for a scene: beside the scene or else in the working directory.

    Args:
        folder: of the scene.
        name: as the user writes it.
        where: start of the error message.

    Raises:
        InputError: there is no such file.
    """
    for file in (folder / name, Path(name)):
        if os.path.isfile(file):
            return file.resolve()
    raise InputError(f"{where}: filename: {name!r}: no such file")


def nearest(word: str, words: Collection[str]) -> str:
    """The end of a message about an unknown word: the known word most like it, or else all of them."""
    if alike := difflib.get_close_matches(word, sorted(words), n=1):
        return f"; the nearest is {alike[0]}"
    return f"; known: {', '.join(sorted(words))}" if words else ""
