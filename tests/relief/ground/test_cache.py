"""Operators on disk are never half-written, never stale, and never in the way."""

import os
import subprocess
import sys
import time
import zlib
from pathlib import Path

import numpy as np
import pytest
from safetensors.numpy import save

import tactile.layer.elastic_layer
from relief.ground.cache import cached, fingerprint
from relief.ground.errors import InputError
from relief.ground.files import cache_folder
from relief.ground.tensors import Arrays, read_tensors, tensor_bytes
from tactile import Skin

REPOSITORY = Path(__file__).parents[3]
KEY = {"version": 1, "nu": 0.48}
LAYOUT = {"values": ((100, 10), "f8")}


class Builder:
    """Builds the same arrays each time and counts how often."""

    def __init__(self) -> None:
        self.times = 0

    def __call__(self) -> Arrays:
        self.times += 1
        return {"values": np.arange(1000.0).reshape(10, 100).T}


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("RETOUCH_CACHE", str(tmp_path / "deep" / "cache"))
    return tmp_path / "deep" / "cache"


def assert_right(arrays: Arrays) -> None:
    np.testing.assert_array_equal(arrays["values"], Builder()()["values"])


def test_the_second_time_comes_from_disk(folder: Path) -> None:
    build = Builder()
    assert_right(cached("thing", KEY, build, LAYOUT))
    assert_right(cached("thing", KEY, build, LAYOUT))
    assert build.times == 1
    assert [path.suffix for path in folder.iterdir()] == [".safetensors"]


def test_another_key_is_built_anew(folder: Path) -> None:
    build = Builder()
    for key in (KEY, {**KEY, "nu": 0.4800001}, {**KEY, "version": 2}):
        cached("thing", key, build, LAYOUT)
    cached("other", KEY, build, LAYOUT)
    cached("thing", dict(reversed(KEY.items())), build, LAYOUT)
    assert build.times == 4


