"""What slicers note in a 3MF beside its models: kinds of volumes, names, extruders and colours of filaments.

PrusaSlicer and SuperSlicer divide the mesh of an object into volumes by ranges of its triangles; Bambu Studio
and OrcaSlicer name a part for each component of an object. Cura has settings in the objects themselves.
"""

import io
import json
import re
import zipfile
from contextlib import suppress
from dataclasses import dataclass, field, replace
from itertools import zip_longest
from pathlib import Path
from typing import IO
from xml.parsers import expat

import numpy as np

from relief.ground.arrays import FloatArray
from relief.ground.errors import InputError
from relief.ground.lengths import shown
from relief.solids.files.parsed_mesh import check_count

CHUNK, LONGEST_TAG = 1 << 18, 1 << 20
"""Bytes of XML that are parsed at a time, and most bytes of a tag, which the parser holds as a whole."""
LARGEST_NOTES, MOST_VOLUMES = 1 << 25, 100_000
"""Most bytes of a file in which slicers keep settings, and most volumes; large projects have a tenth."""
VOLUMES, PARTS = "Metadata/Slic3r_PE_model.config", "Metadata/model_settings.config"
"""Files with the volumes of objects, and with their parts."""
NEGATIVE = "negative volumes"
"""The kind of a volume that is cut out of the others of its object."""
KINDS = {
    **dict.fromkeys(("NegativeVolume", "negative_part"), NEGATIVE),
    **dict.fromkeys(("ParameterModifier", "modifier_part", "1", "infill_mesh", "cutting_mesh"), "modifiers"),
    **dict.fromkeys(("SupportBlocker", "support_blocker", "anti_overhang_mesh"), "support blockers"),
    **dict.fromkeys(("SupportEnforcer", "support_enforcer"), "support enforcers"),
    **{"support_mesh": "supports", "SeamPosition": "seam positions"},
}
"""Kinds of volumes that are no part of the body, by the names of all slicers."""
COLOUR = re.compile(r"#([0-9a-fA-F]{6})(?:[0-9a-fA-F]{2})?")
"""A colour of a 3MF or of a filament."""
PAINT = re.compile(r"[048]|[0-9A-F]C")
"""The paint of an undivided triangle: PrusaSlicer's TriangleSelector writes a state up to 2 in the upper bits
of a digit, and a greater one, less 3, in a digit of its own."""


@dataclass
class Volume:
    """A volume of an object, or the object itself.

    Attributes:
        number: That the slicer's file has for it.
        kind: A value of `KINDS`; empty for a part of the body.
        name: As the slicer shows it; empty without.
        extruder: From 1; 0 is that of the object, or the first.
        span: Number of its first triangle in the object's mesh, and the number after the last; None: all.
        volumes: Of an object.
    """

    number: str = ""
    kind: str = ""
    name: str = ""
    extruder: int = 0
    span: tuple[int, int] | None = None
    volumes: "list[Volume]" = field(default_factory=list)


def parse(file: IO[bytes], parser: expat.XMLParserType, path: Path) -> None:
    """Parse a hostile XML file chunk by chunk. Raises InputError for a document type or an endless tag."""

    def refuse_doctype(*declaration: object) -> None:
        # Entities could name other files or grow without bound; the specification forbids them.
        raise InputError(f"{path}: declares a document type (DOCTYPE), which a 3MF file must not have")

    parser.StartDoctypeDeclHandler = refuse_doctype
    length = 0
    while chunk := file.read(CHUNK):
        parser.Parse(chunk, False)
        length += len(chunk)
        if length - parser.CurrentByteIndex > LONGEST_TAG:
            raise InputError(f"{path}: has a tag of more than {LONGEST_TAG} bytes")
    parser.Parse(b"", True)


def rgb_of(text: str) -> tuple[int, int, int]:
    """Red, green and blue, 0 to 255, of a colour such as #ff8000; white if the text is none."""
    match = COLOUR.fullmatch(text.strip())
    red, green, blue = bytes.fromhex(match[1] if match else "ffffff")
    return red, green, blue


def paint_state(text: str) -> int:
    """State of a triangle's paint: an extruder, 0 for none, and -1 if the paint divides the triangle."""
    if not PAINT.fullmatch(text):
        return -1 if text else 0
    return int(text, 16) >> 2 if len(text) == 1 else int(text[0], 16) + 3


def part_at(parts: list[Volume], place: int, number: str) -> Volume | None:
    """The part of a component, by its place and the number of its object, which several parts may share."""
    same = [part for part in parts[place : place + 1] + parts if part.number == number]
    return same[0] if same else None


