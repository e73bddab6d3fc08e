"""Paths in run files: made absolute, relative ones from the folder of whoever wrote them."""

import os
from pathlib import Path
from typing import Any

from mitsuba_scenes import bundled
from optimize.runs.skins import OWN, skin_anchored
from relief.formats import HEIGHT_MAPS


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
        for part, key in ((section, f"{before}roughness_map"), *((region, "mask") for region in regions)):
            if isinstance(part, dict) and isinstance(part.get(key), str):
                part[key] = os.path.abspath(folder / part[key])
    for key, suffixes in (("scene", (".xml",)), ("texture", HEIGHT_MAPS)):
        if isinstance(values.get(key), str):
            file = folder / values[key]
            found = None if os.path.isfile(file) else bundled(values[key], *suffixes)
            values[key] = os.path.abspath(found or file)
