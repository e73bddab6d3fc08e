"""Nodes of a parsed scene: plugins, parameters, files and nesting, checked before any object is made."""

import math
from collections import Counter
from collections.abc import Collection
from pathlib import Path
from typing import Any, NoReturn

import numpy as np

from relief.ground.errors import InputError
from visual.backend.bitmap import SMALLEST_MAP, read_bitmap
from visual.backend.mitsuba import mi
from visual.backend.ply_check import check_ply
from visual.lights.quadrature import KINDS
from visual.scene_file import bounds
from visual.scene_file.parsed_scene import ParsedNodes
from visual.scene_file.text import file_of_scene, file_of_user, nearest

MOST_OBJECTS = {"Emitter": 64, "Sensor": 64, "Shape": 256, "BSDF": 256, "Texture": 256}
"""Largest numbers of objects: each light is rendered for each camera, and loading slows with every shape."""
MOST_PARTS = 32
"""Largest number of parts of an object's material, each counted as often as it is reached. The time to
compile a material doubles with each blend of a material with itself, and so does it inside `twosided`."""
MOST_PIXELS = bounds.LARGEST_FILM**2
"""Largest number of pixels of all pictures together; four batches in double precision then take 2 GB."""

NESTED = {
    "Scene": {*MOST_OBJECTS, "Integrator", "Film", "Sampler", "ReconstructionFilter"},
    "Shape": {"BSDF", "Emitter"},
    "Sensor": {"Film", "Sampler"},
    "Film": {"ReconstructionFilter"},
    "BSDF": {"BSDF"},
}
"""Kinds of object that an object of a kind may hold by any name; a texture is the value of a parameter."""
_DEFAULT_FILM = {"width": 768, "height": 576}


