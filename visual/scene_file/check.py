"""Check of a scene file before anything in the file is loaded, because loading can run code.

Mitsuba prefers `plugins/<type>.so` beside a scene file or in the working directory to its own plugins, and a
scene can name any file. Hence the XML is read as text, then parsed by Mitsuba without objects. Only known
plugins and files inside the scene's folder are allowed. Objects are instantiated with Mitsuba's own folder as
the only place of plugins.
"""

import contextlib
from collections.abc import Collection, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

from numpy.typing import ArrayLike

from mitsuba_scenes import find_file
from relief import heightmap
from relief.errors import InputError
from visual.backend import heightfield, llvm
from visual.backend.messages import last_line
from visual.backend.variants import WITHOUT_LLVM
from visual.lights.quadrature import KINDS
from visual.scene_file.parsed import WEIGHT, CheckedScene, children
from visual.scene_file.text import TextCheck, file_of_scene, file_of_user, nearest

LARGEST_FILM = 8192
"""Largest side of a picture, pixels: a picture of three channels in single precision then takes 0.8 GB."""

ALLOWED: Mapping[str, Collection[str]] = {
    "Shape": {heightfield.PLUGIN, "rectangle", "disk", "sphere", "cube", "cylinder", "obj", "ply"},
    "Emitter": KINDS.keys(),
    "Sensor": {"orthographic", "perspective"},
    "BSDF": {
        *("diffuse", "plastic", "roughplastic", "principled", "conductor", "roughconductor"),
        *("dielectric", "roughdielectric", "twosided", "blendbsdf"),
    },
    "Texture": {"bitmap", "checkerboard", "srgb", "uniform", "d65", "regular", "irregular", "blackbody"},
    "Integrator": {"path", "direct", "prb", "prb_basic"},
    "Film": {"hdrfilm"},
    "ReconstructionFilter": {"box", "tent", "gaussian", "mitchell", "catmullrom", "lanczos"},
    "Sampler": {"independent", "stratified", "multijitter", "orthogonal", "ldsampler"},
    "Scene": {"scene"},
}
"""Plugins that a scene may use, by Mitsuba's kinds of object."""

PLATE_KEYS = ("filename", "size_mm", "relief_mm", "to_world")
"""Parameters of a height field in a file, beside the material."""


def check_scene(path: str | Path, defines: Mapping[str, str] | None = None) -> CheckedScene:
    """Parse a scene file without loading any of it, and check that it is harmless and holds one height field.

    Args:
        path: Mitsuba XML. Files that the scene names must lie in its folder.
        defines: values of the file's `$parameters`, as of Mitsuba's `-D`. They come from the user, so that a
            value may name any file.

    Raises:
        InputError: what is wrong, in one line that names the file.
    """
    path, defines = find_file(path, ".xml"), dict(defines or {})
    text = TextCheck(path.resolve().parent)
    text.read(path, ())
    for key in defines:
        if key not in text.parameters:
            raise InputError(
                f"{path}: -D {key}: the scene has no such parameter{nearest(key, text.parameters)}"
            )
    mi = _mitsuba()
    state = _parse(mi, path, defines)
    for node in state.nodes:
        _check_node(mi, node, f"{path}: {_element(node)}", path.resolve().parent, set(defines.values()))
    kinds = [node.type.name for node in state.nodes]
    for kind in ("Sensor", "Emitter"):
        if kind not in kinds:
            raise InputError(f"{path}: has no {kind.lower()}")
    plates = [i for i, node in enumerate(state.nodes) if node.props.plugin_name() == heightfield.PLUGIN]
    if len(plates) != 1:
        raise InputError(f'{path}: has {len(plates)} shapes of type "{heightfield.PLUGIN}"; one is needed')
    _check_plate(state.nodes[plates[0]].props, f"{path}: {heightfield.PLUGIN}")
    return CheckedScene(path, state, plates[0])


def instantiate(
    checked: CheckedScene, heights: ArrayLike | None = None, *, lights: Collection[int] | None = None
) -> Any:
    """Load a scene in the variant that is set.

    From here on Mitsuba looks for plugins in its own folder alone.

    Args:
        checked: the scene.
        heights: (rows, cols) mm, instead of those of the plate's file.
        lights: numbers `Light.node` of the emitters to keep; None keeps all.

    Returns:
        The `mi.Scene`.

    Raises:
        InputError: heights that cannot be, or what Mitsuba refuses.
    """
    mi = _mitsuba()
    heightfield.register()
    state = mi.parser.ParserState(checked.state)
    plate = state.nodes[checked.plate].props
    if heights is None:
        relief_mm = float(plate["relief_mm"]) if "relief_mm" in plate else None
        samples = heightmap.load_height_map(plate["filename"], default_relief_mm=relief_mm).heights
    else:
        samples = heightmap.check_heights(heights, f"{checked.path}: heights")
    for key in ("filename", "relief_mm"):
        if key in plate:
            del plate[key]
    plate["heights"] = mi.TensorXf(samples.astype("float32"))
    if lights is not None:
        _drop_lights(mi, state, keep=lights)
    for node in state.nodes:
        if node.type == mi.ObjectType.Sensor and WEIGHT in node.props:
            del node.props[WEIGHT]
        for key in node.props:
            # Reading marks a property as used; Mitsuba names those that none of its objects uses.
            node.props.mark_queried(key, False)
    _trust_only(mi)
    config = _config(mi)
    try:
        return mi.parser.instantiate(config, state)
    except RuntimeError as error:
        raise InputError(f"{checked.path}: {last_line(error)}") from error


