"""What a checked scene holds, read from its description before anything of it is loaded."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from visual.scene_file.check import CheckedScene

RGB = tuple[float, float, float]

AMBIENT = "constant"
PARALLEL = "directional"
ENVIRONMENT = "envmap"
AREA = "area"
WEIGHT = "weight"
"""Our own property of a sensor, which Mitsuba does not know."""

_STRENGTH = {"directional": "irradiance", "constant": "radiance", "area": "radiance", "point": "intensity"}
"""The property that says how strong an emitter is; all default to 1, an environment map's is its picture."""
_DIFFUSE = {"diffuse": "reflectance", "plastic": "diffuse_reflectance", "roughplastic": "diffuse_reflectance"}
_REFLECTANCE = 0.5
"""Mitsuba's default of the diffuse reflectances above."""
_COLOURED = ("regular", "irregular", "blackbody", "envmap")
"""Plugins taken to have colour without a look at their values."""
_METALS = ("conductor", "roughconductor")
_DEFAULT_FILM = (576, 768)
_DEFAULT_SAMPLES = 4
_DEFAULT_DEPTH = {"direct": 2, "prb": 6, "prb_basic": 6}
"""Largest path length of an integrator that is given none; the others go on without limit."""


@dataclass(frozen=True)
class EmitterShape:
    """The shape that an area light is on: its kind by Mitsuba's name and its node when parsed.

    ``to_world`` has shape (4, 4) and maps Mitsuba's unit disk, square of side 2 or unit sphere to it.
    ``flipped``: whether its normals are.
    """

    kind: str
    node: int
    to_world: NDArray[np.float64]
    flipped: bool


@dataclass(frozen=True)
class Light:
    """An emitter: its kind by Mitsuba's name, its id in the file (may be empty), its node when parsed.

    ``direction`` is the unit vector from the plate toward a directional light, None for every other kind.
    ``to_world`` has shape (4, 4). ``strength`` is its irradiance, radiance or intensity, red, green and blue,
    or None if that is a picture or a spectrum. ``shape`` is that of an area light, ``filename`` and ``scale``
    the picture of an environment map and the factor of its values.
    """

    kind: str
    id: str
    node: int
    direction: tuple[float, float, float] | None
    to_world: NDArray[np.float64]
    strength: RGB | None
    shape: EmitterShape | None = None
    filename: Path | None = None
    scale: float = 1.0


@dataclass(frozen=True)
class Camera:
    """A sensor: its kind, id, ``to_world`` of shape (4, 4), picture size in pixels and samples a pixel.

    ``weight`` is its share of the look, relative to those of the other sensors.
    """

    kind: str
    id: str
    to_world: NDArray[np.float64]
    rows: int
    cols: int
    samples: int
    weight: float


@dataclass(frozen=True)
class Plate:
    """The height field: file, side and relief in mm, and material from the outside in, by Mitsuba's names.

    ``diffuse_reflectance`` is that of a diffuse or plastic material, red, green and blue, else None.
    """

    filename: Path | None
    size_mm: float
    relief_mm: float | None
    material: tuple[str, ...]
    diffuse_reflectance: RGB | None


@dataclass(frozen=True)
class Description:
    """A scene: plate, lights in the file's order (ambient ones too), cameras, and what rendering takes.

    ``ambient`` is the sum of the constant radiance from all around. ``shapes`` counts the plate too.
    ``grey``: no material or light has colour. ``integrator`` is None if the file has none; ``max_depth`` is
    None where paths have no limit.
    """

    plate: Plate
    lights: tuple[Light, ...]
    cameras: tuple[Camera, ...]
    ambient: RGB
    shapes: int
    grey: bool
    integrator: str | None
    max_depth: int | None


def describe(checked: "CheckedScene") -> Description:
    """Plate, lights, cameras and integrator of a checked scene; loads nothing."""
    nodes = checked.state.nodes
    reader = _Reader(nodes)
    lights = tuple(reader.light(index) for index in reader.of_type("Emitter"))
    ambient = np.sum([light.strength for light in lights if light.kind == AMBIENT and light.strength], axis=0)
    integrator, max_depth = reader.integrator()
    return Description(
        plate=reader.plate(checked.plate),
        lights=lights,
        cameras=tuple(reader.camera(index) for index in reader.of_type("Sensor")),
        ambient=_triple(np.broadcast_to(ambient, 3)),
        shapes=len(reader.of_type("Shape")),
        grey=all(reader.is_grey(index) for index in range(len(nodes))),
        integrator=integrator,
        max_depth=max_depth,
    )


def children(nodes: Any, index: int) -> Iterator[int]:
    """Nodes that a node of the parsed scene refers to, in the file's order."""
    import mitsuba as mi

    props = nodes[index].props
    for key in props:
        value = props[key]
        if isinstance(value, mi.Properties.ResolvedReference):
            yield value.index()


def _triple(values: Any) -> RGB:
    red, green, blue = (float(value) for value in values)
    return red, green, blue


