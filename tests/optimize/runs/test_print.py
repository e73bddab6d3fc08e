"""A run with a printer compares prints: whole layers on its pixels, with the feel that was wanted."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import trimesh

import tactile
from optimize.descent.gauss_newton.terms import PATIENCE
from optimize.descent.layers import Layers
from optimize.runs import job
from optimize.runs.job import Result
from optimize.settings.run_file import Run, dump_resolved, load_run, run_from_scene
from relief.ground.errors import InputError
from relief.heightmap import load_heights
from relief.printed import faults, printed
from relief.printers import PRINTERS, Printer
from relief.relief import Relief
from relief.surface import Surface
from retouch.verbs import runs
from tactile.measures import measure_touch
from tests.optimize.conftest import SAMPLES

pytestmark = pytest.mark.slow

PRINTER = Printer("own", 312.5, 60.0, 937.5)
"""Pixels as wide as the samples of the waves; the base of 2 mm is no whole number of its layers."""
COARSE = (
    'verify.model="layer"',
    "verify.samples=16",
    "verify.baseline=false",
    f"define.resolution={SAMPLES}",
)


def settings(studio: Path, texture: Path, *overrides: str) -> Run:
    return run_from_scene(studio, texture, ["touch.jnd=1.5", 'look.model="fast"', *COARSE, *overrides])


@pytest.fixture(scope="module")
def by_printer(studio: Path, texture: Path) -> Run:
    return settings(studio, texture, "print.pixel_um=312.5", "print.layer_um=60")


@pytest.fixture(scope="module")
def result(by_printer: Run, tmp_path_factory: pytest.TempPathFactory) -> Result:
    return runs.optimize(by_printer, tmp_path_factory.mktemp("print") / "out")


def test_result_is_of_whole_layers_and_prints_as_itself(result: Result) -> None:
    layers = result.heights / PRINTER.layer_mm
    assert np.abs(layers - np.rint(layers)).max() < 1e-9
    np.testing.assert_allclose(printed(result.heights, 0.3125, PRINTER), result.heights, atol=1e-12)
    file = load_heights(result.run_dir / "heights.exr")
    np.testing.assert_allclose(file, result.heights, atol=1e-6)
    lowest = trimesh.load(result.run_dir / "plate.stl").bounds[0, 2]
    assert -lowest == pytest.approx(2.04, abs=1e-5)


def test_feel_is_reached_between_the_prints(result: Result, texture: Path) -> None:
    original = printed(load_heights(texture), 0.3125, PRINTER)
    rough = [
        measure_touch(Relief(relief, 10.0), tactile.Skin(), "layer").means["roughness"]
        for relief in (original, result.heights)
    ]
    assert result.stop.met
    assert tactile.jnd_apart(rough[1], rough[0]) == pytest.approx(1.5, abs=0.06)
    assert result.summary["touch"]["jnd_from_original"] == pytest.approx(1.5, abs=0.06)


def test_pictures_of_the_prints_change_less_than_of_a_print_of_a_free_result(
    result: Result, by_printer: Run, studio: Path, texture: Path, tmp_path: Path
) -> None:
    """A result without printer keeps its look on the screen; its steps are elsewhere than the original's."""
    free = runs.optimize(settings(studio, texture), tmp_path / "free")
    scene = job.prepare(by_printer, None).problem.scene
    original = scene.heights
    before, after, naive = (
        scene.render(relief, model="fast").numpy()
        for relief in (original, result.heights, printed(free.heights, 0.3125, PRINTER))
    )
    assert 1.3 * np.abs(after - before).mean() < np.abs(naive - before).mean()


def test_result_tells_of_the_print(result: Result) -> None:
    told = json.loads((result.run_dir / "result.json").read_text())["print"]
    assert (told["printer"], told["pixel_um"], told["layer_um"], told["min_feature_um"]) == (
        *("own", 312.5, 60.0),
        937.5,
    )
    assert told["pixels"] == [SAMPLES, SAMPLES]
    # Pixels of the picture are so wide here that an eye blurs nothing.
    change = result.summary["look"]["change_percent"]
    assert told["seen_change_percent"] == pytest.approx(change, rel=0.2)
    # Pixels are as wide as the samples: the layers alone make the difference.
    assert abs(told["design"]["jnd_of_print"]) < 1.0
    assert told["faults_after"]["too_high_mm"] == 0.0
    page = (result.run_dir / "report.html").read_text()
    assert "As printed" in page and "Design of the original" in page


