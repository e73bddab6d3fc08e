"""Fitting of a scene to a height map: parameters of the scene file that follow the size and the samples.

A scene whose file declares the parameter `size_mm` fits plates of any size. Its film has a pixel at least for
each sample across (`resolution`), and rows in proportion to the plate's (`film_rows`), if the file declares
these parameters too. What a user defines stays.
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Unpack

from numpy.typing import ArrayLike

from relief.ground.errors import InputError
from relief.ground.lengths import Lengths
from relief.relief import Relief, as_relief
from relief.surface import Repeats
from visual.scene_file.check import check_scene
from visual.scene_file.describe import check_size, describe
from visual.scene_file.parsed_scene import CheckedScene

SIZE, RESOLUTION, FILM_ROWS = "size_mm", "resolution", "film_rows"
"""Names of the parameters."""
MOST_PIXELS = 1024
"""Most pixels across a film that follows the samples: steps of a descent take no more on a square film."""


def fitted_scene(
    path: str | Path,
    defines: Mapping[str, str] | None = None,
    relief: Relief | ArrayLike | None = None,
    size_mm: float | None = None,
) -> tuple[CheckedScene, Relief]:
    """Check a scene that fits a relief.

    Args:
        path: of the scene file.
        defines: values of its `$parameters`.
        relief: on the plate, or its heights (rows, cols) in mm; None: the scene's own.
        size_mm: width of an array; None: that of the scene's plate. A `Relief` has its own.

    Returns:
        The scene, and the relief.

    Raises:
        InputError: what is wrong with the scene or the relief, in one line.
    """
    defines = dict(defines or {})
    checked = check_scene(path, defines)
    plate = describe(checked).plate
    if relief is None:
        relief = scene_relief(path, defines)
    relief = as_relief(relief, size_mm, default_mm=plate.size_mm)
    width_mm = None if relief.width_mm == plate.size_mm else relief.width_mm
    following = parameters(checked, defines, relief.heights.shape, width_mm)
    if following:
        checked = check_scene(path, {**defines, **following})
    check_size(path, describe(checked).plate.size_mm, relief.width_mm)
    return checked, relief


def film_of(
    path: str | Path, defines: Mapping[str, str] | None, samples: tuple[int, ...], size_mm: float
) -> dict[str, str]:
    """Values of the parameters by which the pictures of other reliefs have the film of this one.

    Args:
        path: of the scene file.
        defines: values of its `$parameters`, which stay.
        samples: (rows, cols) of the height map whose film it is.
        size_mm: width of its plate.

    Raises:
        InputError: what is wrong with the scene, in one line.
    """
    values = parameters(check_scene(path, defines), defines or {}, samples, size_mm)
    return {name: values[name] for name in (RESOLUTION, FILM_ROWS) if name in values}


def scene_relief(
    path: str | Path,
    defines: Mapping[str, str] | None = None,
    texture: str | Path | None = None,
    *,
    repeats: Repeats | None = None,
    **lengths: Unpack[Lengths],
) -> Relief:
    """The relief that lies on the plate of a scene; of the scene nothing is loaded.

    Args:
        path: of the scene file.
        defines: values of its `$parameters`.
        texture: a height map instead of the scene's own.
        repeats: whether the relief is a tile, along both axes, "x" or "y"; None: as its file's header says.
        lengths: `size_mm`, width of the plate, where None takes the one in the file's header, then that of
            the scene; the others as in `relief.heightmap.load_height_map`. How high white is in the scene's
            own height map, the scene says where nobody else does.

    Raises:
        InputError: what is wrong with the scene or the height map, in one line.
    """
    plate = describe(check_scene(path, defines)).plate
    file = plate.filename if texture is None else texture
    if file is None:
        raise InputError(f"{path}: heightfield: filename: missing")
    return Relief.read(
        file,
        repeats=repeats,
        default_mm=plate.size_mm,
        default_relief_mm=plate.relief_mm if texture is None else None,
        **lengths,
    )


def parameters(
    checked: CheckedScene, defines: Mapping[str, str], samples: tuple[int, ...], size_mm: float | None
) -> dict[str, str]:
    """Values of the parameters that follow a height map, where they differ from the scene's defaults.

    Args:
        checked: the scene with the user's values.
        defines: the user's values.
        samples: (rows, cols) of the height map.
        size_mm: width of its plate; None if the scene's own.
    """
    if SIZE not in checked.defaults:
        return {}
    rows, cols = samples
    values: dict[str, str] = {}
    if SIZE not in defines and size_mm is not None:
        values[SIZE] = repr(float(size_mm))
    if not checked.defaults.get(RESOLUTION, "").isdecimal():
        return values
    pixels = defines.get(RESOLUTION, checked.defaults[RESOLUTION])
    if RESOLUTION not in defines:
        finest = int(pixels)
        # A whole number of pixels for each sample, so that the picture has the plate's own proportions.
        wanted = max(cols, finest) if rows == cols else cols * max(1, round(finest / cols))
        pixels = str(min(wanted, max(finest, MOST_PIXELS)))
        if int(pixels) != finest:
            values[RESOLUTION] = pixels
    if FILM_ROWS in checked.defaults and FILM_ROWS not in defines and rows != cols and pixels.isdecimal():
        values[FILM_ROWS] = str(max(1, round(int(pixels) * rows / cols)))
    return values
