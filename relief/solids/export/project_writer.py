"""Writer of projects: the archive of a 3MF, in which objects with texture get new meshes, and all else stays.

An object that is placed several times gets a copy for each place with a texture of its own. Negative volumes
of an object with texture are left out, since they are cut out of its mesh, and would cut off the relief on
their walls.
"""

import re
import uuid
import zipfile
from collections import Counter
from pathlib import Path
from typing import Any
from xml.dom.minidom import Document, Node, parseString

from relief.ground.errors import InputError
from relief.ground.files import damage_named, partial_file, read_limited
from relief.solids.export.project_meshes import Textured, TexturedMeshes
from relief.solids.export.threemf_writer import LEVEL
from relief.solids.files.parsed_mesh import LARGEST_FILE
from relief.solids.files.slicer_notes import NEGATIVE, PARTS, VOLUMES, Notes, Volume, part_at
from relief.solids.files.threemf_archive import model_entries, opened

MOST_TAGS = 500_000
"""Most tags of a tree, which takes a kilobyte for each; large projects have thousands besides meshes."""
BULK = re.compile(
    rb"<((?:[\w.-]+:)?(?:mesh|colorgroup|texture2dgroup|multiproperties|slicestack))(\s[^<>]*)?(?<!/)>"
)
"""The first tag of an element whose many elements no tree holds."""
STUB = re.compile(rb"<[^<>]* stub=\"(\d+)\"/>")
"""What stands for such an element in a tree, with its number."""

PREFIX = re.compile(rb"<([A-Za-z_][\w.-]*):")
DECLARED = re.compile(rb"xmlns:([\w.-]+)")
"""Prefixes of elements of a text, and those that it declares."""
ROOT = re.compile(rb"<[A-Za-z_][\w.:-]*")
"""The first tag of a text, to the end of its name."""
UNDECLARED = b"urn:undeclared"
"""Namespace of prefixes that a file does not declare; it is not written."""

Element = Any
"""An element of a tree; the types of minidom know no parents."""
Place = tuple[int, ...]
Key = tuple[str, str]


def check_project(file: Path) -> None:
    """Refuse a project that `write_project` cannot read. Raises InputError."""
    with damage_named(file, "a mesh in 3MF"), opened(read_limited(file, LARGEST_FILE), file) as archive:
        _entries(archive, file)
        _trees(archive, file, [])


def _entries(archive: zipfile.ZipFile, file: Path) -> list[tuple[zipfile.ZipInfo, bytes]]:
    """The entries of an archive with their content. Raises InputError if it is too long."""
    entries = archive.infolist()
    if sum(entry.file_size for entry in entries) > 2 * LARGEST_FILE:
        raise InputError(f"{file}: unpacks to more than {2 * LARGEST_FILE} bytes")
    return [(entry, archive.read(entry)) for entry in entries]


def write_project(out: Path, file: Path, textured: Textured) -> list[str]:
    """Write the project of a 3MF with texture on its objects.

    Args:
        out: The file, which appears whole or not at all.
        file: The project.
        textured: What it holds with texture.

    Returns:
        Lines about what could not be carried over.

    Raises:
        InputError: The file is damaged, or unpacks to more than is read.
        OSError: It cannot be written.
    """
    content = read_limited(file, LARGEST_FILE)
    with damage_named(file, "a mesh in 3MF"), opened(content, file) as archive:
        entries = _entries(archive, file)
        project = _Project(archive, file, textured)
        texts = [(entry, project.text(entry.filename) or text) for entry, text in entries]
    with partial_file(out) as partial, zipfile.ZipFile(partial, "w", compresslevel=LEVEL) as written:
        for entry, text in texts:
            info = zipfile.ZipInfo(entry.filename, entry.date_time)
            info.compress_type, info.external_attr = entry.compress_type, entry.external_attr
            written.writestr(info, text)
    return project.lines


