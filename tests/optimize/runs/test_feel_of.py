"""The feel of another relief as a target: whose it is, what it is, and what is refused."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from optimize.runs.feel_of import name_of
from optimize.settings.run_file import Run, dump_resolved, load_run, run_from_scene
from relief.heightmap import save_heights_exr
from relief.relief import Relief
from retouch.commands.main import main
from retouch.laboratory.studies.row_key import row_key
from retouch.verbs import runs
from tactile.measures import measure_touch
from tactile.quantities import CONTACT_AREA, ROUGHNESS
from tactile.skin import Skin
from tests.tactile.reliefs import waves

SAMPLES = 32
QUICK = (
    *("define.resolution=32", "touch.model=quick", "verify.model=layer", "verify.baseline=false"),
    *("verify.samples=4", "descent.tolerance=0.02"),
)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working directory: waves, lower waves, and what nobody can take the feel of."""
    monkeypatch.chdir(tmp_path)
    high, low = waves(SAMPLES, 1.5).numpy(), waves(SAMPLES, 1.2).numpy()
    save_heights_exr("waves.exr", high)
    save_heights_exr("low.exr", low)
    save_heights_exr("flat.exr", np.zeros((SAMPLES, SAMPLES)))
    save_heights_exr("smooth.exr", 0.002 * high)
    save_heights_exr("small.exr", high, 6.0)
    save_heights_exr("seam.exr", high + np.linspace(0.0, 1.0, SAMPLES))
    Image.fromarray(np.uint8(255.0 * low / low.max())).save("bare.png")
    Path("empty").mkdir()
    Path("begun").mkdir()
    Path("begun/run.toml").write_text("")
    Path("cut.exr").write_bytes(Path("low.exr").read_bytes()[:300])
    return tmp_path


def run_of(studio: Path, *settings: str) -> Run:
    return run_from_scene(studio, "waves.exr", [*QUICK, *settings])


@pytest.mark.slow
@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize("of", ["roughness", "contact-area"])
def test_the_other_feel_is_reached_and_named(
    studio: Path, capfd: pytest.CaptureFixture[str], of: str
) -> None:
    settings = [part for setting in QUICK for part in ("--set", setting)]
    arguments = ["waves.exr", "--feel-of", "low.exr", "--feel-of-quantity", of, "-o", "out", *settings]
    assert main(["optimize", *arguments, "--scene", str(studio)]) == 0
    printed = capfd.readouterr()
    low = measure_touch(Relief(waves(SAMPLES, 1.2).numpy(), 10.0), Skin(), "quick").means
    quantity, untouched = (ROUGHNESS, CONTACT_AREA) if of == "roughness" else (CONTACT_AREA, ROUGHNESS)
    assert f"the feel of low: {quantity.label} {quantity.text(low[quantity.name])}" in printed.err
    assert "target (the feel of low)" in printed.out
    touch = json.loads(Path("out/result.json").read_text())["touch"]
    assert touch[f"target_{quantity.name}"] == pytest.approx(low[quantity.name], rel=1e-3)
    assert touch[f"verified_{quantity.name}"] == pytest.approx(low[quantity.name], rel=0.02)
    assert f"target_{untouched.name}" not in touch or touch[f"target_{untouched.name}"] is None
    assert touch["feel_of"]["name"] == "low"
    assert touch["feel_of"]["quantities"] == [quantity.name]
    report = Path("out/report.html").read_text("utf-8")
    assert ", the feel of low, original" in report
    assert (" as low feels," in report) == (of == "roughness")
    # The result of a run is another relief like any.
    again = run_of(studio, "touch.feel_of=out")
    assert again.touch.feel_of == Path("out/heights.exr").absolute()
    assert name_of(again.touch.feel_of) == "out"
    assert again.touch.feel_of_repeats is False
    # A run does not replace the result whose feel it takes.
    assert main(["optimize", "waves.exr", "--feel-of", "out", "-o", "out", "--force", *settings]) == 2
    assert "which the run reads; choose another folder" in capfd.readouterr().err


