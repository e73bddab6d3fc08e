"""Writer of projects: the archive of a 3MF, in which objects with texture get new meshes, and all else stays.

An object that is placed several times gets a copy for each place with a texture of its own. Negative volumes
of an object with texture are left out, since they are cut out of its mesh, and would cut off the relief on
their walls.
"""

import re
import uuid
import zipfile
from collections import Counter, defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from relief.ground.errors import InputError
from relief.ground.files import damage_named, partial_file, read_limited
from relief.solids.export.package_text import Edit, Element, as_utf8, edited, elements
from relief.solids.export.project_meshes import Textured, TexturedMeshes
from relief.solids.export.threemf_writer import LEVEL
from relief.solids.files.parsed_mesh import LARGEST_FILE
from relief.solids.files.slicer_notes import NEGATIVE, PARTS, VOLUMES, Notes, Volume, part_at
from relief.solids.files.threemf_archive import model_entries, opened

OF_MODELS = ("object", "mesh", "component", "item", "basematerials", "colorgroup", "texture2d")
OF_NOTES = ("object", "volume", "part", "metadata", "mesh_stat", "model_instance", "assemble_item")
"""Elements of models and of slicers' notes that may change, or whose numbers are taken."""
UUID = re.compile(rb"""(\s[\w.-]+:UUID\s*=\s*)(["'])([^"']*)\2""")
"""The UUID of an object or a component, in a tag."""

Place = tuple[int, ...]
Key = tuple[str, str]


class _Child(NamedTuple):
    """A component: its object before and now, None if it is gone, and how many triangles more it has."""

    before: str
    number: str | None
    added: int


class _Version(NamedTuple):
    """An object as one place has it.

    Attributes:
        number: Of the object.
        edits: Of its text.
        spans: Of the volumes of its mesh; None for one that is gone.
        children: Its components.
        added: How many triangles more it has.
    """

    number: str
    edits: list[Edit]
    spans: list[tuple[int, int] | None]
    children: list[_Child]
    added: int


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
        entries = archive.infolist()
        if sum(entry.file_size for entry in entries) > 2 * LARGEST_FILE:
            raise InputError(f"{file}: unpacks to more than {2 * LARGEST_FILE} bytes")
        project = _Project(archive, file, textured)
        texts = [project.texts.get(entry.filename) or archive.read(entry) for entry in entries]
    with partial_file(out) as partial, zipfile.ZipFile(partial, "w", compresslevel=LEVEL) as written:
        for entry, text in zip(entries, texts, strict=True):
            info = zipfile.ZipInfo(entry.filename, entry.date_time)
            info.compress_type, info.external_attr = entry.compress_type, entry.external_attr
            written.writestr(info, text)
    return project.lines


