"""Operators on disk: written once, read by every process, never half-written, never stale."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Callable, Mapping
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from safetensors import SafetensorError
from safetensors.numpy import load_file, save_file

from relief.files import cache_folder, partial_file

Arrays = dict[str, NDArray[Any]]
"""Of any floating-point type, which they keep."""


def fingerprint(*modules: str) -> str:
    """Of the source of the modules that build something: in a key, it keeps the cache from going stale.

    Args:
        modules: their names; they are not imported.
    """
    digest = hashlib.sha256()
    for module in modules:
        spec = find_spec(module)
        assert spec is not None and spec.origin is not None, module
        digest.update(Path(spec.origin).read_bytes())
    return digest.hexdigest()


def cached(kind: str, key: Mapping[str, float | int | str], build: Callable[[], Arrays]) -> Arrays:
    """The arrays of `build()`, from disk if an identical key was built before.

    Safe for several processes: each writes a file of its own and renames it, so a reader sees a whole file or
    none; two that build at once write the same numbers. A file that does not read is built anew. A folder
    that cannot be written costs the time of building, nothing else.

    Args:
        kind: names the file, for people.
        key: everything that the arrays depend on, the version of the code that builds them included.
    """
    text = json.dumps(dict(key), sort_keys=True)
    path = cache_folder() / f"{kind}-{hashlib.sha256(text.encode()).hexdigest()[:20]}.safetensors"
    if path.exists():
        try:
            return load_file(path)
        except (SafetensorError, OSError):
            pass  # cut short by a full disk, say: built anew and replaced below
    arrays = build()
    try:
        with partial_file(path) as partial:
            contiguous = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
            save_file(contiguous, partial, metadata={"key": text})
    except (SafetensorError, OSError):
        pass
    return arrays