def _mitsuba() -> ModuleType:
    """Mitsuba with a variant set: parsing needs one, no matter which."""
    with contextlib.suppress(llvm.LLVMMissing):
        llvm.prepare()
    # Only after libLLVM has been chosen: importing Mitsuba loads it.
    import mitsuba

    if mitsuba.variant() is None:
        mitsuba.set_variant(WITHOUT_LLVM)
    module: ModuleType = mitsuba
    return module


def _config(mi: ModuleType) -> Any:
    config = mi.parser.ParserConfig(mi.variant())
    # Plugins in Python hold the interpreter's lock, and merging would make the plate a plain mesh.
    config.parallel = config.merge_meshes = config.merge_equivalent = False
    return config


def _parse(mi: ModuleType, path: Path, defines: Mapping[str, str]) -> Any:
    config = _config(mi)
    _trust_only(mi, path.resolve().parent)
    try:
        state = mi.parser.parse_file(config, str(path.resolve()), **defines)
        mi.parser.transform_upgrade(config, state)
        mi.parser.transform_resolve(config, state)
    except (RuntimeError, TypeError) as error:
        raise InputError(f"{path}: {last_line(error)}") from error
    finally:
        _trust_only(mi)
    return state


def _trust_only(mi: ModuleType, *folders: Path) -> None:
    """Let Mitsuba look for files and plugins in these folders and its own, and nowhere else."""
    resolver = mi.file_resolver()
    resolver.clear()
    for folder in (*folders, Path(str(mi.__file__)).parent):
        resolver.append(str(folder))


def _element(node: Any) -> str:
    name = node.props.id()
    return (
        f"{node.props.plugin_name()} {name}"
        if name and not name.startswith("_")
        else node.props.plugin_name()
    )


def _check_node(mi: ModuleType, node: Any, where: str, folder: Path, users_own: Collection[str]) -> None:
    kind, plugin, props = node.type.name, node.props.plugin_name(), node.props
    if plugin not in ALLOWED.get(kind, ()):
        known = ALLOWED.get(kind, set())
        raise InputError(f'{where}: {kind.lower()} plugin "{plugin}" is not allowed{nearest(plugin, known)}')
    for key, value in props.items():
        if isinstance(value, str) and key == "filename":
            props[key] = str(
                file_of_user(folder, value, where)
                if value in users_own
                else file_of_scene(folder, value, where)
            )
        elif isinstance(value, str) and ("/" in value or "\\" in value):
            raise InputError(f"{where}: {key}: {value!r} names a file where none belongs")
        elif kind == "Film" and key in ("width", "height") and not 1 <= int(value) <= LARGEST_FILM:
            raise InputError(f"{where}: {key}: {value} is not between 1 and {LARGEST_FILM} pixels")
        elif (
            kind == "Sensor"
            and key == WEIGHT
            and not (isinstance(value, int | float) and 0 <= value < float("inf"))
        ):
            raise InputError(f"{where}: {key}: {value} is not a number from 0 up")


def _check_plate(props: Any, where: str) -> None:
    for key, value in props.items():
        if key.startswith("_arg_") or key == "bsdf":
            continue
        if key not in PLATE_KEYS:
            raise InputError(f"{where}: {key}: no such parameter{nearest(key, PLATE_KEYS)}")
        if key in ("size_mm", "relief_mm") and not (
            isinstance(value, int | float) and 0 < value < float("inf")
        ):
            raise InputError(f"{where}: {key}: {value} is not a length above 0 mm")
    if "filename" not in props:
        raise InputError(f"{where}: filename: missing")
    heightfield.check_placement(props, where)


def _drop_lights(mi: ModuleType, state: Any, keep: Collection[int]) -> None:
    dropped = {
        index
        for index, node in enumerate(state.nodes)
        if node.type == mi.ObjectType.Emitter and index not in keep
    }
    for index, node in enumerate(state.nodes):
        if dropped.isdisjoint(children(state.nodes, index)):
            continue
        for key, value in node.props.items():
            if isinstance(value, mi.Properties.ResolvedReference) and value.index() in dropped:
                del node.props[key]
