"""`retouch dataset` makes what its help says, and tells what is wrong in one line."""

import json
from pathlib import Path

import numpy as np
import pytest

from relief.heightmap import save_heights_png
from retouch.commands import dataset as cli_dataset
from retouch.commands.main import main
from retouch.laboratory.workers import cluster
from surrogate.data.field_set import open_fieldset
from surrogate.data.shard import Failure

FEW = ["--count", "2", "--touch", "layer", "--lights", "none", "--workers", "1"]


def refusal(capsys: pytest.CaptureFixture[str], *arguments: str) -> str:
    assert main(["dataset", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith("retouch: ") and err.count("\n") == 1
    return err


@pytest.mark.slow
def test_it_makes_a_data_set_and_says_so(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "data"
    assert main(["dataset", "-o", str(out), *FEW]) == 0
    told, shown = capsys.readouterr()
    assert told == f"{out}: 2 textures with their fields, 0 without\n"
    assert "shard 0: 2 of 2 textures\n" in shown
    found = open_fieldset(out)
    assert len(found.shards) == found.request.shards
    assert found.request.touch == "layer" and found.request.samples == 128
    assert main(["dataset", "-o", str(out), "-q", *FEW]) == 0
    assert capsys.readouterr() == ("", "")
    assert main(["dataset", "-o", str(out), "--json", *FEW]) == 0
    assert json.loads(capsys.readouterr().out) == {"folder": str(out), "textures": 2, "failures": []}


@pytest.mark.slow
def test_textures_are_cut_from_the_users_pictures(tmp_path: Path) -> None:
    folder = tmp_path / "materials"
    folder.mkdir()
    for number in range(40):
        relief = np.random.default_rng(number).uniform(0, 1, (48, 64))
        save_heights_png(folder / f"stone{number}.png", relief, 1.0)
    arguments = ["-o", str(tmp_path / "data"), "--textures", str(folder), "-q"]
    assert main(["dataset", *arguments, *FEW, "--count", "12"]) == 0
    sources = {row.entry.texture.source for row in open_fieldset(tmp_path / "data").shards[0].rows}
    assert any(source.startswith("file/") for source in sources)


def test_textures_without_fields_are_told_and_change_the_exit_status(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "retouch.verbs.learning.make_dataset",
        lambda *_: [Failure(k, "knit/0", "no luck") for k in range(7)],
    )
    assert main(["dataset", "-o", str(tmp_path), *FEW]) == cli_dataset.WITH_FAILURES
    err = capsys.readouterr().err.splitlines()
    assert err[0] == "texture 0 (knit/0): no luck"
    assert len(err) == cli_dataset.MOST_SHOWN + 1 and "failures.jsonl" in err[-1]


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--count", "0"], "--count"),
        (["--count", "2", "--samples", "9"], "--samples"),
        (["--count", "2", "--touch", "net"], "--touch"),
        (["--count", "2", "--lights", "studio", "--directions", "4"], "--directions"),
        (["--count", "2", "--lights", "none", "--touch", "none"], "no field is left"),
        (["--count", "2", "--textures", "nowhere"], "nowhere: no such folder"),
        (["--count", "2", "--optimised", "nowhere"], "nowhere/manifest.jsonl"),
    ],
)
def test_bad_arguments_are_told_in_one_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], arguments: list[str], complaint: str
) -> None:
    assert complaint in refusal(capsys, "-o", str(tmp_path / "data"), *arguments)
    assert not (tmp_path / "data").exists()


def test_a_bad_picture_is_told_before_any_work(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "broken.png").write_bytes(b"no picture")
    line = refusal(capsys, "-o", str(tmp_path / "data"), *FEW, "--textures", str(tmp_path))
    assert "broken.png" in line and not (tmp_path / "data").exists()


@pytest.mark.slow
def test_another_data_set_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["dataset", "-o", str(tmp_path / "data"), "-q", *FEW]) == 0
    assert "count: 2, not 1" in refusal(capsys, "-o", str(tmp_path / "data"), *FEW, "--count", "1")
    assert "seed: 0, not 7" in refusal(capsys, "-o", str(tmp_path / "data"), *FEW, "--seed", "7")


def test_without_dask_it_is_said_how_to_get_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(__import__("sys").modules, "distributed", None)
    line = refusal(capsys, "-o", str(tmp_path / "data"), *FEW, "--dask", "local")
    assert cluster.WITHOUT_DASK in line
