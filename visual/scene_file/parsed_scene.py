"""Parsed scenes: Mitsuba's nodes of a checked file, and the description that is read from them."""

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visual.backend.mitsuba import mi
from visual.lights.kind import RGB, Light

WEIGHT = "weight"
"""Name of a property of sensors that Mitsuba lacks: the sensor's share of the look."""


@dataclass(frozen=True)
class CheckedScene:
    """A scene file that passed `visual.scene_file.check.check_scene`.

    Attributes:
        path: of the file.
        state: Mitsuba's parsed scene, with resolved references and absolute file names.
        plate: number of the height field among the nodes of `state`.
        defaults: values that the file itself gives its `$parameters`, by name.
    """

    path: Path
    state: Any
    plate: int
    defaults: Mapping[str, str]


@dataclass(frozen=True)
class Camera:
    """A sensor.

    Attributes:
        kind: Mitsuba's name of the sensor.
        id: name in the file; may be empty.
        to_world: (4, 4).
        rows, cols: pixels of the picture.
        samples: a pixel.
        weight: share of the look, relative to those of the other sensors.
        filter: Mitsuba's name of the film's reconstruction filter.
        filter_radius: of this filter, pixels; half a pixel is a box, whatever its name.
        sample_border: whether samples beyond the picture count in its outermost pixels.
        clips: distances of the near and the far clip plane, in units of `to_world` from its origin.
    """

    kind: str
    id: str
    to_world: NDArray[np.float64]
    rows: int
    cols: int
    samples: int
    weight: float
    filter: str
    filter_radius: float
    sample_border: bool
    clips: tuple[float, float] = (1e-2, 1e4)


@dataclass(frozen=True)
class ParsedPlate:
    """The height field.

    Attributes:
        filename: height map.
        size_mm: side of the plate.
        relief_mm: height of white above black in a picture whose header has none; None if unknown.
        material: Mitsuba's names of the nested materials, from the outside in.
        textures: Mitsuba's names of the textures by which the material varies over the plate.
        hard_edged: whether one of these textures jumps, as a checkerboard does.
        mirror: whether a part of the material is smooth as a mirror.
        blended: whether the material holds a blend of materials.
    """

    filename: Path | None
    size_mm: float
    relief_mm: float | None
    material: tuple[str, ...]
    textures: tuple[str, ...] = ()
    hard_edged: bool = False
    mirror: bool = False
    blended: bool = False


@dataclass(frozen=True)
class Description:
    """Content of a scene file, as far as rendering depends on the content.

    Attributes:
        plate: the height field.
        lights: all emitters in the file's order, ambient ones too.
        cameras: all sensors in the file's order.
        ambient: sum of the constant radiance from all around, red, green and blue.
        shapes: number of shapes, the plate included.
        grey: whether no material and no light has colour.
        integrator: Mitsuba's name of the integrator; None if the file has none.
        max_depth: longest path of light; None if paths have no limit.
        spectral: whether a material or a light has one of `visual.backend.variants.SPECTRA`.
    """

    plate: ParsedPlate
    lights: tuple[Light, ...]
    cameras: tuple[Camera, ...]
    ambient: RGB
    shapes: int
    grey: bool
    integrator: str | None
    max_depth: int | None
    spectral: bool = False

    @property
    def plate_alone(self) -> bool:
        """Whether the scene holds no shape but the plate and those that shine."""
        shining = {light.shape.node for light in self.lights if light.shape is not None}
        return self.shapes == 1 + len(shining)


class ParsedNodes:
    """The nodes of a parsed scene, whose references are resolved, by their numbers."""

    def __init__(self, nodes: Any) -> None:
        self.nodes = nodes

    def type_of(self, index: int) -> str:
        """Mitsuba's kind of object, such as "Shape"."""
        return str(self.nodes[index].type.name)

    def plugin(self, index: int) -> str:
        """Name of the plugin, such as "sphere"."""
        return str(self.nodes[index].props.plugin_name())

    def of_type(self, name: str) -> list[int]:
        """Numbers of the nodes of a kind of object."""
        return [index for index in range(len(self.nodes)) if self.type_of(index) == name]

    def children(self, index: int, *types: str) -> list[int]:
        """Numbers of the nodes that a node refers to, in the file's order; those of some kinds, or all."""
        values = (self.nodes[index].props[key] for key in self.nodes[index].props)
        references = (one.index() for one in values if isinstance(one, mi.Properties.ResolvedReference))
        return [child for child in references if not types or self.type_of(child) in types]
