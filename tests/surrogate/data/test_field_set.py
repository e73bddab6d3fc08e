"""A data set says what it holds, and is not believed before it is checked."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from safetensors.numpy import load_file, save_file

from relief.ground.errors import InputError
from relief.ground.files import write_atomically
from surrogate.corpus.manifest import entry
from surrogate.corpus.recipes import Recipe, heights, recipes
from surrogate.data.field_set import open_fieldset, shard_path, text_of_failures
from surrogate.data.request import DATASET_FILE, DatasetRequest, read_request, text_of_request
from surrogate.data.shard import DOUBLE, SINGLE, Failure, ShardRow, layout, open_shard, shard_bytes

SIDE = 16
REQUEST = DatasetRequest(
    seed=4,
    count=6,
    procedural_share=1.0,
    sources="0" * 64,
    optimised="0" * 64,
    total=6,
    samples=SIDE,
    size_mm=10.0,
    touch="layer",
    skin={"force_n": 10.0},
    lights="random",
    directions=2,
    scene="1" * 64,
    strata=12,
    versions={"numpy": "2"},
    shard_size=4,
)
TEXTURES = list(recipes(REQUEST.seed, REQUEST.count))


def content(number: int, left_out: int | None = None) -> bytes:
    """A shard with numbers of no meaning."""
    held: list[tuple[int, Recipe]] = [(k, TEXTURES[k]) for k in REQUEST.places(number) if k != left_out]
    reliefs = [heights(texture, samples=SIDE) for _, texture in held]
    rows = tuple(ShardRow(k, entry(t, h)) for (k, t), h in zip(held, reliefs, strict=True))
    lost = tuple(Failure(k, TEXTURES[k].source, "no") for k in REQUEST.places(number) if k == left_out)
    random = np.random.default_rng(number)
    tensors = {
        name: random.uniform(size=shape).astype(kind)
        for name, (shape, kind) in layout(REQUEST, len(rows)).items()
    }
    return shard_bytes(REQUEST, number, rows, lost, tensors | {"heights": np.array(reliefs)})


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    write_atomically(tmp_path / DATASET_FILE, text_of_request(REQUEST).encode())
    write_atomically(shard_path(tmp_path, 0), content(0, left_out=2))
    write_atomically(shard_path(tmp_path, 1), content(1))
    return tmp_path


def test_a_data_set_is_read_as_it_was_written(folder: Path) -> None:
    found = open_fieldset(folder)
    assert found.request == REQUEST and len(found.shards) == found.request.shards
    assert [row.index for shard in found.shards for row in shard.rows] == [0, 1, 3, 4, 5]
    assert found.failures() == [Failure(2, TEXTURES[2].source, "no")]
    for shard in found.shards:
        for name, (shape, kind) in layout(REQUEST, len(shard.rows)).items():
            values = shard.read(name)
            assert values.shape == shape and values.dtype == kind
        for row, relief in zip(shard.rows, shard.read("heights"), strict=True):
            assert row.entry == entry(TEXTURES[row.index], relief)


def test_every_texture_is_in_the_split_of_its_source(folder: Path) -> None:
    found = open_fieldset(folder)
    shard = found.shards[1]
    for split in ("train", "validation", "test"):
        of_split = [k for k, row in enumerate(shard.rows) if TEXTURES[row.index].split == split]
        assert shard.places(split).tolist() == of_split
        np.testing.assert_array_equal(shard.read("gap", shard.places(split)), shard.read("gap")[of_split])
    assert found.count() == sum(found.count(split) for split in ("train", "validation", "test")) == 5


def test_the_same_shard_is_the_same_file() -> None:
    assert content(0) == content(0)


def test_a_data_set_that_is_not_finished_says_so(folder: Path) -> None:
    shard_path(folder, 0).unlink()
    found = open_fieldset(folder)
    assert len(found.shards) < found.request.shards and [shard.number for shard in found.shards] == [1]


def test_a_shard_is_not_written_with_other_tensors_or_without_numbers() -> None:
    good = {name: np.zeros(shape, kind) for name, (shape, kind) in layout(REQUEST, 0).items()}
    for bad in (
        {name: good[name] for name in good if name != "gap"},
        good | {"gap": np.zeros((1, SIDE, SIDE), SINGLE)},
        good | {"gap": np.zeros((0, SIDE, SIDE), DOUBLE)},
    ):
        with pytest.raises(ValueError, match="gap"):
            shard_bytes(REQUEST, 0, (), (), bad)
    one = replace(REQUEST, touch="none", lights="none")
    with pytest.raises(ValueError, match="finite"):
        shard_bytes(
            one,
            0,
            (ShardRow(0, entry(TEXTURES[0], np.zeros((SIDE, SIDE), SINGLE))),),
            (),
            {"heights": np.full((1, SIDE, SIDE), np.nan, SINGLE)},
        )


def told(path: Path) -> dict[str, Any]:
    size = int.from_bytes(path.read_bytes()[:8], "little")
    header = json.loads(path.read_bytes()[8 : 8 + size])
    return json.loads(header["__metadata__"]["shard"])


def spoilt(path: Path, spoil: Callable[[dict[str, Any], dict[str, Any]], object]) -> None:
    """Write a shard anew, with something changed in its tensors or in what it tells."""
    tensors, metadata = load_file(path), told(path)
    spoil(tensors, metadata)
    save_file(tensors, path, {"shard": json.dumps(metadata)})


SPOILERS: dict[str, tuple[Callable[[dict[str, Any], dict[str, Any]], object], str]] = {
    "a tensor is missing": (lambda t, m: t.pop("gap"), "gap: missing"),
    "a tensor too many": (lambda t, m: t.update(extra=np.zeros(3)), "extra: no such tensor"),
    "another shape": (lambda t, m: t.update(gap=t["gap"][:, 1:].copy()), "gap: F32"),
    "another type": (lambda t, m: t.update(gap=t["gap"].astype(np.float64)), "gap: F64"),
    "another number": (lambda t, m: m.update(number=1), "number: 1, expected 0"),
    "a key too many": (lambda t, m: m.update(more=1), "shard: more: "),
    "rows that are none": (lambda t, m: m.update(rows={}), "shard: rows: "),
    "a row that is none": (lambda t, m: m["rows"].__setitem__(1, [1]), "shard: rows.1"),
    "a row twice": (lambda t, m: m["rows"].__setitem__(1, m["rows"][0]), "rows: are not the textures"),
    "a texture that is none": (lambda t, m: m["rows"][0].__setitem__(1, "{}"), "shard: rows.0: "),
    "a false split": (
        lambda t, m: m["rows"][0].__setitem__(
            1, json.dumps(json.loads(m["rows"][0][1]) | {"split": "holdout"})
        ),
        "shard: rows.0: split",
    ),
    "a failure that is none": (lambda t, m: m.update(failures=[{"index": -1}]), "shard: failures.0.index: "),
}


@pytest.mark.parametrize("spoiler", SPOILERS)
def test_a_bad_shard_is_refused_by_file_and_field(folder: Path, spoiler: str) -> None:
    spoil, complaint = SPOILERS[spoiler]
    path = shard_path(folder, 0)
    spoilt(path, spoil)
    with pytest.raises(InputError) as caught:
        open_fieldset(folder)
    message = str(caught.value)
    assert message.startswith(f"{path}: ") and complaint in message and "\n" not in message


@pytest.mark.parametrize(
    "bytes_", [b"", b"x" * 100, b"\xff" * 8 + b"{}", (2).to_bytes(8, "little") + b"[]"], ids=len
)
def test_what_is_no_shard_is_refused(folder: Path, bytes_: bytes) -> None:
    shard_path(folder, 1).write_bytes(bytes_)
    with pytest.raises(InputError, match=r"00001\.safetensors: "):
        open_fieldset(folder)


def test_a_shard_cut_short_is_refused(folder: Path) -> None:
    path = shard_path(folder, 1)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(InputError, match=r"00001\.safetensors: "):
        open_shard(path, REQUEST, 1)


def test_a_shard_without_what_it_tells_is_refused(folder: Path) -> None:
    path = shard_path(folder, 0)
    save_file(load_file(path), path)
    with pytest.raises(InputError, match="shard: Invalid JSON"):
        open_fieldset(folder)


def test_values_that_are_not_finite_are_refused_when_read(folder: Path) -> None:
    path = shard_path(folder, 0)
    spoilt(path, lambda tensors, _: tensors["gap"].__setitem__((1, 2, 3), np.inf))
    shard = open_fieldset(folder).shards[0]
    assert np.isfinite(shard.read("gap", np.array([0]))).all()
    with pytest.raises(InputError, match="gap: not every value is finite"):
        shard.read("gap")


@pytest.mark.parametrize(
    ("name", "value"), [("heights", 500.0), ("heights", -0.1), ("contact_fraction", 1.5), ("toward", 2.0)]
)
def test_values_out_of_range_are_refused_whoever_sealed_them(folder: Path, name: str, value: float) -> None:
    path, (shard, _) = shard_path(folder, 0), open_fieldset(folder).shards
    tensors = load_file(path)
    tensors[name].flat[0] = value
    path.write_bytes(shard_bytes(REQUEST, 0, shard.rows, shard.failures, tensors))
    with pytest.raises(InputError, match=f"{name}: not every value is from"):
        open_fieldset(folder).shards[0].read(name)


def test_a_flipped_bit_is_found_where_it_is_read(folder: Path) -> None:
    path = shard_path(folder, 0)
    whole = path.read_bytes()
    names = list(layout(REQUEST, 0))
    for place in (*range(8, 3000, 131), *np.linspace(3000, len(whole) - 1, 60).astype(int)):
        flipped = bytearray(whole)
        flipped[place] ^= 1 << place % 8
        path.write_bytes(flipped)
        with pytest.raises(InputError) as caught:  # noqa: PT012  # where the bit is decides which of them raises
            shard = open_fieldset(folder).shards[0]
            for name in names:
                shard.read(name)
        message = str(caught.value)
        assert message.startswith(f"{path}: ") and "retouch dataset" in message and "\n" not in message


def test_a_texture_that_is_whole_is_read_beside_a_damaged_one(folder: Path) -> None:
    path = shard_path(folder, 0)
    spoilt(path, lambda tensors, _: tensors["gap"].__setitem__((1, 2, 3), 0.5))
    shard = open_fieldset(folder).shards[0]
    assert shard.read("gap", np.array([2, 0])).shape == (2, SIDE, SIDE)
    assert shard.read("gap", np.array([], dtype=int)).shape == (0, SIDE, SIDE)
    for places in (slice(None), np.array([0, 1])):
        with pytest.raises(InputError, match="gap: damaged"):
            shard.read("gap", places)


def test_checksums_that_are_missing_are_told(folder: Path) -> None:
    for spoil in (
        lambda _, header: header.pop("checksums"),
        lambda _, header: header["checksums"].pop("gap"),
        lambda _, header: header["checksums"]["gap"].pop(),
    ):
        whole = shard_path(folder, 0).read_bytes()
        spoilt(shard_path(folder, 0), spoil)
        with pytest.raises(InputError, match=r"00000\.safetensors: shard: "):
            open_fieldset(folder)
        shard_path(folder, 0).write_bytes(whole)


SETTINGS: dict[str, tuple[Any, str]] = {
    "text for a number": ({"seed": "4"}, "seed"),
    "another format": ({"format": 1}, "format"),
    "an unknown key": ({"colour": 1}, "colour"),
    "an unknown model": ({"touch": "net"}, "touch"),
    "shards without end": ({"shard_size": 10**9}, "shard_size"),
    "less than nothing": ({"count": -1}, "count"),
    "fewer than drawn": ({"total": 5}, "total"),
    "no number": ({"size_mm": float("nan")}, "size_mm"),
}


@pytest.mark.parametrize("case", SETTINGS)
def test_a_bad_dataset_json_is_refused_by_file_and_field(folder: Path, case: str) -> None:
    change, field = SETTINGS[case]
    values = json.loads((folder / DATASET_FILE).read_text(encoding="utf-8")) | change
    (folder / DATASET_FILE).write_text(json.dumps(values), encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_request(folder)
    assert str(caught.value).startswith(f"{folder / DATASET_FILE}: ")
    assert field in str(caught.value) or case == "no number"


def test_a_folder_that_is_no_data_set_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=DATASET_FILE):
        open_fieldset(tmp_path)


def test_failures_are_one_line_of_json_each() -> None:
    failures = [Failure(2, "knit/0", "no"), Failure(3, "knit/1", "contact: never")]
    lines = text_of_failures(failures).splitlines()
    assert [Failure(**json.loads(line)) for line in lines] == failures