class _Project:
    """The trees of an archive.

    Attributes:
        lines: About what could not be carried over.
    """

    def __init__(self, archive: zipfile.ZipFile, path: Path, textured: Textured) -> None:
        self._path, self._notes = path, Notes(archive, path)
        self._meshes, self._texts = TexturedMeshes(self._notes, textured), list[bytes]()
        self._trees = _trees(archive, path, self._texts)
        self._changed: set[str] = set()
        found = [(name, each) for name, tree in self._trees.items() for each in _all(tree, "object")]
        # Texts of objects in models and in notes of slicers, before any of them changes.
        self._before = {(name, each.getAttribute("id")): each for name, each in found}
        self._main = next(name for name, tree in self._trees.items() if _all(tree, "item"))
        resources = [each for tree in self._trees.values() for each in _all(tree, "resources")]
        ids = [each.getAttribute("id") for one in resources for each in _children(one)]
        self._last = max(int(number) for number in ids if number.isdecimal())
        items = _all(self._trees[self._main], "item")
        self._after: dict[Key, Element] = {}
        self._kept: set[Key] = set()
        for place, item in enumerate(items):
            self._find_kept(item, self._main, (place,))
        instances: dict[tuple[str, str], tuple[str, str]] = {}
        before, after = Counter[str](), Counter[str]()
        for place, item in enumerate(items):
            old = item.getAttribute("objectid")
            number, _ = self._rewritten(item, self._main, (place,), "")
            if number is not None:
                instances[old, str(before[old])] = number, str(after[number])
                after[number] += 1
            before[old] += 1
        self._renumber(instances)
        self.lines = []
        if lost := self._meshes.lost:
            self.lines.append(f"leaves out paint that divides triangles which carry texture now: {lost}")
        if any(name.endswith(".gcode") for name in archive.namelist()):
            self.lines.append("keeps the G-code of the project, which has no texture: slice again")

    def text(self, name: str) -> bytes:
        """The text of an entry that changes; empty for others."""
        if f"/{name}" not in self._changed:
            return b""
        text: bytes = self._trees[f"/{name}"].toxml("UTF-8")
        text = re.sub(rb' xmlns:[\w.-]+="%s"' % UNDECLARED, b"", text)
        return STUB.sub(lambda match: self._texts[int(match[1])], text)

    def _find_kept(self, reference: Element, model: str, path: Place) -> None:
        """Note the objects that some place has as they were."""
        key = _target(reference, model)
        if key not in self._before or (path not in self._meshes.changed and key in self._kept):
            return
        if path not in self._meshes.changed:
            self._kept.add(key)
        for place, child in enumerate(_all(self._before[key], "component")):
            self._find_kept(child, key[0], (*path, place))

    def _rewritten(self, reference: Element, model: str, path: Place, parent: str) -> tuple[str | None, int]:
        """Give an item or a component its object with texture.

        Returns:
            The number of the object, None if nothing is left of it, and how many triangles more it has.
        """
        key = _target(reference, model)
        if path not in self._meshes.changed:
            part = part_at(self._notes.objects.get(parent, Volume()).volumes, path[-1], key[1])
            cut = part and part.kind == NEGATIVE and path[:-1] in self._meshes.cuts
            return self._referred(reference, model, None if cut else key[1]), 0
        own = self._before[key].cloneNode(True)
        spans: list[tuple[int, int] | None] = []
        added = 0
        for mesh in _all(own, "mesh"):
            was = self._texts[int(mesh.getAttribute("stub"))]
            text, spans, added = self._meshes.text(was, path, key[1], parent)
            mesh.setAttribute("stub", str(len(self._texts)))
            self._texts.append(text)
        children = []
        for place, child in enumerate(_all(own, "component")):
            before = child.getAttribute("objectid")
            children.append((before, *self._rewritten(child, key[0], (*path, place), key[1])))
            added += children[-1][2]
        if all(span is None for span in spans) and all(number is None for _, number, _ in children):
            return self._referred(reference, model, None), added
        number = self._placed(key, own)
        note = next((name for name in (VOLUMES, PARTS) if (f"/{name}", key[1]) in self._before), None)
        if note is not None and key[0] == self._main:
            noted = self._before[f"/{note}", key[1]].cloneNode(True)
            _note(noted, spans, children, added)
            self._placed((f"/{note}", key[1]), noted, number)
        return self._referred(reference, model, number), added

    def _referred(self, reference: Element, model: str, number: str | None) -> str | None:
        """The number of the object that an item or a component has now; without one it is gone."""
        if number is None:
            reference.parentNode.removeChild(reference)
        elif number != reference.getAttribute("objectid"):
            reference.setAttribute("objectid", number)
        else:
            return number
        self._changed.add(model)
        return number

    def _placed(self, key: Key, own: Element, number: str | None = None) -> str:
        """Put an object with texture in the place of the one before, or after it if that one stays."""
        if number is None:
            taken = key in self._kept or key in self._after
            self._last += taken
            number = str(self._last) if taken else key[1]
        own.setAttribute("id", number)
        before = self._after.get(key, self._before[key])
        if number == key[1]:
            before.parentNode.replaceChild(own, before)
        else:
            before.parentNode.insertBefore(own, before.nextSibling)
            # The production extension allows each UUID once in a file.
            for each in (own, *own.getElementsByTagName("*")):
                for name, value in each.attributes.items():
                    if name.endswith(":UUID"):
                        each.setAttribute(name, str(uuid.uuid5(uuid.NAMESPACE_OID, f"{number} {value}")))
        self._after[key] = own
        self._changed.add(key[0])
        return number

    def _renumber(self, instances: dict[tuple[str, str], tuple[str, str]]) -> None:
        """Give instances on the plates of Bambu Studio the new numbers of their objects."""
        tree = self._trees.get(f"/{PARTS}")
        if tree is None or all(old == new for old, new in instances.items()):
            return
        for each in _all(tree, "model_instance"):
            noted = {one.getAttribute("key"): one for one in _all(each, "metadata")}
            one, other = noted.get("object_id"), noted.get("instance_id")
            if one and other:
                was = one.getAttribute("value"), other.getAttribute("value")
                for element, value in zip((one, other), instances.get(was, was), strict=True):
                    element.setAttribute("value", value)
        for each in _all(tree, "assemble_item"):
            was = each.getAttribute("object_id"), each.getAttribute("instance_id")
            for name, value in zip(("object_id", "instance_id"), instances.get(was, was), strict=True):
                each.setAttribute(name, value)


