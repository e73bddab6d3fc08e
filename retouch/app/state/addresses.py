"""Addresses of reliefs, from which the page's views fetch the heights."""

import itertools
from collections import OrderedDict

from relief.relief import Relief

KEPT = 24
"""Reliefs that stay at their addresses: more than all views of several windows show."""
PREFIX = "/app/relief"


class Addresses:
    """The latest reliefs, each at an address of its own."""

    def __init__(self) -> None:
        self._reliefs: OrderedDict[str, Relief] = OrderedDict()
        self._keys = itertools.count(1)

    def address(self, relief: Relief | None) -> str:
        """The address of a relief; empty for none."""
        if relief is None:
            return ""
        key = next((key for key, kept in self._reliefs.items() if kept is relief), None)
        key = key or str(next(self._keys))
        self._reliefs[key] = relief
        self._reliefs.move_to_end(key)
        if len(self._reliefs) > KEPT:
            self._reliefs.popitem(last=False)
        return f"{PREFIX}/{key}"

    def get(self, key: str) -> Relief | None:
        """The relief at an address; None if it is no longer there."""
        return self._reliefs.get(key)
