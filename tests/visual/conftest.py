"""What the tests of pictures share."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from tests.visual.scenes import Array, hills, write_scene
from visual.scene import Scene, load_scene


@pytest.fixture
def scene_of(mi: ModuleType, tmp_path: Path) -> Callable[..., Scene]:
    """Loads a scene of these lights over `hills()` or other heights; for the rest see `write_scene`."""

    def make(*lights: str, heights: Array | None = None, variant: str | None = None, **written: Any) -> Scene:
        relief = hills() if heights is None else heights
        return load_scene(write_scene(tmp_path, relief, lights, **written), variant=variant)

    return make