def _trees(archive: zipfile.ZipFile, path: Path, texts: list[bytes]) -> dict[str, Document]:
    """Models and notes of an archive by their names, as `_tree` gives them."""
    names = [entry.filename for entry in model_entries(archive, path)]
    names += [name for name in (VOLUMES, PARTS) if name in archive.NameToInfo]
    return {f"/{name}": _tree(archive.read(name), path, texts) for name in names}


def _tree(text: bytes, path: Path, texts: list[bytes]) -> Document:
    """The tree of a text, with stubs in place of meshes, whose texts are appended to a list.

    Raises InputError if it is too large.
    """
    if text[:2] in (b"\xff\xfe", b"\xfe\xff"):
        text = re.sub("encoding=[\"'][^\"']*.", "", text.decode("utf-16"), count=1).encode()
    parts, at = [], 0
    for match in BULK.finditer(text):
        end = text.find(b"</" + match[1], match.end()) if match.start() >= at else at
        if end < 0:
            break
        if end > at:
            end = text.index(b">", end) + 1
            stub = b'<%s%s stub="%d"/>' % (match[1], match[2] or b"", len(texts))
            parts += [text[at : match.start()], stub]
            texts.append(text[match.start() : end])
            at = end
    text = b"".join([*parts, text[at:]])
    if text.count(b"<") > MOST_TAGS:
        raise InputError(f"{path}: has more than {MOST_TAGS} tags besides meshes")
    # PrusaSlicer writes texts and drawings of an object with a prefix that it does not declare.
    used, known = set(PREFIX.findall(text)), set(DECLARED.findall(text))
    missing = b"".join(b' xmlns:%s="%s"' % (prefix, UNDECLARED) for prefix in sorted(used - known))
    return parseString(ROOT.sub(lambda match: match[0] + missing, text, count=1))


def _note(
    own: Element, spans: list[tuple[int, int] | None], children: list[tuple[str, str | None, int]], added: int
) -> None:
    """Change a slicer's note of an object.

    Args:
        own: The note.
        spans: Of the volumes of its mesh, in their order; None for one that is gone.
        children: Of each component: its object before and now, None if it is gone, and triangles added.
        added: How many triangles more the object has.
    """
    volumes = [each for each in _children(own) if each.hasAttribute("firstid")]
    for volume, span in zip(volumes, spans, strict=False):
        if span is None:
            own.removeChild(volume)
        else:
            volume.setAttribute("firstid", str(span[0]))
            volume.setAttribute("lastid", str(span[1] - 1))
    for place, part in enumerate(each for each in _children(own) if each.localName == "part"):
        beside = children[place : place + 1] + children
        child = next((child for child in beside if child[0] == part.getAttribute("id")), None)
        if child is None:
            continue
        if child[1] is None:
            own.removeChild(part)
            continue
        part.setAttribute("id", child[1])
        _count(part, child[2])
    _count(own, added)


def _count(own: Element, added: int) -> None:
    """Add to the number of triangles that Bambu Studio notes of an object or a part."""
    for each in _children(own):
        if each.hasAttribute("face_count"):
            each.setAttribute("face_count", str(int(each.getAttribute("face_count")) + added))


def _children(own: Element) -> list[Element]:
    return [each for each in own.childNodes if each.nodeType == Node.ELEMENT_NODE]


def _all(of: Document | Element, name: str) -> list[Element]:
    """The elements of a name, in any namespace, at any depth."""
    return list(of.getElementsByTagNameNS("*", name))


def _target(reference: Element, model: str) -> Key:
    """Model and number of the object of an item or a component."""
    paths = [value for name, value in reference.attributes.items() if name.endswith(":path")]
    return (*paths, model)[0], reference.getAttribute("objectid")
