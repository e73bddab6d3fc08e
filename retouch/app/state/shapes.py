"""Addresses of heights, from which the page's views fetch them."""

import io
import itertools
from collections import OrderedDict

import numpy as np
from PIL import Image

from relief.shading import facing
from retouch.app.values.found import Shape

KEPT = 24
"""Heights that stay at their addresses: more than all views of several windows show."""
PREFIX = "/app/shape"
STILL_LAMP = 135.0, 35.0
"""Azimuth and elevation, degrees, of the lamp in the picture that a browser without WebGL 2 shows."""
STILL_AMBIENT = 0.2
"""Share of white of that picture where a face is turned from the lamp."""


class Shapes:
    """The latest heights, each at an address of its own."""

    def __init__(self) -> None:
        self._shapes: OrderedDict[str, Shape] = OrderedDict()
        self._keys = itertools.count(1)

    def address(self, shape: Shape | None) -> str:
        """The address of heights; empty for none."""
        if shape is None:
            return ""
        for key, kept in self._shapes.items():
            if kept is shape:
                self._shapes.move_to_end(key)
                return f"{PREFIX}/{key}"
        key = str(next(self._keys))
        self._shapes[key] = shape
        while len(self._shapes) > KEPT:
            self._shapes.popitem(last=False)
        return f"{PREFIX}/{key}"

    def get(self, key: str) -> Shape | None:
        """The heights at an address; None if they are no longer there."""
        return self._shapes.get(key)


def lit_png(shape: Shape) -> bytes:
    """A PNG of heights under one lamp without shadows, for browsers without WebGL 2."""
    light = np.clip(facing(shape.heights, shape.size_mm, *STILL_LAMP), 0.0, 1.0)
    content = io.BytesIO()
    brightness = STILL_AMBIENT + (1.0 - STILL_AMBIENT) * light
    Image.fromarray(np.rint(255.0 * brightness).astype(np.uint8)).save(content, "png")
    return content.getvalue()
