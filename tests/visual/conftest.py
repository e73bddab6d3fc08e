"""What the tests of pictures share."""

from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from tests.visual.scenes import Array, hills, write_scene
from visual.backend import variants
from visual.scene import Scene, load_scene

VARIANTS = ("llvm_ad_mono", "llvm_ad_rgb", "cuda_ad_mono", "cuda_ad_rgb", "scalar_rgb")


@pytest.fixture(params=VARIANTS)
def variant(request: pytest.FixtureRequest, mi: ModuleType) -> str:
    """Each of Mitsuba's variants that this machine can run; a test marked `gradients` has those with some."""
    name: str = request.param
    if name.startswith("cuda_") and not variants.has_cuda():
        pytest.skip("no CUDA device")
    if not variants.is_differentiable(name) and request.node.get_closest_marker("gradients"):
        pytest.skip("no gradients in scalar variants")
    return name


@pytest.fixture
def scene_of(mi: ModuleType, tmp_path: Path) -> Callable[..., Scene]:
    """Loads a scene of these lights over `hills()` or other heights; for the rest see `write_scene`."""

    def make(*lights: str, heights: Array | None = None, variant: str | None = None, **written: Any) -> Scene:
        relief = hills() if heights is None else heights
        loaded = load_scene(write_scene(tmp_path, relief, lights, **written), variant=variant)
        # Tests look into Mitsuba's own objects, which belong to a variant.
        variants.use(loaded.variant)
        return loaded

    return make