def test_a_run_file_names_it_from_its_own_folder(studio: Path, folder: Path) -> None:
    begin = f'scene = "{studio}"\ntexture = "waves.exr"\n[touch]\n'
    (folder / "run.toml").write_text(begin + 'feel_of = "low.exr"\nfeel_of_quantity = "both"\n')
    run = load_run(folder / "run.toml")
    assert run.touch.feel_of == folder / "low.exr"
    assert run.touch.feel_of_quantities == (ROUGHNESS, CONTACT_AREA)
    (folder / "again.toml").write_text(dump_resolved(run))
    assert load_run(folder / "again.toml") == run
    # A number on the command line replaces it, and it replaces a number.
    assert load_run(folder / "run.toml", ["touch.jnd=2"]).touch.feel_of is None
    (folder / "number.toml").write_text(begin + "jnd = 2\n")
    other = load_run(folder / "number.toml", ["touch.feel_of=brick"]).touch
    assert other.feel_of is not None
    assert (other.feel_of.name, other.numbers()) == ("brick.png", {})


@pytest.mark.usefixtures("folder")
def test_the_row_of_a_study_is_known_by_the_other_s_content(studio: Path) -> None:
    key = row_key(run_of(studio, "touch.feel_of=low.exr"))
    Path("moved.exr").write_bytes(Path("low.exr").read_bytes())
    assert row_key(run_of(studio, "touch.feel_of=moved.exr")) == key
    assert row_key(run_of(studio, "touch.feel_of=seam.exr")) != key


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--feel-of absent.exr", "absent.exr: no such file"),
        ("--feel-of bric", "bric: no such file; those that come with Retouch are .*brick.png"),
        ("--feel-of cut.exr", r"touch.feel_of: .*cut.exr"),
        ("--feel-of flat.exr", r"touch.feel_of: .*flat.exr: is flat"),
        ("--feel-of small.exr", r"presses on 6 mm of it and on 10 mm of this texture"),
        ("--feel-of waves.exr", r"touch.feel_of: .*waves.exr: is this texture itself"),
        ("--feel-of smooth.exr", r"smooth.exr: .* the nearest that a run takes is"),
        ("--feel-of bare.png", r"touch.feel_of: .*bare.png: --feel-of-relief-mm: missing"),
        ("--feel-of low.exr --feel-of-relief-mm 1", "--feel-of-relief-mm: is for pictures"),
        ("--feel-of empty", r"touch.feel_of: .*empty: a folder without run.toml"),
        ("--feel-of begun", r"begun/heights.exr: no such file; the run has no result yet"),
        ("--feel-of low.exr --jnd 2", "jnd and feel_of exclude each other"),
        (
            "--feel-of low.exr --feel-of-quantity both --contact-area-scale 2",
            "contact_area_scale and feel_of exclude",
        ),
        ("--feel-of-quantity both --jnd 1", "--feel-of-quantity: is for feel_of, which is missing"),
        (
            "--feel-of seam.exr --set touch.feel_of_repeats=true",
            r"--set touch.feel_of_repeats=true: .*sides do not fit",
        ),
    ],
)
def test_what_cannot_be_taken_over_is_told_in_one_line(
    studio: Path, capfd: pytest.CaptureFixture[str], options: str, words: str
) -> None:
    settings = [part for setting in QUICK for part in ("--set", setting)]
    arguments = ["waves.exr", "--scene", str(studio), "-o", "out", *options.split(), *settings]
    assert main(["optimize", *arguments]) == 2
    (line,) = [each for each in capfd.readouterr().err.splitlines() if each.startswith("retouch: ")]
    assert re.search(words, line), line
    assert not Path("out").exists()


@pytest.mark.slow
@pytest.mark.usefixtures("folder")
def test_a_tile_is_felt_all_over(studio: Path) -> None:
    settings = ("touch.feel_of=gravel-tile", "touch.feel_of_repeats=true", "verify.corrections=0")
    result = runs.optimize(run_of(studio, *settings, "descent.steps=1"), "out")
    other = result.summary["touch"]["feel_of"]
    assert other["places"]["count"] == 16
    assert other["places"]["roughness_min"] < other["roughness"] < other["places"]["roughness_max"]
    assert result.summary["touch"]["target_roughness"] == pytest.approx(other["roughness"])
