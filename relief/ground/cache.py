"""Cache of arrays on disk: each is computed once and read by every process."""

import hashlib
import json
import logging
import re
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from relief.ground.arrays import AnyArray
from relief.ground.errors import InputError
from relief.ground.files import cache_folder, locked, remove_partial, write_atomically
from relief.ground.tensors import Arrays, read_tensors, tensor_bytes

_log = logging.getLogger(__name__)

Layout = Mapping[str, tuple[tuple[int, ...], str]]
"""Shape and type, as numpy's ``dtype.str`` without byte order, by name of the array; -1 is any length."""
ABANDONED_S = 3600.0
"""Age of a temporary folder, s, after which the folder counts as abandoned."""
_IMPORT = re.compile(r"^\s*(?:from|import) (\w+(?:\.\w+)*)(?= import| as|$)", re.MULTILINE)


@cache
def fingerprint(module: str) -> str:
    """Return a checksum of source code, for the key of what the code builds.

    Args:
        module: Name of the module that builds it. A change of its source, or of a module that it imports from
            its own package, directly or not, changes the key. The modules are read, not imported.

    Returns:
        SHA-256 in hexadecimal.
    """
    package, waiting, sources = module.partition(".")[0] + ".", [module], dict[str, str]()
    while waiting:
        name = waiting.pop()
        if name not in sources and (spec := find_spec(name)) is not None and spec.origin is not None:
            sources[name] = Path(spec.origin).read_text(encoding="utf-8")
            waiting += [each for each in _IMPORT.findall(sources[name]) if each.startswith(package)]
    return hashlib.sha256(json.dumps(sources, sort_keys=True).encode()).hexdigest()


Key = Mapping[str, float | int | str]
"""Everything that arrays depend on, the `fingerprint` of the code that builds them included, as "code"."""


def cached(
    kind: str, key: Key, build: Callable[[], Arrays], layout: Layout, shipped: Path | None = None
) -> Arrays:
    """Return the arrays of `build()`, from disk if the same key was built before.

    Several processes may call this at once: files are written atomically, and one process builds at a time. A
    file that is damaged, has another key or layout, or holds a number that is not finite is built anew and
    replaced. A folder that cannot be written costs only the time of building.

    Args:
        kind: First part of the file's name, for people.
        key: Of the arrays.
        build: Computes the arrays.
        layout: Of the arrays that `build` gives.
        shipped: Folder of arrays that come with Retouch (`ship`), which are looked up first.

    Returns:
        The arrays by name.
    """
    path, text = _place(kind, key)
    for file, own in [(path, text), *([_shipped(kind, key, shipped)] if shipped else [])]:
        stored = _read(file, kind, own, layout)
        if stored is not None:
            return stored
    with ExitStack() as stack:
        with suppress(OSError, ImportError):
            stack.enter_context(_one_builder(path.parent))
        stored = _read(path, kind, text, layout)
        if stored is not None:
            return stored
        _log.info("%s: not in the cache, is built", kind)
        arrays = build()
        with suppress(OSError):
            remove_partial(path.parent, ABANDONED_S)
            write_atomically(path, tensor_bytes(arrays, text))
        return arrays


def is_cached(kind: str, key: Key, shipped: Path | None = None) -> bool:
    """Return whether `cached` would find a file of this kind and key; the file is not read."""
    return _place(kind, key)[0].is_file() or (
        shipped is not None and _shipped(kind, key, shipped)[0].is_file()
    )


def ship(kind: str, key: Key, folder: Path) -> Path:
    """Copy the cached arrays of a key to a folder that comes with Retouch, and return their file there.

    Their key there is without the code, so that a change of the code's text leaves them valid: tests compare
    them with what the code builds.

    Raises:
        InputError: The cache does not hold them.
    """
    arrays, _ = read_tensors(_place(kind, key)[0])
    path, text = _shipped(kind, key, folder)
    write_atomically(path, tensor_bytes(arrays, text))
    return path


def _shipped(kind: str, key: Key, folder: Path) -> tuple[Path, str]:
    """The file of a kind and a key in a folder that comes with Retouch, and its key as text."""
    return _place(kind, {name: value for name, value in key.items() if name != "code"}, folder)


def _place(kind: str, key: Key, folder: Path | None = None) -> tuple[Path, str]:
    """The file of a kind and a key in a folder, by default that of the cache, and the key as text."""
    text = json.dumps(dict(key), sort_keys=True)
    name = f"{kind}-{hashlib.sha256(text.encode()).hexdigest()[:20]}.safetensors"
    return (folder or cache_folder()) / name, text


def _read(path: Path, kind: str, text: str, layout: Layout) -> Arrays | None:
    """The arrays of a file, None if there is no sound one."""
    if path.exists():
        with suppress(InputError):
            arrays, stored = read_tensors(path)
            if stored == text and _has_layout(arrays, layout):
                _log.info("%s: %s read from the cache, not built", path, kind)
                return arrays
    return None


_builds = threading.local()
"""Whether this thread holds the lock of the cache: a build may need other arrays of the cache."""


@contextmanager
def _one_builder(folder: Path) -> Iterator[None]:
    """Let processes that share a cache build one after another, so that none builds the same arrays twice.

    Raises:
        OSError, ImportError: There is no folder to lock, or no lock on this system.
    """
    if getattr(_builds, "held", False):
        yield
        return
    folder.mkdir(parents=True, exist_ok=True)
    with locked(folder, wait=True):
        _builds.held = True
        try:
            yield
        finally:
            _builds.held = False


def _has_layout(arrays: Arrays, layout: Layout) -> bool:
    """Whether arrays are those of a layout, and hold finite numbers."""
    return arrays.keys() == layout.keys() and all(_fits(arrays[name], *of) for name, of in layout.items())


def _fits(array: AnyArray, shape: tuple[int, ...], kind: str) -> bool:
    alike = all(wanted in (length, -1) for length, wanted in zip(array.shape, shape, strict=False))
    alike = alike and array.ndim == len(shape) and array.dtype == np.dtype(kind)
    return alike and bool(np.isfinite(array).all())
