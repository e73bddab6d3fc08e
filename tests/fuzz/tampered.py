"""Tensor files with tampered arrays and JSON, whose checksums are made right again or not."""

from __future__ import annotations

import json
import zlib
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from hypothesis import strategies as st
from numpy.typing import NDArray

from relief.ground.tensors import tensor_bytes
from tests.fuzz.case import HOSTILE, edited, edits

Arrays = dict[str, NDArray[Any]]
Seal = Callable[[Arrays, Any], bytes]
"""A function that makes a file with right checksums of arrays and JSON."""

VALUES = (np.nan, np.inf, -np.inf, 1e300, -1e300, 500.0, -1.0, 0.0, 1e-300, 20.1)
JSON_VALUES: tuple[Any, ...] = (
    *(
        None,
        True,
        [],
        {},
        [[]],
        {"x": 1},
        float("nan"),
        float("inf"),
        -float("inf"),
        1e300,
        -1.0,
        0.0,
        0.5,
        2.0,
    ),
    *(0, 1, -1, 2, 3, 99, 2**31, 2**63, 10**400, *HOSTILE),
)


@st.composite
def arrays_changed(draw: st.DrawFn, arrays: Arrays) -> Arrays:
    """Arrays of which one has other values, another shape, type or name, or is gone."""
    changed = dict(arrays)
    name = draw(st.sampled_from(sorted(arrays)))
    array = arrays[name]
    what = draw(
        st.sampled_from(
            ("value", "value", "fill", "reshape", "crop", "type", "rename", "drop", "add", "scale")
        )
    )
    if what in ("value", "fill", "scale") and not (array.size and array.dtype.kind == "f"):
        what = "drop"
    if what == "value":
        array = array.copy()
        with np.errstate(all="ignore"):
            array.flat[draw(st.integers(0, 2**30)) % max(1, array.size)] = draw(st.sampled_from(VALUES))
    elif what == "fill":
        with np.errstate(all="ignore"):
            array = np.full_like(array, draw(st.sampled_from(VALUES)))
    elif what == "scale":
        with np.errstate(all="ignore"):
            array = array * array.dtype.type(draw(st.sampled_from((-1.0, 0.0, 1e-30, 1e30, 0.99))))
    elif what == "reshape":
        shapes = ((-1,), (1, *array.shape), (*array.shape, 1), array.shape[::-1], (array.size, 1))
        array = array.reshape(draw(st.sampled_from(shapes)))
    elif what == "crop":
        most = max(0, min(array.shape, default=1) - 1)
        array = (
            array[tuple(slice(0, draw(st.sampled_from((most, 1, 0)))) for _ in array.shape)]
            if array.ndim
            else array[None]
        )
    elif what == "type":
        with np.errstate(all="ignore"):
            array = array.astype(draw(st.sampled_from(("f2", "f4", "f8", "i8", "u1", "?"))))
    if what == "rename":
        changed[draw(st.sampled_from((*sorted(arrays), name + "x", "", "é")))] = changed.pop(name)
    elif what == "drop":
        del changed[name]
    elif what == "add":
        changed[draw(st.sampled_from(("x", name + ".x", "current.memory.x")))] = array
    else:
        changed[name] = array
    return changed


def _places(value: Any) -> list[tuple[Any, ...]]:
    """Paths of every value in JSON, outermost first."""
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    return [(), *((key, *rest) for key, below in inner for rest in _places(below))]


@st.composite
def json_changed(draw: st.DrawFn, value: Any) -> Any:
    """JSON of which one value is another, gone, or has a neighbour."""
    copy = json.loads(json.dumps(value))
    places = _places(copy)
    *path, last = draw(st.sampled_from(places[1:] or [(0,)]))
    holder = copy
    for key in path:
        holder = holder[key]
    what = draw(st.sampled_from(("replace", "replace", "replace", "scale", "drop", "add")))
    old = holder[last] if not isinstance(holder, dict | list) or places[1:] else None
    if what == "drop":
        del holder[last]
    elif what == "add" and isinstance(holder, dict):
        holder[draw(st.sampled_from(("x", "", "step")))] = draw(st.sampled_from(JSON_VALUES))
    elif what == "add":
        holder.append(draw(st.sampled_from((*JSON_VALUES, old))))
    elif what == "scale" and isinstance(old, int | float) and not isinstance(old, bool):
        holder[last] = draw(st.sampled_from((old + 1, old - 1, -old, old * 1000, old * old)))
    else:
        holder[last] = draw(st.sampled_from(JSON_VALUES))
    return copy


def resealed(content: bytes) -> bytes:
    """A tensor file of `relief.ground.tensors`, its checksum made right again if there is a place for it."""
    place = b'"checked":"'
    begin = content.find(place) + len(place)
    if begin < len(place):
        return content
    blank = content[:begin] + b"0" * 8 + content[begin + 8 :]
    return content[:begin] + b"%08x" % zlib.crc32(blank) + content[begin + 8 :]


@st.composite
def tampered(draw: st.DrawFn, content: bytes, arrays: Arrays, numbers: Any, seal: Seal) -> bytes:
    """A file of arrays and JSON that was tampered with; now and then as it was.

    Args:
        content: The sound file.
        arrays: Its arrays by name.
        numbers: Its JSON.
        seal: Makes a file of other arrays and JSON.
    """
    how = draw(st.sampled_from(("sealed",) * 6 + ("bytes", "resealed", "nothing")))
    if how == "nothing":
        return content
    if how != "sealed":
        changed = edited(content, draw(st.lists(edits(), min_size=1, max_size=3)))
        return resealed(changed) if how == "resealed" else changed
    for what in draw(st.lists(st.sampled_from(("arrays", "json")), min_size=1, max_size=3)):
        if what == "arrays" and arrays:
            arrays = draw(arrays_changed(arrays))
        elif what == "json" and isinstance(numbers, dict | list) and numbers:
            numbers = draw(json_changed(numbers))
    return seal(arrays, numbers)


def sealed_tensors(arrays: Mapping[str, NDArray[Any]], numbers: Any) -> bytes:
    """A tensor file of `relief.ground.tensors`."""
    return tensor_bytes(arrays, json.dumps(numbers, sort_keys=True))