@pytest.mark.parametrize("damage", [b"", b"not a cache file", "half"])
def test_a_corrupt_file_is_rebuilt(folder: Path, damage: bytes | str) -> None:
    build = Builder()
    cached("thing", KEY, build, LAYOUT)
    (path,) = folder.iterdir()
    whole = path.read_bytes()
    path.write_bytes(damage if isinstance(damage, bytes) else whole[: len(whole) // 2])
    assert_right(cached("thing", KEY, build, LAYOUT))
    assert build.times == 2
    assert path.read_bytes() == whole


def assert_rebuilt(folder: Path, content: bytes) -> None:
    """A file of this content in the place of a cached one is not believed, and replaced."""
    (path,) = folder.iterdir()
    whole, build = path.read_bytes(), Builder()
    path.write_bytes(content)
    for _ in range(2):
        assert_right(cached("thing", KEY, build, LAYOUT))
        assert build.times == 1
        assert path.read_bytes() == whole


def test_any_flipped_bit_is_found_and_mended(folder: Path) -> None:
    cached("thing", KEY, Builder(), LAYOUT)
    (path,) = folder.iterdir()
    whole = path.read_bytes()
    for place in (*range(0, 200, 7), *np.linspace(200, len(whole) - 1, 20).astype(int)):
        flipped = bytearray(whole)
        flipped[place] ^= 1 << place % 8
        assert_rebuilt(folder, bytes(flipped))


BAD = ("zeros", "other names", "other shapes", "not finite", "other key", "empty")
SEALED = ("another name", "another shape", "another type", "one dimension more", "a name too many")


@pytest.mark.parametrize("bad", [*BAD, *SEALED])
def test_arrays_that_were_not_built_for_this_key_are_not_believed(folder: Path, bad: str) -> None:
    cached("thing", KEY, Builder(), LAYOUT)
    (path,) = folder.iterdir()
    arrays, text = read_tensors(path)
    values = arrays["values"]
    # A file without a checksum of its own stands for any that Retouch did not write.
    content = {
        "zeros": save(
            {"values": np.zeros_like(values)}, {"checked": path.read_bytes()[27:35].decode() + text}
        ),
        "other names": save({"other": values}, {"key": text}),
        "other shapes": save({"values": values.T.copy()}, {"checked": "00000000" + text}),
        "not finite": tensor_bytes({"values": np.full_like(values, np.nan)}, text),
        "other key": tensor_bytes({"values": np.zeros_like(values)}, text.replace("0.48", "0.49")),
        "empty": save({}, None),
        "another name": tensor_bytes({"other": values}, text),
        "another shape": tensor_bytes({"values": values.T}, text),
        "another type": tensor_bytes({"values": values.astype(np.float32)}, text),
        "one dimension more": tensor_bytes({"values": values[None]}, text),
        "a name too many": tensor_bytes({"values": values, "more": values}, text),
    }
    assert_rebuilt(folder, content[bad])


def test_a_text_nested_without_end_is_refused(tmp_path: Path) -> None:
    whole = tensor_bytes({"values": np.zeros(2)}, "")
    header = b'{"__metadata__":{"checked":"00000000"},"x":' + b"[" * 100_000
    content = len(header).to_bytes(8, "little") + header
    sealed = content.replace(b"00000000", b"%08x" % zlib.crc32(content), 1)
    for name, file in (("whole", whole), ("deep", sealed)):
        (tmp_path / name).write_bytes(file)
    read_tensors(tmp_path / "whole")
    with pytest.raises(InputError, match="deep: damaged"):
        read_tensors(tmp_path / "deep")


def test_the_key_follows_the_code_that_builds(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "solvers_of_this_test"
    (package / "deep").mkdir(parents=True)
    sources = {
        "__init__.py": "",
        "operator.py": "def build():\n    from solvers_of_this_test.deep.mesh import mesh\n",
        "deep/__init__.py": "",
        "deep/mesh.py": "import solvers_of_this_test.elements as e\nimport numpy\n",
        "elements.py": "STIFFNESS = 1\n",
        "other.py": "",
    }
    monkeypatch.syspath_prepend(str(tmp_path))

    def key() -> str:
        for name, source in sources.items():
            (package / name).write_text(source)
        fingerprint.cache_clear()
        return fingerprint("solvers_of_this_test.operator")

    first = key()
    assert key() == first
    sources["other.py"] = "changed = True\n"
    assert key() == first
    sources["elements.py"] = "STIFFNESS = 2\n"
    assert key() != first
    fingerprint.cache_clear()


def test_a_user_without_a_home_has_a_folder_that_goes_with_the_process() -> None:
    script = """
import os, pwd, pathlib
from relief.ground.errors import InputError
from relief.ground.files import cache_folder

def no_entry(_: int) -> None:
    raise KeyError

pwd.getpwuid = no_entry
for name in ("HOME", "RETOUCH_CACHE", "XDG_CACHE_HOME"):
    os.environ.pop(name, None)
folder = cache_folder()
assert folder == cache_folder() and folder.is_dir() and folder.stat().st_mode & 0o77 == 0
print(folder)
"""
    process = subprocess.run(
        [sys.executable, "-c", script], cwd=REPOSITORY, capture_output=True, text=True, check=False
    )
    assert (process.returncode, process.stderr) == (0, "")
    assert not Path(process.stdout.strip()).exists()


@pytest.mark.parametrize(
    "file", ["layer/elastic_layer.py", "elements/finite_elements.py", "unstructured/meshing.py"]
)
def test_no_version_of_a_builder_is_kept_by_hand(file: str) -> None:
    source = (REPOSITORY / "tactile" / file).read_text()
    assert '"code": fingerprint(__name__)' in source


def test_a_folder_that_cannot_be_made_costs_only_time(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("in the way")
    monkeypatch.setenv("RETOUCH_CACHE", str(tmp_path / "file" / "cache"))
    build = Builder()
    for _ in range(2):
        assert_right(cached("thing", KEY, build, LAYOUT))
    assert build.times == 2


@pytest.mark.skipif(os.name == "nt" or os.geteuid() == 0, reason="root may write anywhere")
def test_a_read_only_folder_costs_only_time(folder: Path) -> None:
    folder.mkdir(parents=True)
    folder.chmod(0o500)
    assert_right(cached("thing", KEY, Builder(), LAYOUT))
    assert list(folder.iterdir()) == []


def run(script: str, folder: Path) -> subprocess.Popen[str]:
    environment = {**os.environ, "RETOUCH_CACHE": str(folder), "PYTHONPATH": str(REPOSITORY)}
    return subprocess.Popen(
        [sys.executable, "-c", script], env=environment, stderr=subprocess.PIPE, text=True
    )


def test_a_full_disk_costs_only_time(folder: Path) -> None:
    resource = pytest.importorskip("resource")
    build = Builder()
    allowed, most = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, most))
    try:
        arrays = cached("thing", KEY, build, LAYOUT)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, (allowed, most))
    assert_right(arrays)
    assert list(folder.iterdir()) == []


def test_two_processes_may_build_at_once(folder: Path) -> None:
    script = """
import time
import numpy as np
from relief.ground.cache import cached
def build():
    time.sleep(0.5)
    return {"values": np.arange(1000.0).reshape(10, 100).T}
arrays = cached("thing", {"version": 1, "nu": 0.48}, build, {"values": ((100, 10), "f8")})
assert arrays["values"][3, 2] == 203.0
"""
    processes = [run(script, folder) for _ in range(2)]
    for process in processes:
        _, errors = process.communicate()
        assert process.returncode == 0, errors
    assert len(list(folder.iterdir())) == 1
    build = Builder()
    assert_right(cached("thing", KEY, build, LAYOUT))
    assert build.times == 0


def test_the_operator_of_another_skin_is_another_file(folder: Path) -> None:
    tactile.layer.elastic_layer._operator.cache_clear()
    skins = (Skin(), Skin(poisson_ratio=0.4), Skin(depth_mm=0.8), Skin(thickness_mm=2.4))
    for skin in (*skins, Skin(young_modulus_mpa=3.0, force_n=1.0)):
        tactile.layer.elastic_layer.elastic_layer_operator(skin, 16, 10.0, coarse=2)
    assert len(list(folder.iterdir())) == len(skins)


def test_the_folder_is_the_named_one_or_the_users(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv("RETOUCH_CACHE", str(tmp_path / "named"))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "user"))
    assert cache_folder() == tmp_path / "named"
    monkeypatch.delenv("RETOUCH_CACHE")
    assert cache_folder() == tmp_path / "user" / "retouch"
    monkeypatch.delenv("XDG_CACHE_HOME")
    assert cache_folder() == Path.home() / ".cache" / "retouch"


