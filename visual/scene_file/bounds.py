"""Bounds: kind and range of every parameter of every plugin that a scene may use, in one table.

Mitsuba takes any number: a picture then holds NaN or nothing, and a filter of huge width ends the process.
"""

import math
import re
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from relief.ground.limits import LARGEST_PLATE_MM, LARGEST_RELIEF_MM, SMALLEST_PLATE_MM, SMALLEST_RELIEF_MM
from visual.backend import heightfield
from visual.lights.kind import LightKind
from visual.lights.quadrature import KINDS
from visual.scene_file.parsed_scene import WEIGHT

LARGEST_FILM = 8192
"""Largest side of a picture, pixels: a picture of three channels in single precision then takes 0.8 GB."""
MOST_SAMPLES = 65536
"""Largest number of samples a pixel, as of `retouch render --samples`."""
FARTHEST = 1e6
"""Largest coordinate and scale, mm: a plate of 10 mm then still has 16 steps of single precision."""
BRIGHTEST = 1e6
"""Largest radiance and irradiance: a million times white, short of single precision by 32 decades."""
BRIGHTEST_POINT = 1e12
"""Largest intensity of a point: `BRIGHTEST` in a distance of 1000 mm."""
LONGEST_SHOWN = 60
"""Most characters of a bad value in a message."""

_WAVES = 1.0, 1e6
"""Least and greatest wavelength of a spectrum, nm: from soft X-rays to far infrared."""

Range = tuple[float, float]
"""Least and greatest value, both allowed."""


@dataclass(frozen=True)
class Kind:
    """Values that a parameter may have.

    Attributes:
        words: end of the sentence "the value is not ...".
        holds: whether a property's value is of this kind.
        values: range of each value of a colour, which is that of a nested texture, too; None for the rest.
    """

    words: str
    holds: Callable[[Any], bool]
    values: Range | None = None


def _within(values: Iterable[float], low: float, high: float) -> bool:
    return all(low <= value <= high for value in values)  # NaN is not.


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _number(low: float, high: float) -> Kind:
    words = f"a number from {low:g} to {high:g}"
    return Kind(words, lambda value: _is_number(value) and low <= value <= high)


def _whole(low: int, high: int) -> Kind:
    words = f"a whole number from {low} to {high}"
    return Kind(words, lambda value: _is_number(value) and low <= value <= high and value == int(value))


def _choice(*names: str) -> Kind:
    words = f"one of {', '.join(names)}"
    # A colour does not compare with a text, it raises.
    return Kind(words, lambda value: isinstance(value, str) and value in names)


def _text(pattern: str, words: str) -> Kind:
    return Kind(words, lambda value: isinstance(value, str) and re.fullmatch(pattern, value) is not None)


def colour(low: float, high: float) -> Kind:
    """A number, a colour, a spectrum or a texture whose values are in a range."""

    def holds(value: Any) -> bool:
        if _is_number(value):
            return low <= value <= high
        if hasattr(value, "is_uniform"):
            waves = [float(wave) for wave in value.wavelengths]
            return _within(value.values, low, high) and _within(waves, *_WAVES)
        return _is_triple(value) and _within(value, low, high)

    return Kind(f"a colour with values from {low:g} to {high:g}", holds, (low, high))


def numbers(low: float, high: float) -> Kind:
    """A text of numbers in a range, as Mitsuba writes the values of a spectrum."""

    def holds(value: Any) -> bool:
        with suppress(AttributeError, ValueError):
            return _within(map(float, value.replace(",", " ").split()), low, high)
        return False

    return Kind(f"a list of numbers from {low:g} to {high:g}", holds)


def _is_triple(value: Any) -> bool:
    return not isinstance(value, str) and hasattr(value, "__len__") and len(value) == 3


def _is_direction(value: Any) -> bool:
    return _is_triple(value) and 1.0 / FARTHEST <= math.hypot(*value) <= FARTHEST