def test_an_interrupted_run_goes_on_to_the_same_print(
    result: Result, by_printer: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from optimize.descent.gauss_newton.method import GaussNewton

    advance, steps = GaussNewton.advance, []

    def interrupted(self: GaussNewton, iterate: object) -> object:
        steps.append(iterate)
        if len(steps) > PATIENCE + 2:
            raise KeyboardInterrupt
        return advance(self, iterate)  # type: ignore[arg-type]

    with monkeypatch.context() as patch:
        patch.setattr(GaussNewton, "advance", interrupted)
        runs.optimize(by_printer, tmp_path / "out")
    resumed = runs.resume(tmp_path / "out")
    assert resumed.summary["stop"]["steps"] == result.summary["stop"]["steps"]
    np.testing.assert_allclose(resumed.heights, result.heights, atol=1e-9)


def test_a_run_keeps_the_slope_and_the_relief_of_its_printer(
    studio: Path, texture: Path, tmp_path: Path
) -> None:
    """The original is gentler too; target and pictures are met between two prints that can be made."""
    limited = settings(
        studio,
        texture,
        *("print.pixel_um=312.5", "print.layer_um=60", "print.keep_features=true"),
        *("print.min_feature_um=650", "print.max_slope_degrees=35", "print.max_relief_mm=1.5"),
    )
    result = runs.optimize(limited, tmp_path / "out")
    printer = limited.print.described
    assert printer is not None and result.stop.met
    assert result.summary["touch"]["jnd_from_original"] == pytest.approx(1.5, abs=0.06)
    told = result.summary["print"]
    assert told["design"]["too_steep_percent"] > 10.0
    free = printed(load_heights(texture), 0.3125, PRINTER)
    assert faults(free, 0.3125, printer)["too_steep_percent"] > 10.0
    assert np.abs(printed(load_heights(texture), 0.3125, printer) - free).max() > 0.1
    for heights, faulty in (
        (printed(load_heights(texture), 0.3125, printer), told["faults_before"]),
        (result.heights, told["faults_after"]),
    ):
        rise = np.tan(np.radians(35.0)) * 0.3125 + printer.layer_mm
        for axis in (0, 1):
            assert np.abs(np.diff(heights, axis=axis)).max() < rise
        assert faulty["too_steep_percent"] == faulty["too_high_mm"] == 0.0
        assert faulty["too_fine_percent"] < 5.0
        assert np.ptp(heights) <= 1.5
    assert "No slope exceeds 35" in (result.run_dir / "report.html").read_text()


def test_layers_move_by_whole_layers_and_stay_within_limits() -> None:
    original = np.round(np.random.default_rng(0).uniform(0, 40, (20, 20))) * 0.05
    layers = Layers(original, PRINTERS["mask-50"], Surface((20, 20), 1.0))
    moved = layers.placed(original + 0.737)
    np.testing.assert_allclose(moved, original + 0.737 - 0.75, atol=0.0130001)
    high = layers.placed(original * 4.0)
    assert high.min() >= 0.0 and high.max() <= 3.0
    np.testing.assert_allclose(layers.rounded(original), original, atol=1e-12)
    assert np.abs(layers.to_nearest(original + 0.02) + 0.02).max() < 1e-9


def test_layers_of_a_deep_relief_keep_the_slope_to_what_stays() -> None:
    rng, surface = np.random.default_rng(0), Surface((30, 30), 1.5, (True, False))
    printer = replace(PRINTERS["mask-50"], name="own", max_slope_degrees=75.0)
    down, across = (np.abs(np.arange(30) - 15.0) for _ in (0, 1))
    original = printed(
        np.maximum(5.0 - 0.3 * np.maximum(down[:, None], across), 1.0), 0.05, printer, (True, False)
    )
    low = original < original.max() - 3.0
    layers = Layers(original, printer, surface)
    np.testing.assert_array_equal(layers.rounded(original), original)
    for scale in (0.1, 2.0):
        moved = layers.placed(original + scale * rng.standard_normal(original.shape))
        made = layers.rounded(moved)
        assert low.any() and (made[low] == original[low]).all() and (moved[low] == original[low]).all()
        assert faults(made, 0.05, printer, surface.repeats)["too_steep_percent"] == 0.0
        assert (made != original)[~low].any() and made.max() <= original.max() + 1e-9


def test_named_printer_fills_in_its_numbers_and_loads_again(
    studio: Path, texture: Path, tmp_path: Path
) -> None:
    run = settings(studio, texture, 'print.printer="mask-35"')
    assert run.print.described == PRINTERS["mask-35"]
    own = settings(studio, texture, 'print.printer="mask-35"', "print.layer_um=25")
    assert own.print.printer == "own"
    assert own.print.layer_um == 25.0 and own.print.pixel_um == 35.0
    for each in (run, own, settings(studio, texture)):
        file = tmp_path / "run.toml"
        file.write_text(dump_resolved(each))
        assert load_run(file) == each
    file.write_text(dump_resolved(own))
    assert load_run(file, ['print.printer="dlp-50"']).print.described == PRINTERS["dlp-50"]


@pytest.mark.parametrize(
    ("override", "line"),
    [
        ('print.printer="mask-51"', "print: printer: mask-51 is none of mask-22, "),
        ("print.pixel_um=50", "print: layer_um: missing; a printer needs pixel_um and layer_um, or a name"),
        ('print.printer="mask-50"|print.layer_um=0', "print: layer_um: 0 is not a number from 1 to 1000"),
        ('print.printer="mask-50"|print.pixel_um="x"', "print.pixel_um: Input should be a valid number"),
        ('print.printer="mask-50"|descent.method="adam"', "print.printer: adam makes no whole layers"),
        ("print.keep_features=true", "print: keep_features: of no printer; name one"),
        ("print.printer=5", "print.printer: Input should be a valid string"),
        ("print=5", "print: "),
    ],
)
def test_bad_printers_are_refused_in_one_line(studio: Path, texture: Path, override: str, line: str) -> None:
    with pytest.raises(InputError) as caught:
        settings(studio, texture, *override.split("|"))
    assert line in str(caught.value) and "\n" not in str(caught.value)


def test_a_printer_too_coarse_for_the_plate_is_refused(studio: Path, texture: Path, tmp_path: Path) -> None:
    coarse = settings(studio, texture, "print.pixel_um=2000", "print.layer_um=60")
    with pytest.raises(InputError, match=r"waves\.exr: printer: pixels of 2000 um make 5 x 5 of 10 x 10 mm"):
        runs.optimize(coarse, tmp_path / "out")
    assert not (tmp_path / "out").exists()