BUILDS = """
import sys, time
from pathlib import Path
import numpy as np
from relief.ground.cache import cached

def inner():
    return {"values": np.zeros(2)}

def build():
    with open(sys.argv[1], "a") as log:
        print("built", file=log)
    cached("within", {}, inner, {"values": ((2,), "<f8")})
    time.sleep(0.5)
    return {"values": np.ones(2)}

while not Path(sys.argv[2]).exists():
    time.sleep(0.001)
assert cached("thing", {}, build, {"values": ((2,), "<f8")})["values"].sum() == 2.0
"""


@pytest.mark.slow
def test_processes_that_need_the_same_arrays_at_once_build_them_once(tmp_path: Path) -> None:
    log, start = tmp_path / "log", tmp_path / "start"
    environment = os.environ | {"RETOUCH_CACHE": str(tmp_path / "cache"), "PYTHONPATH": str(REPOSITORY)}
    command = [sys.executable, "-c", BUILDS, str(log), str(start)]
    processes = [subprocess.Popen(command, env=environment) for _ in range(3)]
    time.sleep(1.0)
    start.touch()
    assert [process.wait() for process in processes] == [0, 0, 0]
    assert log.read_text() == "built\n"
    assert {path.suffix for path in (tmp_path / "cache").iterdir()} == {".safetensors"}
