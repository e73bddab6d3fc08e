"""Description of a checked scene, read from its parsed nodes before anything of the scene is loaded."""

import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relief.ground.errors import InputError
from relief.ground.limits import PATCH_SIDE_MM
from visual.backend.mitsuba import mi
from visual.backend.variants import SPECTRA
from visual.lights.kind import RGB, EmitterShape, Light
from visual.lights.quadrature import KINDS, kind_of
from visual.scene_file.parsed_scene import WEIGHT, Camera, CheckedScene, Description, ParsedNodes, ParsedPlate

_COLOURED = {*SPECTRA, *(name for name, kind in KINDS.items() if kind.strength is None)}
"""Plugins that count as coloured whatever their values: spectra, and lights whose strength is a picture."""
_TEXTURES = ("bitmap", "checkerboard")
"""Textures that vary over a surface; the others are colours and spectra."""
_MIRRORS = ("plastic", "conductor", "dielectric")
"""Materials with a part as smooth as a mirror."""
_METALS = ("conductor", "roughconductor")
_DEFAULT_FILM = (576, 768)
_DEFAULT_SAMPLES = 4
_DEFAULT_FILTER = "gaussian", 2.0
"""Reconstruction filter of a film that names none, and its radius in pixels."""
_FILTER_RADII: Mapping[str, Callable[[Any], float]] = {
    "box": lambda props: 0.5,
    "tent": lambda props: float(props.get("radius", 1.0)),
    "gaussian": lambda props: 4.0 * float(props.get("stddev", 0.5)),
    "mitchell": lambda props: 2.0,
    "catmullrom": lambda props: 2.0,
    "lanczos": lambda props: float(props.get("lobes", 3)),
}
"""Radii of Mitsuba's reconstruction filters, pixels."""
_DEFAULT_CUTOFF, _BRIGHT_PART = 20.0, 0.75
"""Half angle of a cone of light, degrees, and the part of it that is bright, unless the file states them."""
_DEFAULT_DEPTH = {"direct": 2, "prb": 6, "prb_basic": 6}
"""Longest path of the integrators whose default has a limit."""


def describe(checked: CheckedScene) -> Description:
    """The description of a checked scene; loads nothing of the scene."""
    nodes = checked.state.nodes
    reader = _SceneReader(nodes)
    every = (reader.light(index) for index in reader.of_type("Emitter"))
    # Mitsuba leaves out a light on no shape, too.
    lights = tuple(light for light in every if light.shape is not None or not kind_of(light).on_shape)
    if not lights:
        raise InputError(f"{checked.path}: area: no shape refers to it, and the scene has no other emitter")
    around = [light.strength for light in lights if kind_of(light).ambient and light.strength]
    integrator, max_depth = reader.integrator()
    return Description(
        plate=reader.plate(checked.plate),
        lights=lights,
        cameras=tuple(reader.camera(index) for index in reader.of_type("Sensor")),
        ambient=_triple(np.broadcast_to(np.sum(around, axis=0), 3)),
        shapes=len(reader.of_type("Shape")),
        grey=all(reader.is_grey(index) for index in range(len(nodes))),
        integrator=integrator,
        max_depth=max_depth,
        spectral=any(reader.has_spectrum(index) for index in range(len(nodes))),
    )


def check_size(path: str | Path, plate_mm: float, size_mm: float | None) -> None:
    """Compare the width of a scene's plate with that of a texture.

    Raises:
        InputError: these differ; None agrees with every plate. The message names the scene's `path`.
    """
    if size_mm is not None and not math.isclose(size_mm, plate_mm, rel_tol=1e-6):
        where = f"{path}: heightfield: size_mm"
        raise InputError(f"{where}: the scene's plate is {plate_mm} mm, the texture's {size_mm} mm")


def _triple(values: Any) -> RGB:
    red, green, blue = (float(value) for value in values)
    return red, green, blue


