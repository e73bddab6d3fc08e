"""`retouch evaluate --readouts`: beside roughness, of the same presses, only where asked for."""

import io
import json
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

import retouch
from relief.ground.errors import InputError
from relief.heightmap import save_heights_exr
from relief.places import places
from retouch.commands.evaluate import table
from retouch.commands.main import BAD_INPUT, main
from tactile import measures
from tactile.readouts import READ_OUTS


def waves(n: int = 32, periods: int = 5) -> np.ndarray:
    at = np.sin(2.0 * np.pi * periods * (np.arange(n) + 0.5) / n)
    return 0.2 * (1.0 + np.outer(at, at))


@pytest.fixture(autouse=True)
def _reliefs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """In an empty working directory: waves, and the same a tenth as high."""
    monkeypatch.chdir(tmp_path)
    save_heights_exr("one.exr", waves(), 10.0)
    save_heights_exr("low.exr", 0.1 * waves(), 10.0)


def printed(capsys: pytest.CaptureFixture[str], *argv: str) -> str:
    assert main([*argv]) == 0
    return capsys.readouterr().out


def test_they_come_beside_the_same_numbers_where_asked_for(capsys: pytest.CaptureFixture[str]) -> None:
    plain = json.loads(printed(capsys, "evaluate", "one.exr", "low.exr", "--json"))
    asked = json.loads(printed(capsys, "evaluate", "one.exr", "low.exr", "--readouts", "--json"))
    felt = [entry.pop("readouts") for entry in asked]
    assert plain == asked
    assert [list(each) for each in felt] == [list(READ_OUTS)] * 2
    for name, one in READ_OUTS.items():
        assert felt[0][name]["value"] > felt[1][name]["value"]
        assert (felt[0][name]["unit"], felt[0][name]["source"]) == (one.unit, one.source)


def test_a_person_reads_a_table_with_sources(capsys: pytest.CaptureFixture[str]) -> None:
    text = printed(capsys, "evaluate", "one.exr", "low.exr", "--readouts")
    value = retouch.evaluate("one.exr", readouts=True).readouts["surface_coarse_um"]
    for out in READ_OUTS.values():
        assert out.label in text
    line = next(line for line in text.splitlines() if READ_OUTS["surface_coarse_um"].label in line)
    assert f"µm   {value:.1f}".split() == line[len(READ_OUTS["surface_coarse_um"].label) + 1 :].split()[:2]
    assert len(line.rstrip()) <= 80
    assert all(text.count(out.source) == 1 for out in READ_OUTS.values())
    assert "read-out" not in printed(capsys, "evaluate", "one.exr")


def test_names_and_numbers_fit_80_columns(tmp_path: Path) -> None:
    save_heights_exr("wide.exr", np.tile(waves(), (2, 2)), 20.0)
    felt = [retouch.evaluate(tmp_path / "wide.exr")] * 2
    shown = io.StringIO()
    Console(width=80, file=shown).print(table(felt))
    assert "…" not in shown.getvalue() and "\n/" in shown.getvalue()


def test_they_are_means_over_the_places() -> None:
    plate = retouch.Relief.of(np.tile(waves(), (2, 2)), 20.0)
    whole = retouch.evaluate(plate, readouts=True)
    each = [
        measures.measure_touch(
            plate, retouch.Skin(), "layer", at=np.array([at]), readouts=(READ_OUTS["strain_deviation"],)
        ).readouts["strain_deviation"]
        for at in places(plate.surface)
    ]
    assert len(each) > 1
    assert whole.readouts["strain_deviation"] == pytest.approx(float(np.mean(each)))


def test_of_fine_plates_they_are_of_the_places_pressed_with_all_samples(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    plate = retouch.Relief.of(np.tile(waves(140), (2, 2))[:240, :240], 240 / 14.0)
    several = len(places(plate.surface))
    monkeypatch.setattr(measures, "MOST_SAMPLES", several * 140**2 - 1)
    monkeypatch.setattr(measures, "FULL_SAMPLES", 2 * 140**2)
    felt = retouch.evaluate(plate, readouts=True)
    assert isinstance(felt.touch, measures.TouchMeasures) and felt.touch.subsample is not None
    assert all(len(values) == 2 for values in felt.touch.readouts.values())
    assert READ_OUTS.keys().isdisjoint(felt.touch.subsample.standard_errors)


@pytest.mark.parametrize("name", ["part.stl", "part.gcode"])
def test_print_files_are_refused_in_one_line(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    Path(name).write_text("")
    assert main(["evaluate", name, "--readouts"]) == BAD_INPUT
    said = capsys.readouterr().err
    assert said == "retouch: --readouts: is for height maps; print files and G-code are felt as they are\n"


def test_print_files_and_slicers_are_refused_from_python() -> None:
    assert main(["export", "one.exr", "-o", "plate.stl"]) == 0
    with pytest.raises(InputError, match=r"^readouts: is for height maps; a print file is felt as it is$"):
        retouch.evaluate("plate.stl", readouts=True)
    with pytest.raises(InputError, match="readouts: is for textures that are not sliced"):
        retouch.evaluate("one.exr", profile="fine.ini", readouts=True)
