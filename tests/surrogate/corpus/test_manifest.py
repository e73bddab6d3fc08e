"""A manifest says what a corpus holds, and is not believed before it is checked."""

import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from relief.ground.errors import InputError
from surrogate.corpus.manifest import (
    MANIFEST_FILE,
    Entry,
    entry,
    optimised,
    read,
    read_manifest,
    write_manifest,
)
from surrogate.corpus.optimised import Optimised, load, store
from surrogate.corpus.photographs import bundled
from surrogate.corpus.recipes import heights, recipes

Line = dict[str, Any]


@pytest.fixture(scope="module")
def entries() -> list[Entry]:
    return [entry(texture, heights(texture, samples=32)) for texture in recipes(9, 12, bundled())]


def line_of(line: Entry, folder: Path) -> Line:
    write_manifest(folder / MANIFEST_FILE, [line])
    return json.loads((folder / MANIFEST_FILE).read_text(encoding="utf-8"))


def test_a_manifest_is_read_as_it_was_written(tmp_path: Path, entries: list[Entry]) -> None:
    write_manifest(tmp_path / MANIFEST_FILE, entries)
    assert list(read_manifest(tmp_path / MANIFEST_FILE)) == entries
    assert [path.name for path in tmp_path.iterdir()] == [MANIFEST_FILE]


def test_heights_made_anew_are_those_of_the_checksums(tmp_path: Path, entries: list[Entry]) -> None:
    for line in entries:
        assert read(line, tmp_path).shape == (32, 32)


def test_heights_that_differ_from_the_manifest_are_refused(tmp_path: Path, entries: list[Entry]) -> None:
    other = Entry(entries[0].texture, entries[0].split, 32, entries[1].sha256)
    with pytest.raises(InputError, match="sha256"):
        read(other, tmp_path)


def test_a_manifest_cut_short_while_written_does_not_appear(tmp_path: Path, entries: list[Entry]) -> None:
    def broken() -> Iterator[Entry]:
        yield entries[0]
        raise RuntimeError("out of power")

    with pytest.raises(RuntimeError):
        write_manifest(tmp_path / MANIFEST_FILE, broken())
    assert list(tmp_path.iterdir()) == []


def test_an_optimised_texture_stays_in_the_split_of_its_origin(tmp_path: Path, entries: list[Entry]) -> None:
    relief = np.random.default_rng(0).uniform(0, 3, (16, 16)).astype(np.float32)
    texture = store(tmp_path, "gravel-rougher", relief, "scikit-image/gravel")
    write_manifest(tmp_path / MANIFEST_FILE, [*entries, entry(texture, relief)])
    (line,) = optimised(tmp_path)
    assert line.split == "test"
    np.testing.assert_array_equal(read(line, tmp_path), relief)


SPOILERS: dict[str, tuple[Callable[[Line], object], str]] = {
    "unknown key": (lambda line: line.update(colour="red"), "colour: "),
    "unknown key of the texture": (lambda line: line["texture"].update(colour="red"), "texture.colour: "),
    "missing key": (lambda line: line.pop("sha256"), "sha256: "),
    "text for a number": (lambda line: line["texture"].update(relief_mm="1"), "texture.relief_mm: "),
    "fraction for a count": (lambda line: line.update(samples=1.5), "samples: "),
    "too tall": (lambda line: line["texture"].update(relief_mm=3.5), "texture.relief_mm: "),
    "infinite": (lambda line: line["texture"].update(relief_mm=float("inf")), ""),
    "huge": (lambda line: line.update(samples=10**9), "samples: "),
    "no checksum": (lambda line: line.update(sha256="../etc"), "sha256: "),
    "a nameless split": (lambda line: line.update(split="holdout"), "split: "),
    "unknown family": (lambda line: line["texture"].update(source="marble/0"), "texture.source: "),
    "another draw": (lambda line: line["texture"].update(draw=1), "texture.source: "),
    "no texture": (lambda line: line.update(texture=[]), "texture"),
    "unknown kind": (lambda line: line["texture"].update(kind="pickle"), "texture"),
}


