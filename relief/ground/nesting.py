"""Nested mappings, such as the tables of a run file, as one."""

from collections.abc import Mapping
from typing import Any


def flattened(values: Mapping[str, Any], before: str = "") -> dict[str, Any]:
    """Flatten nested mappings and lists of them; keys and numbers in lists are joined by dots.

    Args:
        values: by key.
        before: what every key begins with.
    """
    flat: dict[str, Any] = {}
    for name, value in values.items():
        if isinstance(value, list) and all(isinstance(item, Mapping) for item in value):
            value = dict(enumerate(value))
        inner = flattened(value, f"{before}{name}.") if isinstance(value, Mapping) else {before + name: value}
        flat |= inner
    return flat
