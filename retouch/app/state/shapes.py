"""Addresses of heights, from which the page's views fetch them."""

import itertools
from collections import OrderedDict

from retouch.app.values.findings import Shape

KEPT = 24
"""Heights that stay at their addresses: more than all views of several windows show."""
PREFIX = "/app/shape"


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