@pytest.mark.parametrize("spoiler", SPOILERS)
def test_a_bad_line_is_refused_by_file_line_and_field(
    tmp_path: Path, entries: list[Entry], spoiler: str
) -> None:
    spoil, field = SPOILERS[spoiler]
    procedural = next(line for line in entries if not line.texture.source.startswith("scikit-image/"))
    line = line_of(procedural, tmp_path)
    good = json.dumps(line)
    spoil(line)
    (tmp_path / MANIFEST_FILE).write_text(f"{good}\n{json.dumps(line)}\n", encoding="utf-8")
    with pytest.raises(InputError) as caught:
        list(read_manifest(tmp_path / MANIFEST_FILE))
    assert str(caught.value).startswith(f"{tmp_path / MANIFEST_FILE}: line 2: {field}")
    assert "\n" not in str(caught.value)


def test_a_training_texture_cannot_be_declared_a_test(tmp_path: Path, entries: list[Entry]) -> None:
    line = line_of(next(line for line in entries if line.split == "train"), tmp_path)
    line["split"] = "test"
    (tmp_path / MANIFEST_FILE).write_text(json.dumps(line), encoding="utf-8")
    with pytest.raises(InputError, match="split: test, but its source is in train"):
        list(read_manifest(tmp_path / MANIFEST_FILE))


@pytest.mark.parametrize(
    "path", ["../a.npy", "/tmp/a.npy", "a/../../b.npy", "C:a.npy", "a\\b.npy", "./a.npy", "a.pkl", ""]
)
def test_a_path_that_leads_elsewhere_is_refused(tmp_path: Path, path: str) -> None:
    line = line_of(Entry(Optimised("scikit-image/brick", "a.npy"), "test", 16, "0" * 64), tmp_path)
    line["texture"]["path"] = path
    (tmp_path / MANIFEST_FILE).write_text(json.dumps(line), encoding="utf-8")
    with pytest.raises(InputError, match=r"line 1: texture\.path: "):
        optimised(tmp_path)


@pytest.mark.parametrize("text", [b"not json\n", b"\xff\xfe\n", b"\n", b"[" * 3000 + b"\n", b"x" * 10**6])
def test_what_is_no_manifest_is_refused(tmp_path: Path, text: bytes) -> None:
    (tmp_path / MANIFEST_FILE).write_bytes(text)
    with pytest.raises(InputError, match="line 1: ") as caught:
        list(read_manifest(tmp_path / MANIFEST_FILE))
    assert len(str(caught.value)) < 1000


def test_a_missing_manifest_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=MANIFEST_FILE):
        optimised(tmp_path)


def test_a_link_out_of_the_folder_is_not_followed(tmp_path: Path) -> None:
    inner = tmp_path / "inner"
    store(tmp_path, "outside", np.zeros((16, 16)), "scikit-image/brick")
    inner.mkdir()
    (inner / "link.npy").symlink_to(tmp_path / "outside.npy")
    with pytest.raises(InputError, match="outside"):
        load(inner, Optimised("scikit-image/brick", "link.npy"))


@pytest.mark.parametrize(
    "values",
    [
        np.zeros((16, 16)),
        np.zeros((16, 8), dtype=np.float32),
        np.full((16, 16), 4, dtype=np.float32),
        np.full((16, 16), np.nan, dtype=np.float32),
        np.array([{}], dtype=object),
    ],
    ids=["float64", "not square", "too high", "not finite", "pickled"],
)
def test_a_file_that_is_no_height_map_is_refused(tmp_path: Path, values: Any) -> None:
    np.save(tmp_path / "a.npy", values)
    with pytest.raises(InputError, match=r"a\.npy: "):
        load(tmp_path, Optimised("scikit-image/brick", "a.npy"))
