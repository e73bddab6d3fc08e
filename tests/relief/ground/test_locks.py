"""A folder has one writer at a time, and the lock of a writer that was killed is gone."""

import errno
import fcntl
import os
import subprocess
import sys
from pathlib import Path

import pytest

from relief.ground.errors import InputError
from relief.ground.files import lock_holder, only_writer

HOLDER = """
import sys
from pathlib import Path
from relief.ground.files import only_writer
with only_writer(Path(sys.argv[1])):
    print("held", flush=True)
    sys.stdin.read()
"""


def taken(folder: Path) -> bool:
    try:
        with only_writer(folder):
            return False
    except InputError as error:
        return str(error) == f"{folder}: another command is writing into this folder"


def test_a_second_writer_is_refused_until_the_first_is_done(tmp_path: Path) -> None:
    folder = tmp_path / "new" / "run"
    with only_writer(folder), only_writer(tmp_path / "other"):
        assert taken(folder)
        (tmp_path / "link").symlink_to(folder)
        with pytest.raises(InputError), only_writer(tmp_path / "link"):
            pass
    assert not taken(folder)
    assert list(folder.iterdir()) == []


def test_the_lock_dies_with_its_process(tmp_path: Path) -> None:
    command = [sys.executable, "-c", HOLDER, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout is not None and holder.stdout.readline() == "held\n"
        assert taken(tmp_path)
        holder.kill()
        holder.wait()
        assert not taken(tmp_path)


def test_the_holder_of_a_lock_is_found(tmp_path: Path) -> None:
    command = [sys.executable, "-c", HOLDER, str(tmp_path)]
    assert lock_holder(tmp_path) is None and lock_holder(tmp_path / "missing") is None
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True) as holder:
        assert holder.stdout is not None and holder.stdout.readline() == "held\n"
        with only_writer(tmp_path / "other"):
            assert lock_holder(tmp_path) == holder.pid and lock_holder(tmp_path / "other") == os.getpid()
        holder.kill()
        holder.wait()
        assert lock_holder(tmp_path) is None


def test_a_file_is_no_folder(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="file: is a file, not a folder"), only_writer(tmp_path / "file"):
        pass


def test_a_file_system_without_locks_is_written_all_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def none(*_: object) -> None:
        raise OSError(errno.ENOLCK, os.strerror(errno.ENOLCK))

    monkeypatch.setattr(fcntl, "flock", none)
    assert not taken(tmp_path)
    monkeypatch.setitem(sys.modules, "fcntl", None)
    assert not taken(tmp_path)
