"""JOD of a run's pictures, from its result.json or else from its picture files."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from optimize.run_directory.pictures import file_names
from optimize.settings.run_file import Run
from optimize.verification.jod import jod
from relief.common.arrays import Array
from relief.common.errors import InputError
from relief.readers import exr_channels
from visual.lights.parallel import LUMINANCE
from visual.scene import load_scene, plate_size_mm


def run_jod(run_dir: Path, run: Run, result: Mapping[str, Any]) -> list[float]:
    """JOD of the pictures before and after in grey, one for each condition.

    Args:
        run_dir: of the run, with `renders/`.
        run: its settings.
        result: content of its result.json.

    Raises:
        InputError: a picture file is missing or damaged, or the package is missing.
    """
    look = result["look"]
    if look.get("jod") is not None:
        return list(look["jod"])
    relief = run.relief(plate_size_mm(run.scene, run.define))
    scene = load_scene(run.scene, run.define, relief=relief)
    found = []
    for name, sharpness in zip(file_names(scene.conditions), look["pixels_per_degree"], strict=True):
        before, after = (
            _grey(run_dir / "renders" / f"{name}-{stage}.exr", scene.resolution)
            for stage in ("before", "after")
        )
        found.append(jod(before, after, scene.white, sharpness))
    return found


def _grey(path: Path, shape: tuple[int, int]) -> Array:
    """Luminance (rows, cols) of a picture file. Raises InputError."""

    def check(given: tuple[int, ...], name: Any) -> None:
        if tuple(given) != shape:
            raise InputError(f"{name}: {given[1]} x {given[0]} pixels; the scene has {shape[1]} x {shape[0]}")

    if not path.is_file():
        raise InputError(f"{path}: no such file")
    channels, _ = exr_channels(path, check)
    channels.pop("A", None)
    each = np.stack([*channels.values()]).astype(np.float64)
    return np.asarray(each[0] if len(each) == 1 else np.tensordot(LUMINANCE, each, 1))
