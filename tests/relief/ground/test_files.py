"""A file appears whole or not at all."""

import errno
import os
import subprocess
import sys
from pathlib import Path

import pytest

from relief.ground.files import partial_file, partial_folders, remove_partial, write_atomically

ROOT = Path(__file__).resolve().parents[3]


def test_a_file_comes_with_its_folder_and_replaces_an_earlier_one(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "numbers.bin"
    for content in (b"first", b"second"):
        write_atomically(path, content)
        assert path.read_bytes() == content
    assert list(path.parent.iterdir()) == [path]


def test_a_failed_block_leaves_the_earlier_file_alone(tmp_path: Path) -> None:
    path = tmp_path / "numbers.bin"
    path.write_bytes(b"earlier")

    def stop_half_way() -> None:
        with partial_file(path) as partial:
            partial.write_bytes(b"half")
            assert (partial.name, path.read_bytes()) == (path.name, b"earlier")
            raise ValueError("half way")

    with pytest.raises(ValueError, match="half way"):
        stop_half_way()
    assert path.read_bytes() == b"earlier" and list(tmp_path.iterdir()) == [path]


def test_an_error_of_a_temporary_file_names_the_file(tmp_path: Path) -> None:
    path = tmp_path / "numbers.bin"

    def fill_the_disk(filename: str | None) -> None:
        with partial_file(path) as partial:
            raise OSError(errno.ENOSPC, "full", filename and str(partial))

    for filename in (None, "partial"):
        with pytest.raises(OSError, match="full") as caught:
            fill_the_disk(filename)
        assert caught.value.filename == str(path) and list(tmp_path.iterdir()) == []


def test_what_a_killed_process_left_is_known_and_removed(tmp_path: Path) -> None:
    script = """
import os, sys
from relief.ground.files import partial_file
with partial_file(sys.argv[1]) as partial:
    partial.write_bytes(b"half")
    os._exit(9)
"""
    path, other = tmp_path / "numbers.bin", tmp_path / ".mine"
    other.mkdir()
    subprocess.run([sys.executable, "-c", script, str(path)], cwd=ROOT, check=False)
    assert len(partial_folders(tmp_path)) == 1 and not path.exists()
    remove_partial(tmp_path, older_than_s=1000.0)
    assert len(partial_folders(tmp_path)) == 1
    remove_partial(tmp_path)
    assert list(tmp_path.iterdir()) == [other]
    remove_partial(tmp_path / "missing")


def test_the_next_writer_removes_what_a_killed_one_left_but_not_what_is_at_work(tmp_path: Path) -> None:
    path = tmp_path / "num[b]ers.bin"
    left = tmp_path / ".num[b]ers-00000000.partial"
    left.mkdir()
    (left / path.name).write_bytes(b"half")
    with partial_file(path) as partial:
        partial.write_bytes(b"first")
        for folder in (left, partial.parent):
            os.utime(folder, (0.0, 0.0))
        write_atomically(path, b"second")
        assert {*tmp_path.iterdir()} == {path, partial.parent} and path.read_bytes() == b"second"
    assert list(tmp_path.iterdir()) == [path] and path.read_bytes() == b"first"


def test_others_may_read_what_is_written_as_they_may_read_any_file(tmp_path: Path) -> None:
    (tmp_path / "plain").write_bytes(b"")
    write_atomically(tmp_path / "atomic", b"")
    assert (tmp_path / "atomic").stat().st_mode == (tmp_path / "plain").stat().st_mode


def test_the_choice_of_a_library_needs_no_arrays() -> None:
    modules = "relief.ground.files, relief.ground.errors, relief.ground.limits"
    script = f"import {modules}, sys; print('numpy' in sys.modules)"
    process = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert process.stdout.strip() == "False"