def _is_placement(value: Any) -> bool:
    """Whether a transform is finite, affine and far from singular in single precision."""
    # Colours and vectors answer to `matrix`, too, with something else.
    if not hasattr(value, "matrix"):
        return False
    matrix: NDArray[np.float64] = np.array(value.matrix, dtype=np.float64)
    if matrix.ndim != 2 or not (np.abs(matrix) <= FARTHEST).all() or list(matrix[-1]) != [0.0, 0.0, 0.0, 1.0]:
        return False
    scales = np.linalg.svd(matrix[:-1, :-1], compute_uv=False)
    return bool(scales[-1] >= max(1.0 / FARTHEST, scales[0] / FARTHEST))


FLAG = Kind("true or false", lambda value: isinstance(value, bool))
NEVER = Kind("false; light behind the plate is always shown", lambda value: value is False)
FILE = Kind("the name of a file", lambda value: isinstance(value, str))
POINT = Kind(f"a point within {FARTHEST:g} mm", lambda v: _is_triple(v) and _within(v, -FARTHEST, FARTHEST))
DIRECTION = Kind(f"a direction of length {1.0 / FARTHEST:g} to {FARTHEST:g}", _is_direction)
_SCALES = f"scales from {1.0 / FARTHEST:g} on that are within {FARTHEST:g} times each other"
PLACEMENT = Kind(f"an invertible affine transform of numbers up to {FARTHEST:g} and {_SCALES}", _is_placement)
SHARE = _number(0.0, 1.0)
REFLECTANCE = colour(0.0, 1.0)
RADIANCE = colour(0.0, BRIGHTEST)
METAL = colour(0.0, 100.0)
"""Refraction and extinction of metals; tabulated ones stay below 20."""
_REFRACTION = _number(1.0, 5.0)
IOR = Kind(f"{_REFRACTION.words}, nor a name", lambda v: isinstance(v, str) or _REFRACTION.holds(v))
"""Refraction of a dielectric, or Mitsuba's name of one; germanium has 4."""
LENGTH = _number(1.0 / FARTHEST, FARTHEST)
CHANCE = _number(1e-6, 1e6)
"""Weight of random choices; 0 would leave a light out of pictures without a word."""
WAVELENGTH = _number(100.0, 10_000.0)

ANY_VALUE = (0.0, BRIGHTEST_POINT)
"""Range of the values of a texture that no parameter bounds further."""
_VALUE = colour(*ANY_VALUE)

OF_TEXTURE = {
    "srgb": ("color",),
    "uniform": ("value",),
    "d65": ("color", "scale"),
    "regular": ("value", "values"),
    "irregular": ("value", "values"),
    "checkerboard": ("color0", "color1"),
}
"""Parameters of textures whose range is that of the parameter which the texture is the value of."""


def _each(names: str, kind: Kind) -> dict[str, Kind]:
    """Parameters of one kind, by their names."""
    return dict.fromkeys(names.split(), kind)


_SHAPE = {"to_world": PLACEMENT, "flip_normals": FLAG, "silhouette_sampling_weight": CHANCE}
_MESH = {**_SHAPE, "filename": FILE, "face_normals": FLAG, "flip_tex_coords": FLAG}
_CONE = {"cutoff_angle": _number(0.1, 90.0), "beam_width": _number(0.0, 90.0)}
_PICTURE = {"filename": FILE, "scale": _number(0.0, BRIGHTEST), "mis_compensation": FLAG}
_SENSOR = {
    **_each("near_clip far_clip focus_distance", LENGTH),
    **_each(f"shutter_open shutter_close {WEIGHT}", _number(0.0, FARTHEST)),
    "to_world": PLACEMENT,
}
_IORS = _each("int_ior ext_ior", IOR)
_PLASTIC = {**_IORS, **_each("diffuse_reflectance specular_reflectance", REFLECTANCE), "nonlinear": FLAG}
_MICROFACETS = {
    **_each("alpha alpha_u alpha_v", REFLECTANCE),
    **{"sample_visible": FLAG, "distribution": _choice("beckmann", "ggx")},
}
_GLASS = {**_IORS, **_each("specular_reflectance specular_transmittance", REFLECTANCE)}
_CONDUCTOR = {
    **_each("eta k", METAL),
    **{"material": _text(r"[\w-]+", "a name"), "specular_reflectance": REFLECTANCE},
}
_SPECTRUM = _each("wavelength_min wavelength_max", WAVELENGTH)
_INTEGRATOR = {
    **{"max_depth": _whole(-1, 1024), "rr_depth": _whole(1, 1024), "hide_emitters": NEVER},
    **{"samples_per_pass": _whole(1, MOST_SAMPLES), "block_size": _whole(0, 1024)},
    "timeout": _number(-1.0, 1e6),
}
_SAMPLER = {"sample_count": _whole(1, MOST_SAMPLES), "seed": _whole(0, 2**32 - 1)}
_JITTERED = {**_SAMPLER, "jitter": FLAG}

