"""Presses that standard input names, by the version of the code on PYTHONPATH.

python -m benchmarks.touch.press_server    # started as a file by benchmarks.touch.press_pairs

Each line is a list of skin, texture, model, precision and a file for the pressures; the answer is the CPU
seconds of a press. Of the packages of Retouch, only what both versions have is used.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import torch

from mitsuba_scenes import find_texture
from optimize.settings.skins import load_skin
from relief.heightmap import load_heights
from relief.patches import Patches
from relief.places import places
from relief.surface import Surface
from tactile.model import TouchModel, touch_model


def serve() -> None:
    """Press case by case."""
    ready: dict[str, Callable[[], Any]] = {}
    for line in sys.stdin:
        *case, file = json.loads(line)
        key = str(case)
        if key not in ready:
            model, fields = prepared(*case)
            ready[key] = partial(model.press, fields)
            np.save(file, ready[key]().pressure.double().numpy())
        began = time.process_time()
        ready[key]()
        print(time.process_time() - began, flush=True)


def prepared(skin: str, texture: str, model: Any, precision: str) -> tuple[TouchModel, torch.Tensor]:
    """Model of touch, and patches of a texture (places, n, n) mm."""
    finger, heights = load_skin(skin), np.asarray(load_heights(find_texture(texture)), dtype=np.float64)
    tiled = texture.endswith("-tile")
    surface = Surface(heights.shape, 10.0, (tiled, tiled))
    patches = Patches(surface, places(surface), side_mm=finger.patch_mm)
    dtype = getattr(torch, precision)
    fields = torch.as_tensor(np.asarray(patches.within_reach(heights, slice(0, patches.count))), dtype=dtype)
    return touch_model(finger, patches.samples, patches.size_mm, dtype, model), fields


if __name__ == "__main__":
    torch.set_num_threads(1)
    serve()