class NodeCheck(ParsedNodes):
    """Check of all nodes of a parsed scene.

    Attributes:
        path: of the scene.
        nodes: as Mitsuba parsed them; the check makes their file names absolute.
        users_own: texts from the user, which may name any file.
    """

    def __init__(self, path: Path, nodes: Any, users_own: Collection[str]) -> None:
        super().__init__(nodes)
        self.path, self.users_own = path, users_own
        self._seen: set[tuple[Path, str, bounds.Range | None]] = set()
        self._files: dict[int, Path] = {}
        self._shining = set[int]()

    def check(self) -> None:
        """Check every node.

        Raises:
            InputError: the first fault, in one line that names file, object and parameter.
        """
        count = Counter(self.type_of(index) for index in range(len(self.nodes)))
        for kind, most in MOST_OBJECTS.items():
            if count[kind] > most:
                raise InputError(
                    f"{self.path}: {count[kind]} objects of kind {kind.lower()}; the most is {most}"
                )
        for index in range(len(self.nodes)):
            kind, plugin = self.type_of(index), self.plugin(index)
            allowed = bounds.plugins(kind)
            if plugin not in allowed:
                self._refuse(
                    index, f'{kind.lower()} plugin "{plugin}" is not allowed{nearest(plugin, allowed)}'
                )
            if kind != "Scene":
                self._count_parts(index)
        for index in range(len(self.nodes)):
            # A texture is checked where it is used: its range is that of the parameter.
            if self.type_of(index) != "Texture":
                self._check_node(index, None)
        self._count_pixels()

    def _where(self, index: int) -> str:
        name = self.nodes[index].props.id()
        named = f" {name}" if name and not name.startswith("_") else ""
        return f"{self.path}: {self.plugin(index)}{named}"

    def _refuse(self, index: int, reason: str) -> NoReturn:
        raise InputError(f"{self._where(index)}: {reason}")

    def _count_parts(self, index: int) -> None:
        reached, parts = [(index, 1)], 0
        while reached:
            part, times = reached.pop()
            parts += times
            if parts > MOST_PARTS:
                self._refuse(index, f"more than {MOST_PARTS} nested materials and textures")
            sides = 2 if self.plugin(part) == "twosided" else 1
            reached += [(child, times * sides) for child in self.children(part, "BSDF", "Texture")]

    def _check_node(self, index: int, of_value: bounds.Range | None) -> None:
        """Check one node, and the textures in it.

        Args:
            index: of the node.
            of_value: of a texture, the range of the parameter whose value it is.
        """
        plugin, props = self.plugin(index), self.nodes[index].props
        parameters = bounds.plugins(self.type_of(index))[plugin]
        if "filename" in parameters and "filename" not in props:
            self._refuse(index, "filename: missing")
        for key, value in props.items():
            is_object = isinstance(value, mi.Properties.ResolvedReference)
            if is_object and (plugin == "scene" or self.type_of(value.index()) != "Texture"):
                self._check_nesting(index, value.index())
                continue
            if key not in parameters:
                unknown = f"no such parameter{nearest(key, parameters)}"
                self._refuse(index, f"{key}: {bounds.untaken(plugin, key) or unknown}")
            kind = parameters[key]
            if of_value and key in bounds.OF_TEXTURE.get(plugin, ()):
                kind = (bounds.numbers if key == "values" else bounds.colour)(*of_value)
            if is_object and kind.values:
                self._check_node(value.index(), kind.values)
            elif is_object or not kind.holds(value):
                said = f"a texture is not {kind.words}" if is_object else bounds.refusal(value, kind)
                self._refuse(index, f"{key}: {said}")
            elif kind is bounds.FILE:
                props[key] = str(self._file(index, value, of_value))

    def _check_nesting(self, index: int, child: int) -> None:
        outer, inner = self.type_of(index), self.type_of(child)
        on_shape = inner == "Emitter" and KINDS[self.plugin(child)].on_shape
        # A light on a shape may stand in the scene, where shapes refer to it.
        if inner not in NESTED.get(outer, ()) or (inner, outer, on_shape) == ("Emitter", "Shape", False):
            where = "the scene" if outer == "Scene" else f"a {outer.lower()}"
            self._refuse(child, f"{inner.lower()} {self.plugin(child)} does not belong in {where}")
        if child in self._shining:
            self._refuse(child, "more than one shape refers to it; each takes an emitter of its own")
        if on_shape and outer == "Shape":
            self._shining.add(child)
        if inner == "Texture":
            self._check_node(child, None)

    def _file(self, index: int, name: str, of_value: bounds.Range | None) -> Path:
        """The file that a node names, after a look into a picture or mesh."""
        plugin, where, folder = self.plugin(index), self._where(index), self.path.resolve().parent
        if index not in self._files:
            # Once for each node: where it is used a second time, its path is absolute already.
            find = file_of_user if name in self.users_own else file_of_scene
            self._files[index] = find(folder, name, where)
        file = self._files[index]
        if (file, plugin, of_value) in self._seen:
            return file
        self._seen.add((file, plugin, of_value))
        if plugin == "bitmap" or plugin in KINDS:
            smallest = SMALLEST_MAP if plugin in KINDS else (1, 1)
            values = np.asarray(read_bitmap(file, f"{file}: {plugin}", smallest))
            (low, high), floats = of_value or bounds.ANY_VALUE, values.dtype.kind == "f"
            least, most = float(values.min()), float(values.max())
            if floats and not low <= least <= most <= high:
                said = f"values from {least:g} to {most:g} are outside [{low:g}, {high:g}]"
                raise InputError(f"{file}: {plugin}: {said}")
        elif plugin == "ply":
            check_ply(file)
        return file

    def _count_pixels(self) -> None:
        """Refuse more pixels than memory holds; each light that is not ambient has a picture of its own."""
        lights = sum(not KINDS[self.plugin(index)].ambient for index in self.of_type("Emitter"))
        films = [child for sensor in self.of_type("Sensor") for child in self.children(sensor, "Film")]
        pixels = max(1, lights) * sum(
            math.prod(int(self.nodes[film].props.get(*side)) for side in _DEFAULT_FILM.items())
            for film in films
        )
        if pixels > MOST_PIXELS:
            raise InputError(f"{self.path}: film: {pixels} pixels in all pictures; the most is {MOST_PIXELS}")