class _Reader:
    """The nodes of a parsed scene, whose references are resolved."""

    def __init__(self, nodes: Any) -> None:
        self.nodes = nodes

    def kind(self, index: int) -> str:
        return str(self.nodes[index].props.plugin_name())

    def of_type(self, name: str) -> list[int]:
        return [index for index, node in enumerate(self.nodes) if node.type.name == name]

    def children_of_type(self, index: int, name: str) -> list[int]:
        return [child for child in children(self.nodes, index) if self.nodes[child].type.name == name]

    def to_world(self, index: int) -> NDArray[np.float64]:
        props = self.nodes[index].props
        return np.array(props["to_world"].matrix, dtype=np.float64) if "to_world" in props else np.eye(4)

    def rgb(self, index: int, key: str, default: float) -> RGB | None:
        """A colour, a grey or a constant spectrum as red, green, blue; None for pictures and the rest."""
        import mitsuba as mi

        props = self.nodes[index].props
        if key not in props:
            return default, default, default
        value = props[key]
        if isinstance(value, mi.Properties.ResolvedReference):
            texture = value.index()
            return self.rgb(texture, "color", default) if self.kind(texture) == "srgb" else None
        if isinstance(value, int | float):
            return float(value), float(value), float(value)
        if props.type(key).name == "Spectrum":
            return _triple(list(value.values) * 3) if value.is_uniform() else None
        return _triple(value)

    def light(self, index: int) -> Light:
        kind, props = self.kind(index), self.nodes[index].props
        return Light(
            kind=kind,
            id=str(self.nodes[index].props.id()),
            node=index,
            direction=self.toward(index) if kind == PARALLEL else None,
            to_world=self.to_world(index),
            strength=self.rgb(index, _STRENGTH[kind], 1.0) if kind in _STRENGTH else None,
            shape=self.emitter_shape(index) if kind == AREA else None,
            filename=Path(props["filename"]) if kind == ENVIRONMENT and "filename" in props else None,
            scale=float(props.get("scale", 1.0)) if kind == ENVIRONMENT else 1.0,
        )

    def emitter_shape(self, emitter: int) -> EmitterShape | None:
        """The shape that an emitter is on, None for one on its own, which Mitsuba refuses."""
        for index in self.of_type("Shape"):
            if emitter in children(self.nodes, index):
                props = self.nodes[index].props
                placed = np.eye(4)
                if self.kind(index) == "sphere":
                    placed[:3, :3] *= float(props.get("radius", 1.0))
                    placed[:3, 3] = np.array(props.get("center", (0.0, 0.0, 0.0)), dtype=np.float64)
                return EmitterShape(
                    kind=self.kind(index),
                    node=index,
                    to_world=self.to_world(index) @ placed,
                    flipped=bool(props.get("flip_normals", False)),
                )
        return None

    def toward(self, index: int) -> tuple[float, float, float]:
        props = self.nodes[index].props
        shines_along = (
            np.array(props["direction"], dtype=np.float64)
            if "direction" in props
            else self.to_world(index)[:3, 2]
        )
        return _triple(-shines_along / np.linalg.norm(shines_along))

    def camera(self, index: int) -> Camera:
        films = self.children_of_type(index, "Film")
        samplers = self.children_of_type(index, "Sampler")
        rows, cols = _DEFAULT_FILM
        if films:
            props = self.nodes[films[0]].props
            rows, cols = int(props.get("height", rows)), int(props.get("width", cols))
        samples = (
            self.nodes[samplers[0]].props.get("sample_count", _DEFAULT_SAMPLES)
            if samplers
            else _DEFAULT_SAMPLES
        )
        return Camera(
            kind=self.kind(index),
            id=str(self.nodes[index].props.id()),
            to_world=self.to_world(index),
            rows=rows,
            cols=cols,
            samples=int(samples),
            weight=float(self.nodes[index].props.get(WEIGHT, 1.0)),
        )

    def plate(self, index: int) -> Plate:
        from relief.limits import PATCH_SIDE_MM

        props = self.nodes[index].props
        material = self.material(index)
        innermost = self.kind(material[-1]) if material else "diffuse"
        reflectance = (_REFLECTANCE,) * 3 if not material else None
        if material and innermost in _DIFFUSE:
            reflectance = self.rgb(material[-1], _DIFFUSE[innermost], _REFLECTANCE)
        return Plate(
            filename=Path(props["filename"]) if "filename" in props else None,
            size_mm=float(props.get("size_mm", PATCH_SIDE_MM)),
            relief_mm=float(props["relief_mm"]) if "relief_mm" in props else None,
            material=tuple(self.kind(part) for part in material) or ("diffuse",),
            diffuse_reflectance=reflectance,
        )

    def material(self, index: int) -> list[int]:
        """The chain of first nested materials, from the outside in."""
        chain: list[int] = []
        while nested := self.children_of_type(index, "BSDF"):
            index = nested[0]
            chain.append(index)
        return chain

    def integrator(self) -> tuple[str | None, int | None]:
        found = self.of_type("Integrator")
        if not found:
            return None, None
        kind = self.kind(found[0])
        if kind == "direct":
            return kind, _DEFAULT_DEPTH[kind]
        depth = int(self.nodes[found[0]].props.get("max_depth", _DEFAULT_DEPTH.get(kind, -1)))
        return kind, depth if depth >= 0 else None

    def is_grey(self, index: int) -> bool:
        """Whether this node on its own, without those it refers to, has no colour."""

        kind, props = self.kind(index), self.nodes[index].props
        if kind in _COLOURED:
            return False
        if kind == "bitmap":
            return _is_grey_picture(props)
        if kind in _METALS and props.get("material", "none" if "eta" in props else "Cu") != "none":
            return False
        for key, value in props.items():
            if props.type(key).name == "Spectrum" and not value.is_uniform():
                return False
            if props.type(key).name == "Color":
                red, green, blue = _triple(value)
                if not (math.isclose(red, green) and math.isclose(green, blue)):
                    return False
        return True


def _is_grey_picture(props: Any) -> bool:
    import mitsuba as mi

    if "filename" not in props:
        return False
    formats = mi.Bitmap.PixelFormat
    return mi.Bitmap(props["filename"]).pixel_format() in (formats.Y, formats.YA)
