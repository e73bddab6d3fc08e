"""Cache of arrays on disk: each is computed once and read by every process."""

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
"""Arrays by name; their floating-point types are kept."""


def fingerprint(*modules: str) -> str:
    """Return a checksum of source code, for the key of what the code builds.

    Args:
        modules: Names of the modules that build it, which are not imported; a change in one changes the key.

    Returns:
        SHA-256 in hexadecimal.
    """
    digest = hashlib.sha256()
    for module in modules:
        spec = find_spec(module)
        assert spec is not None and spec.origin is not None, module
        digest.update(Path(spec.origin).read_bytes())
    return digest.hexdigest()


def cached(kind: str, key: Mapping[str, float | int | str], build: Callable[[], Arrays]) -> Arrays:
    """Return the arrays of `build()`, from disk if the same key was built before.

    Several processes may call this at once: files are written atomically, and two processes that build the
    same key write the same numbers. A file that cannot be read is built anew. A folder that cannot be written
    costs the time of building, nothing else.

    Args:
        kind: First part of the file's name, for people.
        key: Everything that the arrays depend on, the version of the code that builds them included.
        build: Computes the arrays.

    Returns:
        The arrays by name.
    """
    text = json.dumps(dict(key), sort_keys=True)
    path = cache_folder() / f"{kind}-{hashlib.sha256(text.encode()).hexdigest()[:20]}.safetensors"
    if path.exists():
        try:
            return load_file(path)
        except (SafetensorError, OSError):
            pass  # The file is damaged, by a full disk for example; the code below replaces it.
    arrays = build()
    try:
        with partial_file(path) as partial:
            contiguous = {name: np.ascontiguousarray(array) for name, array in arrays.items()}
            save_file(contiguous, partial, metadata={"key": text})
    except (SafetensorError, OSError):
        pass
    return arrays