class _Project:
    """The texts of an archive that change.

    Attributes:
        texts: By the names of their entries.
        lines: About what could not be carried over.
    """

    def __init__(self, archive: zipfile.ZipFile, path: Path, textured: Textured) -> None:
        self._notes = Notes(archive, path)
        self._meshes = TexturedMeshes(self._notes, textured)
        self._models = {
            f"/{entry.filename}": as_utf8(archive.read(entry)) for entry in model_entries(archive, path)
        }
        roots = {name: elements(text, OF_MODELS) for name, text in self._models.items()}
        self._objects = {
            (name, each.attributes.get("id", "")): each
            for name in roots
            for each in roots[name].inner("object")
        }
        self._main, self._items = next(
            (name, items) for name, root in roots.items() if (items := root.inner("item"))
        )
        numbers = [each.attributes.get("id", "") for root in roots.values() for each in root.within]
        self._last = max((int(number) for number in numbers if number.isdigit()), default=0)
        self._kept: set[Key] = set()
        self._versions: dict[Key, list[_Version]] = defaultdict(list)
        for place, item in enumerate(self._items):
            self._find_kept(item, self._main, (place,))
        edits: dict[str, list[Edit]] = defaultdict(list)
        self._moved: dict[tuple[str, str], tuple[str, int]] = {}
        before, after = Counter[str](), Counter[str]()
        for place, item in enumerate(self._items):
            number, _ = self._rewritten(item, self._main, (place,), "")
            edits[self._main].append(_reference(item, self._models[self._main], number))
            old = item.attributes["objectid"]
            if number is not None:
                self._moved[old, str(before[old])] = number, after[number]
                after[number] += 1
            before[old] += 1
        for key, versions in self._versions.items():
            edits[key[0]].append(self._object_text(key, versions))
        self.texts = {name[1:]: edited(self._models[name], edits[name]) for name in edits}
        for name in (VOLUMES, PARTS):
            if name in archive.NameToInfo:
                self.texts[name] = self._notes_text(as_utf8(archive.read(name)))
        self.lines = []
        if self._meshes.lost:
            self.lines.append(
                f"leaves out paint that divides triangles which carry texture now: {self._meshes.lost}"
            )
        if any(name.endswith(".gcode") for name in archive.namelist()):
            self.lines.append("keeps the G-code of the project, which has no texture: slice again")

    def _find_kept(self, reference: Element, model: str, path: Place) -> None:
        """Note the objects that some place has as they were."""
        key = _target(reference, model)
        if key not in self._objects or (path not in self._meshes.changed and key in self._kept):
            return
        if path not in self._meshes.changed:
            self._kept.add(key)
        for k, child in enumerate(self._objects[key].inner("component")):
            self._find_kept(child, key[0], (*path, k))

    def _rewritten(self, reference: Element, model: str, path: Place, parent: str) -> tuple[str | None, int]:
        """The object that an item or a component has now, None for none, and how many triangles more."""
        key = _target(reference, model)
        if path not in self._meshes.changed:
            part = part_at(self._notes.objects.get(parent, Volume()).volumes, path[-1], key[1])
            cut = part and part.kind == NEGATIVE and path[:-1] in self._meshes.cuts
            return None if cut else key[1], 0
        own, text = self._objects[key], self._models[key[0]]
        edits: list[Edit] = []
        spans: list[tuple[int, int] | None] = []
        children: list[_Child] = []
        added = 0
        for mesh in own.inner("mesh"):
            new, spans, added = self._meshes.text(text, mesh, path, key[1], parent)
            edits.append((mesh.start, mesh.end, new))
        for k, child in enumerate(own.inner("component")):
            number, more = self._rewritten(child, key[0], (*path, k), key[1])
            children.append(_Child(child.attributes["objectid"], number, more))
            edits.append(_reference(child, text, number))
            added += more
        if all(span is None for span in spans) and all(child.number is None for child in children):
            return None, added
        versions = self._versions[key]
        number = key[1]
        if versions or key in self._kept:
            self._last += 1
            number = str(self._last)
        versions.append(_Version(number, edits, spans, children, added))
        return number, added

    def _object_text(self, key: Key, versions: Sequence[_Version]) -> Edit:
        """All versions of an object, one after the other."""
        own, text = self._objects[key], self._models[key[0]]
        texts = [text[own.start : own.end]] if key in self._kept else []
        for version in versions:
            edits = [own.with_attributes(text, id=version.number), *version.edits]
            new = edited(text, edits, own.start, own.end)
            texts.append(new if version.number == key[1] else _with_new_uuids(new, version.number))
        return own.start, own.end, b"".join(texts)

    def _notes_text(self, text: bytes) -> bytes:
        """The notes of a slicer by the new numbers of objects, instances, volumes and triangles."""
        root = elements(text, OF_NOTES)
        edits: list[Edit] = []
        for own in root.within:
            key = self._main, own.attributes.get("id", "")
            if own.local == "object" and (versions := self._versions.get(key)):
                texts = [text[own.start : own.end]] if key in self._kept else []
                texts += [edited(text, _noted(own, text, each), own.start, own.end) for each in versions]
                edits.append((own.start, own.end, b"".join(texts)))
        for instance in root.inner("model_instance"):
            noted = {each.attributes.get("key"): each for each in instance.within}
            one, other = noted.get("object_id"), noted.get("instance_id")
            if one and other and (new := self._moved.get((one.value, other.value))):
                edits.append(one.with_attributes(text, value=new[0]))
                edits.append(other.with_attributes(text, value=new[1]))
        for item in root.inner("assemble_item"):
            was = item.attributes.get("object_id", ""), item.attributes.get("instance_id", "")
            if new := self._moved.get(was):
                edits.append(item.with_attributes(text, object_id=new[0], instance_id=new[1]))
        return edited(text, edits)


def _noted(own: Element, text: bytes, version: _Version) -> list[Edit]:
    """Edits of a slicer's note of an object."""
    edits = [own.with_attributes(text, id=version.number)]
    spans, places = iter(version.spans), iter(range(len(own.within)))
    for each in own.within:
        added, gone = version.added, False
        if "firstid" in each.attributes:
            span = next(spans, None)
            gone = span is None
            if span is not None:
                edits.append(each.with_attributes(text, firstid=span[0], lastid=span[1] - 1))
        elif each.local == "part":
            place, number = next(places), each.attributes.get("id", "")
            beside = version.children[place : place + 1] + version.children
            child = next((child for child in beside if child.before == number), None)
            if child is not None:
                added, gone = child.added, child.number is None
                edits += [] if gone else [each.with_attributes(text, id=str(child.number))]
        if gone:
            edits.append((each.start, each.end, b""))
            continue
        for one in (each, *each.within):
            if "face_count" in one.attributes:
                count = int(one.attributes["face_count"]) + added
                edits.append(one.with_attributes(text, face_count=count))
    return edits


def _with_new_uuids(text: bytes, number: str) -> bytes:
    """The text of a copy of an object: the production extension allows each UUID once in a file."""

    def new(match: re.Match[bytes]) -> bytes:
        name = f"{number} {match[3].decode()}"
        return match[1] + match[2] + str(uuid.uuid5(uuid.NAMESPACE_OID, name)).encode() + match[2]

    return UUID.sub(new, text)


def _target(reference: Element, model: str) -> Key:
    """Model and number of the object of an item or a component."""
    paths = [value for name, value in reference.attributes.items() if name.endswith(":path")]
    return (*paths, model)[0], reference.attributes.get("objectid", "")


def _reference(reference: Element, text: bytes, number: str | None) -> Edit:
    """An item or a component that has another object; None: it is gone."""
    if number is None:
        return reference.start, reference.end, b""
    return reference.with_attributes(text, objectid=number)
