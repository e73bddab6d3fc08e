"""Files that were dropped get names that are harmless, and none takes the place of another."""

import os
from pathlib import Path

import pytest

from relief.ground.errors import InputError
from retouch.app.values.folders import (
    PARTS_FOLDER,
    PICTURES_FOLDER,
    keep,
    next_run,
    safe_name,
    textures,
    with_plain_name,
)


@pytest.fixture(autouse=True)
def _working_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize(
    ("name", "safe"),
    [
        ("stone.JPG", "stone.jpg"),
        ("../../etc/stone.png", "stone.png"),
        ("C:\\pictures\\stone.png", "stone.png"),
        ("<script>alert(1)</script>.png", "script.png"),
        ("<img src=x onerror=alert(1)>.png", "img-src-x-onerror-alert-1.png"),
        ("-o.png", "o.png"),
        (".hidden.png", "hidden.png"),
        ("pièrre été.tif", "pièrre-été.tif"),
        ("a\x00b\n.png", "a-b.png"),
        (f"{'x' * 300}.png", f"{'x' * 60}.png"),
        ("<>.png", "file.png"),
    ],
)
def test_a_name_is_made_harmless(name: str, safe: str) -> None:
    assert safe_name(name) == safe


@pytest.mark.parametrize("name", ["stone.exe", "stone", ".png", "", "stone.png.html", "part.stl", "....png"])
def test_what_is_no_picture_is_refused(name: str) -> None:
    with pytest.raises(InputError, match="cannot be taken"):
        safe_name(name)


def test_a_part_is_a_mesh() -> None:
    assert safe_name("handle.STL", PARTS_FOLDER) == "handle.stl"
    with pytest.raises(InputError):
        safe_name("stone.png", PARTS_FOLDER)


def kept(content: bytes, name: str) -> Path:
    PICTURES_FOLDER.mkdir(exist_ok=True)
    upload = PICTURES_FOLDER / ".upload"
    upload.write_bytes(content)
    file = keep(upload, name, PICTURES_FOLDER)
    assert not upload.exists()
    return file


def test_another_picture_of_the_same_name_gets_a_number() -> None:
    first = kept(b"one", "stone.png")
    assert kept(b"one", "stone.png") == first
    second = kept(b"two", "stone.png")
    assert first.read_bytes() == b"one" and second.read_bytes() == b"two"


def test_a_picture_whose_name_no_page_can_show_is_copied() -> None:
    Path("stone.png").write_bytes(b"one")
    assert with_plain_name(Path("stone.png")) == Path("stone.png") and not PICTURES_FOLDER.exists()
    odd = Path(os.fsdecode(b"caf\xe9/\xff"))
    odd.mkdir(parents=True)
    (odd / "stone.png").write_bytes(b"two")
    copy = PICTURES_FOLDER / "stone.png"
    # The same at the next start.
    assert [with_plain_name(odd / "stone.png") for _ in range(2)] == [copy, copy]
    assert copy.read_bytes() == b"two" and list(PICTURES_FOLDER.iterdir()) == [copy]


def test_no_run_takes_the_place_of_another() -> None:
    first = next_run("pictures/stone.jpg")
    assert first == Path("runs/stone-1")
    Path("runs").mkdir()
    Path("runs/stone-1.png").touch()
    Path("runs/stone-2").symlink_to("nowhere")
    assert next_run("pictures/stone.jpg") == Path("runs/stone-3")
    assert next_run("gravel") == Path("runs/gravel-1")


def test_what_comes_with_retouch_can_be_chosen() -> None:
    assert len(textures()) == 12 and "gravel" in textures()