PARAMETERS: Mapping[str, Mapping[str, Mapping[str, Kind]]] = {
    "Shape": {
        heightfield.PLUGIN: {
            **{"filename": FILE, "size_mm": _number(SMALLEST_PLATE_MM, LARGEST_PLATE_MM)},
            **{"relief_mm": _number(SMALLEST_RELIEF_MM, LARGEST_RELIEF_MM), "to_world": PLACEMENT},
        },
        **{"rectangle": _SHAPE, "disk": _SHAPE, "cube": _SHAPE, "obj": _MESH, "ply": _MESH},
        "sphere": {**_SHAPE, "center": POINT, "radius": LENGTH},
        "cylinder": {**_SHAPE, "p0": POINT, "p1": POINT, "radius": LENGTH},
    },
    "Sensor": {
        "orthographic": _SENSOR,
        "perspective": {
            **_SENSOR,
            **{"fov": _number(0.01, 179.0), "fov_axis": _choice("x", "y", "diagonal", "smaller", "larger")},
            "focal_length": _text(r"[1-9]\d{0,3}(\.\d{1,6})?(mm)?", "a length from 1mm to 9999mm"),
            **_each("principal_point_offset_x principal_point_offset_y", _number(-10.0, 10.0)),
        },
    },
    "BSDF": {
        "diffuse": {"reflectance": REFLECTANCE},
        "plastic": _PLASTIC,
        "roughplastic": {**_PLASTIC, **_MICROFACETS},
        "principled": {
            **_each("base_color roughness anisotropic metallic spec_trans spec_tint", REFLECTANCE),
            **_each("sheen sheen_tint flatness clearcoat clearcoat_gloss", REFLECTANCE),
            **_each("diffuse_reflectance_sampling_rate main_specular_sampling_rate", CHANCE),
            **{"clearcoat_sampling_rate": CHANCE, "specular": SHARE, "eta": _REFRACTION},
        },
        "conductor": _CONDUCTOR,
        "roughconductor": {**_CONDUCTOR, **_MICROFACETS},
        "dielectric": _GLASS,
        "roughdielectric": {**_GLASS, **_MICROFACETS},
        "twosided": {"allow_transmission": FLAG},
        "blendbsdf": {"weight": REFLECTANCE},
    },
    "Texture": {
        "bitmap": {
            **{"filename": FILE, "raw": FLAG, "accel": FLAG, "to_uv": PLACEMENT},
            "filter_type": _choice("bilinear", "nearest"),
            "wrap_mode": _choice("repeat", "mirror", "clamp"),
            "format": _choice("variant", "fp16", "auto"),
        },
        "checkerboard": {"color0": _VALUE, "color1": _VALUE, "to_uv": PLACEMENT},
        "srgb": {"color": _VALUE, "unbounded": FLAG},
        "uniform": {**_SPECTRUM, "value": _VALUE},
        "d65": {"color": _VALUE, "scale": _VALUE},
        "regular": {**_SPECTRUM, "value": _VALUE, "values": numbers(*ANY_VALUE)},
        "irregular": {"value": _VALUE, "values": numbers(*ANY_VALUE), "wavelengths": numbers(*_WAVES)},
        "blackbody": {**_SPECTRUM, "temperature": _number(1.0, 20_000.0)},
    },
    "Integrator": {
        "path": _INTEGRATOR,
        "direct": {**_INTEGRATOR, **_each("shading_samples emitter_samples bsdf_samples", _whole(0, 1024))},
        "prb": _INTEGRATOR,
        "prb_basic": _INTEGRATOR,
    },
    "Film": {
        "hdrfilm": {
            **_each("width height", _whole(1, LARGEST_FILM)),
            **_each("sample_border compensate banner", FLAG),
            "file_format": _choice("openexr", "exr", "rgbe", "pfm"),
            # Not xyz, whose luminance is no weighted sum of red, green and blue.
            "pixel_format": _choice("luminance", "luminance_alpha", "rgb", "rgba"),
            "component_format": _choice("float16", "float32", "uint32"),
        },
    },
    # Narrower filters leave pixels without a sample, which are then black.
    "ReconstructionFilter": {
        **{"box": {}, "catmullrom": {}, "tent": {"radius": _number(0.5, 8.0)}},
        "gaussian": {"stddev": _number(0.2, 8.0)},
        "mitchell": {"B": SHARE, "C": SHARE},
        "lanczos": {"lobes": _whole(1, 8)},
    },
    "Sampler": {
        **{"independent": _SAMPLER, "stratified": _JITTERED, "multijitter": _JITTERED},
        "orthogonal": {**_JITTERED, "strength": _whole(2, 16)},
        "ldsampler": _SAMPLER,
    },
    "Scene": {"scene": {}},
}
"""Parameters of the plugins that a scene may use, beside nested objects, by Mitsuba's kinds of object."""


