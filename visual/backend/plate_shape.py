"""The plate in a Mitsuba scene: its shape and its material."""

from typing import Any


def plate_shape(scene: Any) -> Any:
    """The height field of a Mitsuba scene; StopIteration if the scene has none."""
    return next(shape for shape in scene.shapes() if type(shape).__name__ == "HeightField")


def is_textured(scene: Any) -> bool:
    """Whether the material of the height field varies over the plate or with directions along it."""
    return bool(plate_shape(scene).has_vertex_texcoords())
