"""A run on a relief of 5 mm, from file to file: what no finger reaches stays in what is written."""

from pathlib import Path

import numpy as np
import pytest
import trimesh

from optimize.runs.job import Result
from optimize.settings.run_file import load_run
from relief.ground.errors import InputError
from relief.ground.limits import BASE_MM
from relief.heightmap import load_heights, save_heights_exr
from relief.printed import printed
from retouch.commands import main as cli
from retouch.verbs import runs
from tests.optimize.descent.test_deep_relief import wavy_pyramids

pytestmark = pytest.mark.slow

RUN = """scene = "{scene}"
texture = "{texture}"
define.resolution = 64
[touch]
jnd = -1
model = "quick"
[look]
model = "fast"
[verify]
resolution = 16
samples = 16
baseline = false
"""


@pytest.fixture(scope="module")
def run_file(studio: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("deep")
    save_heights_exr(folder / "pyramids.exr", wavy_pyramids(), 10.0)
    (folder / "deep.toml").write_text(RUN.format(scene=studio, texture=folder / "pyramids.exr"))
    return folder / "deep.toml"


@pytest.fixture(scope="module")
def result(run_file: Path) -> Result:
    return runs.optimize(run_file, run_file.parent / "out")


def test_the_target_is_met_and_verified(result: Result) -> None:
    assert result.stop.met
    assert result.summary["touch"]["jnd_from_original"] == pytest.approx(-1.0, abs=0.1)


def test_what_no_finger_reaches_is_in_the_file_as_it_was(run_file: Path, result: Result) -> None:
    before = load_heights(run_file.parent / "pyramids.exr")
    after = load_heights(result.run_dir / "heights.exr")
    low = before < before.max() - 3.0
    np.testing.assert_array_equal(after[low], before[low])
    assert result.summary["heights"]["frozen_fraction"] == low.mean()
    height = np.ptp(trimesh.load(result.run_dir / "plate.stl").bounds[:, 2])
    assert height == pytest.approx(BASE_MM + after.max(), abs=1e-4)


def test_the_report_tells_the_share_that_stayed(result: Result) -> None:
    share = 100.0 * result.summary["heights"]["frozen_fraction"]
    assert (
        f"{share:.3g} % of the area lies more than 3 mm below" in (result.run_dir / "report.html").read_text()
    )


def test_the_command_evaluates_and_exports_what_it_wrote(result: Result, tmp_path: Path) -> None:
    assert cli.main(["evaluate", str(result.run_dir), "--model", "quick", "--json"]) == 0
    assert cli.main(["export", str(result.run_dir), "-o", str(tmp_path / "plate.3mf")]) == 0


def test_a_print_of_it_keeps_what_no_finger_reaches(run_file: Path, tmp_path: Path) -> None:
    """Layers of 70 µm, of which 3 mm are no whole number; walls and reliefs as every printer has them."""
    own = ["print.pixel_um=156.25", "print.layer_um=70"]
    settings = load_run(run_file, own)
    result, printer = runs.optimize(settings, tmp_path / "out"), settings.print.described
    assert result.stop.met and printer is not None
    assert result.summary["touch"]["jnd_from_original"] == pytest.approx(-1.0, abs=0.1)
    before = printed(load_heights(run_file.parent / "pyramids.exr"), 10.0 / 64, printer)
    low = before < before.max() - 3.0
    assert result.summary["heights"]["frozen_fraction"] == low.mean() > 0.0
    np.testing.assert_allclose(result.heights[low], before[low], atol=1e-12)
    np.testing.assert_allclose(result.heights / 0.07, np.rint(result.heights / 0.07), atol=1e-9)
    with pytest.raises(InputError, match=r"pyramids\.exr: printer: the relief is .* 3 mm; make it lower"):
        runs.optimize(load_run(run_file, [*own, "print.max_relief_mm=3"]), tmp_path / "low")
    assert not (tmp_path / "low").exists()
