"""Candidates for libLLVM: paths on this machine, and their versions."""

import glob
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

_FOLDERS = (
    "/usr/lib/*-linux-gnu*",
    "/usr/lib/llvm*/lib*",
    "/usr/lib64/llvm*/lib*",
    "/usr/lib64",
    "/usr/lib",
    "/usr/local/lib",
    "/opt/homebrew/opt/llvm*/lib",
    "/usr/local/opt/llvm*/lib",
    "/home/linuxbrew/.linuxbrew/opt/llvm*/lib",
    "/opt/local/libexec/llvm-*/lib",
)

_NAME = re.compile(r"libLLVM(?:[-.](?P<before>\d[\d.]*))?\.(?:so|dylib)(?:\.(?P<after>\d[\d.]*))?")
_FOLDER_VERSION = re.compile(r"llvm[-@/]?(\d[\d.]*)")


@dataclass(frozen=True)
class Library:
    """A libLLVM on this machine.

    Attributes:
        path: resolved.
        version: empty where neither name nor folder states one.
    """

    path: Path
    version: tuple[int, ...]


def parse_version(path: Path) -> tuple[int, ...] | None:
    """Version of the library at a resolved path: () if the name states none, None if the file is no libLLVM.

    Names may be `libLLVM-14.so.1`, `libLLVM.so.19.1`, `libLLVM.21.dylib`, and a plain name in `llvm@19/lib`.
    """
    name = _NAME.fullmatch(path.name)
    if name is None:
        return None
    digits = name["before"] or name["after"]
    if not digits:
        in_folder = _FOLDER_VERSION.search(str(path.parent))
        digits = in_folder[1] if in_folder else ""
    return tuple(int(part) for part in digits.split(".") if part)


def _loader_paths() -> Iterator[Path]:
    """Paths in the cache of the Linux loader; none on other systems."""
    ldconfig = shutil.which("ldconfig") or shutil.which("ldconfig", path="/sbin:/usr/sbin")
    if ldconfig is None or sys.platform != "linux":
        return
    listing = subprocess.run([ldconfig, "-p"], capture_output=True, text=True, check=False).stdout
    for line in listing.splitlines():
        name, arrow, path = line.strip().partition(" => ")
        if arrow and name.startswith("libLLVM"):
            yield Path(path)


def _folder_paths() -> Iterator[Path]:
    """Paths in the folders where package managers put libLLVM, newest or not."""
    searched = [folder for folder in os.environ.get("LD_LIBRARY_PATH", "").split(os.pathsep) if folder]
    for folder in (*searched, f"{sys.prefix}/lib", *_FOLDERS):
        yield from map(Path, glob.iglob(f"{folder}/libLLVM[-.]*"))


def candidates() -> list[Library]:
    """Every libLLVM found on this machine, links resolved, newest first and those of unknown version last."""
    libraries = {
        Library(path, version)
        for path in {link.resolve() for link in (*_loader_paths(), *_folder_paths())}
        if (version := parse_version(path)) is not None and path.is_file()
    }
    return sorted(libraries, key=lambda library: (library.version, str(library.path)), reverse=True)


def find(name: str) -> Library:
    """The library at a path or of a bare name among known libraries; its file may not exist."""
    paths = {} if os.sep in name else {path.name: path for path in (*_folder_paths(), *_loader_paths())}
    path = paths.get(name, Path(name)).resolve()
    return Library(path, parse_version(path) or ())
