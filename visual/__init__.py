"""Sight: what a relief looks like, with gradients. Importing this loads no Mitsuba, Dr.Jit or torch."""

from typing import TYPE_CHECKING, Any

from relief.errors import InputError as InputError
from relief.heightmap import load_heights as load_heights

if TYPE_CHECKING:
    from visual.scene import Scene as Scene
    from visual.scene import load_scene as load_scene


def __getattr__(name: str) -> Any:
    if name in ("Scene", "load_scene"):
        from visual import scene

        return getattr(scene, name)
    raise AttributeError(f"module 'visual' has no attribute {name!r}")