class _SceneReader(ParsedNodes):
    """What the nodes of a parsed scene say."""

    def to_world(self, index: int) -> NDArray[np.float64]:
        props = self.nodes[index].props
        return np.array(props["to_world"].matrix, dtype=np.float64) if "to_world" in props else np.eye(4)

    def rgb(self, index: int, key: str, default: float) -> RGB | None:
        """A colour, a grey or a constant spectrum as red, green and blue; None for any other spectrum."""
        props = self.nodes[index].props
        if key not in props:
            return default, default, default
        value = props[key]
        if isinstance(value, mi.Properties.ResolvedReference):
            texture = value.index()
            return self.rgb(texture, "color", default) if self.plugin(texture) == "srgb" else None
        if isinstance(value, int | float):
            return float(value), float(value), float(value)
        if props.type(key).name == "Spectrum":
            return _triple(list(value.values) * 3) if value.is_uniform() else None
        return _triple(value)

    def light(self, index: int) -> Light:
        kind, props = KINDS[self.plugin(index)], self.nodes[index].props
        return Light(
            kind=self.plugin(index),
            id=str(props.id()),
            node=index,
            direction=self.toward(index) if kind.directed else None,
            to_world=self.place(index),
            strength=None if kind.strength is None else self.rgb(index, kind.strength, 1.0),
            shape=self.emitter_shape(index),
            filename=Path(props["filename"]) if "filename" in props else None,
            scale=float(props.get("scale", 1.0)),
            cone=self.cone(index) if kind.cone else None,
        )

    def place(self, emitter: int) -> NDArray[np.float64]:
        """The transform of an emitter, which may have a position instead."""
        placed, props = self.to_world(emitter), self.nodes[emitter].props
        if "position" in props:
            placed[:3, 3] = np.array(props["position"], dtype=np.float64)
        return placed

    def cone(self, emitter: int) -> tuple[float, float]:
        """Half angles, degrees, of the bright and of the whole cone of an emitter."""
        props = self.nodes[emitter].props
        whole = float(props.get("cutoff_angle", _DEFAULT_CUTOFF))
        return float(props.get("beam_width", _BRIGHT_PART * whole)), whole

    def emitter_shape(self, emitter: int) -> EmitterShape | None:
        """The shape that an emitter is on; None for an emitter on its own."""
        for index in self.of_type("Shape"):
            if emitter in self.children(index):
                props = self.nodes[index].props
                placed = np.eye(4)
                if self.plugin(index) == "sphere":
                    placed[:3, :3] *= float(props.get("radius", 1.0))
                    placed[:3, 3] = np.array(props.get("center", (0.0, 0.0, 0.0)), dtype=np.float64)
                return EmitterShape(
                    kind=self.plugin(index),
                    node=index,
                    to_world=self.to_world(index) @ placed,
                    flipped=bool(props.get("flip_normals", False)),
                )
        return None

    def toward(self, index: int) -> tuple[float, float, float]:
        props = self.nodes[index].props
        shines_along = props["direction"] if "direction" in props else self.to_world(index)[:3, 2]
        toward = -np.array(shines_along, dtype=np.float64)
        return _triple(toward / np.linalg.norm(toward))

    def nested(self, index: int, name: str) -> Any:
        """Properties of the first object of a kind in a node; empty if there is none."""
        return next((self.nodes[child].props for child in self.children(index, name)), {})

    def camera(self, index: int) -> Camera:
        props, film = self.nodes[index].props, self.nested(index, "Film")
        name, radius = _DEFAULT_FILTER
        for child in self.children(index, "Film"):
            if reconstruction := self.nested(child, "ReconstructionFilter"):
                name = str(reconstruction.plugin_name())
                radius = _FILTER_RADII[name](reconstruction)
        return Camera(
            kind=self.plugin(index),
            id=str(props.id()),
            to_world=self.to_world(index),
            rows=int(film.get("height", _DEFAULT_FILM[0])),
            cols=int(film.get("width", _DEFAULT_FILM[1])),
            samples=int(self.nested(index, "Sampler").get("sample_count", _DEFAULT_SAMPLES)),
            weight=float(props.get(WEIGHT, 1.0)),
            filter=name,
            filter_radius=radius,
            sample_border=bool(film.get("sample_border", False)),
            clips=(float(props.get("near_clip", 1e-2)), float(props.get("far_clip", 1e4))),
        )

    def plate(self, index: int) -> ParsedPlate:
        props = self.nodes[index].props
        material = self.material(index)
        below = self.below(index)
        textures = [node for node in below if self.plugin(node) in _TEXTURES]
        return ParsedPlate(
            filename=Path(props["filename"]) if "filename" in props else None,
            size_mm=float(props.get("size_mm", PATCH_SIDE_MM)),
            relief_mm=float(props["relief_mm"]) if "relief_mm" in props else None,
            material=tuple(self.plugin(part) for part in material) or ("diffuse",),
            textures=tuple(sorted({self.plugin(texture) for texture in textures})),
            hard_edged=any(self.is_hard_edged(texture) for texture in textures),
            blended=any(self.plugin(node) == "blendbsdf" for node in below),
            mirror=any(self.plugin(node) in _MIRRORS for node in below),
        )

    def below(self, index: int) -> set[int]:
        """Numbers of the nodes below a node, and its own."""
        below, waiting = set[int](), [index]
        while waiting:
            if (node := waiting.pop()) not in below:
                below.add(node)
                waiting += self.children(node)
        return below

    def is_hard_edged(self, texture: int) -> bool:
        """Whether a texture jumps from place to place."""
        interpolation = self.nodes[texture].props.get("filter_type", "bilinear")
        return self.plugin(texture) == "checkerboard" or interpolation == "nearest"

    def material(self, index: int) -> list[int]:
        """Numbers of the nested materials, the first of each, from the outside in."""
        chain: list[int] = []
        while nested := self.children(index, "BSDF"):
            index = nested[0]
            chain.append(index)
        return chain

    def integrator(self) -> tuple[str | None, int | None]:
        integrators = self.of_type("Integrator")
        if not integrators:
            return None, None
        kind = self.plugin(integrators[0])
        if kind == "direct":
            return kind, _DEFAULT_DEPTH[kind]
        depth = int(self.nodes[integrators[0]].props.get("max_depth", _DEFAULT_DEPTH.get(kind, -1)))
        return kind, depth if depth >= 0 else None

    def has_spectrum(self, index: int) -> bool:
        """Whether a node is, or has as a parameter, a spectrum that takes wavelengths."""
        textures = self.children(index, "Texture")
        # The scene itself has textures that others refer to, or nobody.
        return self.type_of(index) != "Scene" and any(self.plugin(each) in SPECTRA for each in textures)

    def is_grey(self, index: int) -> bool:
        """Whether a node on its own, without the nodes it refers to, has no colour."""
        kind, props = self.plugin(index), self.nodes[index].props
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
    if "filename" not in props:
        return False
    formats = mi.Bitmap.PixelFormat
    return mi.Bitmap(props["filename"]).pixel_format() in (formats.Y, formats.YA)
