"""Fitting of a scene to a height map: parameters of the scene file that follow the size and the samples.

A scene whose file declares the parameter `size_mm` fits plates of any size. Its film has a pixel at least for
each sample across (`resolution`), and rows in proportion to the plate's (`film_rows`), if the file declares
these parameters too. What a user defines stays.
"""

from collections.abc import Mapping
from pathlib import Path

from relief.export.printed import printed_map
from relief.export.printers import Printer
from relief.heightmap import HeightMap
from visual.scene_file.check import check_scene
from visual.scene_file.describe import check_size, describe, plate_height_map
from visual.scene_file.parsed import CheckedScene

SIZE, RESOLUTION, FILM_ROWS = "size_mm", "resolution", "film_rows"
"""Names of the parameters."""
MOST_PIXELS = 1024
"""Most pixels across a film that follows the samples: steps of a descent take no more on a square film."""


def fitted_scene(
    path: str | Path,
    defines: Mapping[str, str] | None = None,
    texture: str | Path | None = None,
    size_mm: float | None = None,
    relief_mm: float | None = None,
    height_scale: float | None = None,
    printer: Printer | None = None,
    repeats: tuple[bool, bool] = (False, False),
) -> tuple[CheckedScene, HeightMap]:
    """Check a scene that fits a height map, and read the height map.

    Args:
        path: of the scene file.
        defines: values of its `$parameters`.
        texture: a height map instead of the scene's own.
        size_mm: width of the plate; None takes the one in the file's header, then that of the scene.
        relief_mm, height_scale: of the height map, as in `plate_height_map`.
        printer: makes the relief; None: the relief is as in its file.
        repeats: axes (rows, cols) along which a relief to be printed goes on as itself.

    Returns:
        The scene, and the height map, as printed if there is a printer.

    Raises:
        InputError: what is wrong with the scene or the height map, in one line.
    """
    defines = dict(defines or {})
    checked = check_scene(path, defines)
    plate = describe(checked).plate
    read = plate_height_map(path, plate, texture, size_mm, relief_mm, height_scale)
    if printer is not None:
        fitting = parameters(checked, defines, read.heights.shape, read.size_mm)
        size_mm = float(fitting.get(SIZE, plate.size_mm))
        read = printed_map(read, printer, repeats, texture or path, size_mm)
    following = parameters(checked, defines, read.heights.shape, read.size_mm)
    if following:
        checked = check_scene(path, {**defines, **following})
    check_size(path, describe(checked).plate.size_mm, read.size_mm)
    return checked, read


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
        if rows != cols:
            # A whole number of pixels for each sample, so that the picture has the plate's own proportions.
            values[RESOLUTION] = str(min(cols * max(1, round(finest / cols)), max(finest, MOST_PIXELS)))
        elif cols > finest:
            values[RESOLUTION] = str(min(cols, max(finest, MOST_PIXELS)))
        pixels = values.get(RESOLUTION, pixels)
    if FILM_ROWS in checked.defaults and FILM_ROWS not in defines and rows != cols and pixels.isdecimal():
        values[FILM_ROWS] = str(max(1, round(int(pixels) * rows / cols)))
    return values