UNTAKEN = {
    r"hdrfilm\.crop_.*": "crops are not taken: a picture has all pixels of its film; leave it out",
    r"heightfield\.scale": "is not taken; relief_mm or, of a --texture, height_scale says how high white is",
    r".*\.(srf|texture)|scene\.(kd|compact|allow|embree)_.*": "Mitsuba has it, Retouch does not take it",
}
"""Why a scene may not have some parameters that Mitsuba has: patterns of plugin and parameter."""


def untaken(plugin: str, parameter: str) -> str | None:
    """Why a parameter of Mitsuba's is not taken, and what then; None for one that Mitsuba lacks, too."""
    name = f"{plugin}.{parameter}"
    return next((why for pattern, why in UNTAKEN.items() if re.fullmatch(pattern, name)), None)


def plugins(kind: str) -> Mapping[str, Mapping[str, Kind]]:
    """Parameters of the plugins of a kind of object; those of lights follow from the table of lights."""
    if kind != "Emitter":
        return PARAMETERS.get(kind, {})
    return {name: _of_kind(light) for name, light in KINDS.items()}


def _of_kind(light: LightKind) -> Mapping[str, Kind]:
    """Parameters of lights of one kind."""
    strength = _PICTURE if light.strength is None else {light.strength: _strength(light)}
    placed = {
        **({} if light.on_shape else {"to_world": PLACEMENT}),
        **({"direction": DIRECTION} if light.directed else {}),
        **(_CONE if light.cone else {"position": POINT} if light.strength == "intensity" else {}),
    }
    return {"sampling_weight": CHANCE, **strength, **placed}


def _strength(light: LightKind) -> Kind:
    return RADIANCE if light.strength in ("radiance", "irradiance") else colour(*ANY_VALUE)


def refusal(value: Any, kind: Kind) -> str:
    """Why a property's value is not of a kind, in one short line."""
    waves = [float(wave) for wave in getattr(value, "wavelengths", ())]
    if kind.values and not _within(waves, *_WAVES):
        return f"{_shown(waves)} are not wavelengths from {_WAVES[0]:g} to {_WAVES[1]:g} nm"
    return f"{_shown(value)} is not {kind.words}"


def _shown(value: Any) -> str:
    """A property's value for a message: one short line."""
    value = list(value.values) if hasattr(value, "values") else value
    # Colours and vectors answer to `matrix`, too, with something else.
    rows = [value] if _is_triple(value) or isinstance(value, list) else getattr(value, "matrix", None)
    line = " ".join(str(value).split())
    if rows is not None:
        line = "; ".join(", ".join(f"{float(number):g}" for number in row) for row in rows)
    return line if len(line) <= LONGEST_SHOWN else f"{line[:LONGEST_SHOWN]}..."