class Notes:
    """The notes of a slicer.

    Attributes:
        objects: By their numbers in the main model.
        filaments: (k, 3) red, green and blue of the extruders' filaments, in sRGB from 0 to 1.
    """

    def __init__(self, archive: zipfile.ZipFile, path: Path) -> None:
        self.objects: dict[str, Volume] = {}
        self._archive, self._path, self._count = archive, path, 0
        for name in (VOLUMES, PARTS):
            self._read_objects(self._text(name))
        rgb = np.array([rgb_of(colour) for colour in self._filaments()], np.float32)
        self.filaments: FloatArray = rgb.reshape(-1, 3) / 255

    def volumes_of(self, number: str, above: str, place: int, triangles: int) -> list[Volume]:
        """The volumes of an object's mesh. Raises InputError if they are not all of its triangles.

        Args:
            number: Of the object.
            above: Number of the object that it is a component of; empty for an item.
            place: Which component of that it is, from 0.
            triangles: How many the mesh has.
        """
        own, parent = self.objects.get(number, Volume()), self.objects.get(above, Volume())
        spans = [volume.span for volume in own.volumes if volume.span]
        if spans:
            if [0, *(end for _, end in spans)] != [*(start for start, _ in spans), triangles]:
                fault = f"the volumes of object {shown(number)!r} are not all of its triangles"
                raise InputError(f"{self._path}: {VOLUMES}: {fault}; save the project again")
            return [self._whole(volume, own) for volume in own.volumes if volume.span]
        part = part_at(parent.volumes, place, number)
        if part is None and len(own.volumes) == 1:
            part, parent = own.volumes[0], own
        return [own if part is None else self._whole(part, parent)]

    def _whole(self, volume: Volume, above: Volume) -> Volume:
        """A volume with name and extruder of its object, where it has none."""
        name, extruder = volume.name or above.name, volume.extruder or above.extruder
        return replace(volume, name=name, extruder=extruder)

    def _text(self, name: str) -> bytes:
        """The content of a file of the archive; empty if there is none."""
        if name not in self._archive.NameToInfo:
            return b""
        if self._archive.getinfo(name).file_size > LARGEST_NOTES:
            raise InputError(f"{self._path}: {name}: unpacks to more than {LARGEST_NOTES} bytes")
        return self._archive.read(name)

    def _filaments(self) -> list[str]:
        """Colours of the filaments of all extruders, as the slicer wrote them."""
        settings = self._text("Metadata/project_settings.config") or b"{}"
        # A mesh is sound without colours.
        with suppress(ValueError, RecursionError):
            bambu = json.loads(settings)
            colours = bambu.get("filament_colour") if isinstance(bambu, dict) else None
            if isinstance(colours, list):
                return [str(colour) for colour in colours]
        text = self._text("Metadata/Slic3r_PE.config").decode(errors="replace").replace('"', "")
        lines = dict(re.findall(r"^; (extruder_colour|filament_colour) = (.*)$", text, re.MULTILINE))
        both = [lines.get(f"{whose}_colour", "").split(";") for whose in ("extruder", "filament")]
        # The extruder's own colour, where it has one, comes before that of its filament.
        colours = [own or filament for own, filament in zip_longest(*both, fillvalue="")]
        return colours if any(colours) else []

    def _read_objects(self, text: bytes) -> None:
        if not text:
            return
        nested: list[Volume] = []

        def start(name: str, attributes: dict[str, str]) -> None:
            if name in ("object", "volume", "part"):
                self._count += 1
                check_count(self._count, "volumes", self._path, MOST_VOLUMES)
                volume = Volume(attributes.get("id", ""), KINDS.get(attributes.get("subtype", ""), ""))
                if "firstid" in attributes:
                    volume.span = int(attributes["firstid"]), int(attributes["lastid"]) + 1
                if name == "object":
                    self.objects[volume.number] = volume
                elif nested:
                    nested[0].volumes.append(volume)
                nested.append(volume)
            elif name == "metadata" and nested:
                key, value = attributes.get("key"), attributes.get("value", "")
                if key == "name":
                    nested[-1].name = value
                elif key == "extruder":
                    nested[-1].extruder = int(value) if value.isdecimal() else 0
                elif key == "volume_type" or (key == "modifier" and value == "1"):
                    nested[-1].kind = KINDS.get(value, "")

        def end(name: str) -> None:
            if name in ("object", "volume", "part"):
                nested.pop()

        parser = expat.ParserCreate()
        parser.StartElementHandler, parser.EndElementHandler = start, end
        parse(io.BytesIO(text), parser, self._path)
