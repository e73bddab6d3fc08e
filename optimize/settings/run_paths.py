"""Paths in run files: made absolute, relative ones from the folder of whoever wrote them."""

import os
from pathlib import Path
from typing import Any

from mitsuba_scenes import bundled
from optimize.settings.skins import OWN, skin_anchored
from optimize.settings.toml_files import read_toml
from relief.ground.errors import InputError
from relief.ground.formats import HEIGHT_MAPS, RUN_HEIGHTS
from relief.printers import is_printer_file
from tactile.quantities import mapped_quantities


def anchor(values: dict[str, Any], folder: Path) -> None:
    """Make the paths of a run absolute, relative ones from ``folder``; a map or mask is no bundled file.

    Args:
        values: of a run file, or by dotted key.
        folder: of relative paths.
    """
    touch = values.get("touch")
    within = touch if isinstance(touch, dict) else {}
    for section, before in ((within, ""), (values, "touch.")):
        skin, regions = section.get(f"{before}skin"), section.get(f"{before}region")
        if isinstance(skin, str) and skin != OWN:
            section[f"{before}skin"] = skin_anchored(skin, folder)
        regions = regions if isinstance(regions, list) else []
        maps = ((section, f"{before}{one.map_keys.file}") for one in mapped_quantities())
        for part, key in (*maps, *((region, "mask") for region in regions)):
            if isinstance(part, dict) and isinstance(part.get(key), str):
                part[key] = os.path.abspath(folder / part[key])
        if isinstance(other := section.get(f"{before}feel_of"), str):
            # A folder, too: the result of a run.
            bundled_file = None if os.path.exists(folder / other) else bundled(other, *HEIGHT_MAPS)
            section[f"{before}feel_of"] = os.path.abspath(bundled_file or folder / other)
    of_print = values.get("print")
    for part, key in ((of_print, "printer"), (values, "print.printer")):
        if isinstance(part, dict) and isinstance(name := part.get(key), str) and is_printer_file(name):
            part[key] = os.path.abspath(folder / name)
    for key, suffixes in (("scene", (".xml",)), ("texture", HEIGHT_MAPS)):
        if isinstance(values.get(key), str):
            file = folder / values[key]
            bundled_file = None if os.path.isfile(file) else bundled(values[key], *suffixes)
            values[key] = os.path.abspath(bundled_file or file)


def resolve_result(touch: dict[str, Any]) -> None:
    """Name the result of a run by its file, where `feel_of` of a section `[touch]` names the run's folder.

    Whether that is a tile is taken from the settings of the run, unless the section says it.

    Raises:
        InputError: the folder holds no run, or the run has no result.
    """
    folder = touch.get("feel_of")
    if not isinstance(folder, str) or not os.path.isdir(folder):
        return
    settings, result = Path(folder) / "run.toml", Path(folder) / RUN_HEIGHTS
    if not settings.is_file():
        raise InputError(f"{folder}: a folder without run.toml; not a run directory")
    if not result.is_file():
        raise InputError(f"{result}: no such file; the run has no result yet")
    touch["feel_of"] = str(result)
    # Not loaded as a run, which might name another run in turn.
    touch.setdefault("feel_of_repeats", read_toml(settings).get("repeats", False))
