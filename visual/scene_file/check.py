"""Check of a scene file before anything in the file is loaded, because loading can run code.

Mitsuba prefers `plugins/<type>.so` beside a scene file or in the working directory to its own plugins, and a
scene can name any file. Hence the XML is read as text, then parsed by Mitsuba without objects. Only known
plugins and files inside the scene's folder are allowed. Objects are instantiated with Mitsuba's own folder as
the only place of plugins.
"""

from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from mitsuba_scenes import find_file
from relief import heightmap
from relief.ground.errors import InputError
from relief.plate_grid import NO_HALO, Halo
from visual.backend import heightfield
from visual.backend.messages import last_line
from visual.backend.mitsuba import mi
from visual.backend.variants import WITHOUT_LLVM
from visual.scene_file.nodes import NodeCheck
from visual.scene_file.parsed_scene import WEIGHT, CheckedScene
from visual.scene_file.text import TextCheck, nearest

FAULTS = (RuntimeError, TypeError, ValueError, OverflowError, IndexError)
"""Errors by which Mitsuba and its bindings refuse a scene; text that is no UTF-8 gives a ValueError."""


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
    text = TextCheck(path.resolve().parent, defines)
    text.read(path, ())
    for key in defines:
        if key not in text.parameters:
            fault = f"the scene has no such parameter{nearest(key, text.parameters)}"
            raise InputError(f"{path}: defines: {key}: {fault}", f"{path}: -D {key}: {fault}")
    _require_variant()
    state = _parse(path, defines)
    NodeCheck(path, state.nodes, set(defines.values())).check()
    kinds = {node.type.name for node in state.nodes}
    for kind in ("Sensor", "Emitter"):
        if kind not in kinds:
            raise InputError(f"{path}: has no {kind.lower()}")
    plates = [i for i, node in enumerate(state.nodes) if node.props.plugin_name() == heightfield.PLUGIN]
    if len(plates) != 1:
        raise InputError(f'{path}: has {len(plates)} shapes of type "{heightfield.PLUGIN}"; one is needed')
    heightfield.check_placement(state.nodes[plates[0]].props, f"{path}: {heightfield.PLUGIN}")
    return CheckedScene(path, state, plates[0], text.defaults)


def instantiate(
    checked: CheckedScene,
    heights: ArrayLike | None = None,
    *,
    lights: Collection[int] | None = None,
    halo: Halo = NO_HALO,
) -> Any:
    """Load a scene in the variant that is set.

    From here on Mitsuba looks for plugins in its own folder alone.

    Args:
        checked: the scene.
        heights: (rows, cols) mm, instead of those of the plate's file.
        lights: numbers `Light.node` of the emitters to keep, which are named by `light_id`; None keeps all,
            by their own names.
        halo: samples of the neighbours around a tile.

    Returns:
        The `mi.Scene`.

    Raises:
        InputError: heights that cannot be, or what Mitsuba refuses.
    """
    _require_variant()
    heightfield.register()
    state = mi.parser.ParserState(checked.state)
    plate = state.nodes[checked.plate].props
    if heights is not None:
        samples = heightmap.check_heights(heights, f"{checked.path}: heights")
        plate["heights"] = mi.TensorXf(samples.astype("float32"))
        for key in {"filename", "relief_mm"} & set(plate):
            del plate[key]
    plate["halo_rows"], plate["halo_cols"] = halo
    if lights is not None:
        _drop_lights(state, keep=lights)
        for light in lights:
            state.nodes[light].props.set_id(light_id(light))
    for node in state.nodes:
        if node.type == mi.ObjectType.Sensor and WEIGHT in node.props:
            del node.props[WEIGHT]
        for key in node.props:
            # Reading marks a property as used; Mitsuba names those that none of its objects uses.
            node.props.mark_queried(key, False)
    _trust_only()
    config = _config()
    try:
        return mi.parser.instantiate(config, state)
    except FAULTS as error:
        raise InputError(f"{checked.path}: {last_line(error)}") from error


def light_id(node: int) -> str:
    """Name in a loaded scene of the light of this number: in the file, names may be missing or hold dots."""
    return f"light-{node}"


def _require_variant() -> None:
    """Set a variant if none is: parsing needs one, no matter which."""
    if mi.variant() is None:
        mi.set_variant(WITHOUT_LLVM)


def _config() -> Any:
    config = mi.parser.ParserConfig(str(mi.variant()))
    # Plugins in Python hold the interpreter's lock, and merging would make the plate a plain mesh.
    config.parallel = config.merge_meshes = config.merge_equivalent = False
    return config


def _parse(path: Path, defines: Mapping[str, str]) -> Any:
    config = _config()
    _trust_only(path.resolve().parent)
    try:
        state = mi.parser.parse_file(config, str(path.resolve()), **defines)
        mi.parser.transform_upgrade(config, state)
        mi.parser.transform_resolve(config, state)
    except FAULTS as error:
        raise InputError(f"{path}: {last_line(error)}") from error
    finally:
        _trust_only()
    return state


def _trust_only(*folders: Path) -> None:
    """Let Mitsuba look for files and plugins in these folders and its own, and nowhere else."""
    file_resolver: Any = mi.file_resolver
    resolver = file_resolver()
    resolver.clear()
    for folder in (*folders, Path(str(mi.__file__)).parent):
        resolver.append(str(folder))


def _drop_lights(state: Any, keep: Collection[int]) -> None:
    emitters = {i for i, node in enumerate(state.nodes) if node.type == mi.ObjectType.Emitter}
    for node in state.nodes:
        for key, value in node.props.items():
            if isinstance(value, mi.Properties.ResolvedReference) and value.index() in emitters - set(keep):
                del node.props[key]
