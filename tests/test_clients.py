"""PrusaSlicer, where there is one, reads what Retouch writes without repair; its layers are the relief."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from benchmarks.prints.prusa import PRINTER, Slicer, plate_heights
from relief.printed import printed
from relief.solids.body import Part
from relief.solids.export.parts import write_parts
from relief.solids.export.plate_export import plate_mesh, repeated
from relief.solids.meshes.solid import volume_mm3

PROGRAM = "prusa-slicer"
pytestmark = pytest.mark.skipif(shutil.which(PROGRAM) is None, reason="there is no PrusaSlicer here")


@pytest.fixture(scope="module")
def slicer(tmp_path_factory: pytest.TempPathFactory) -> Slicer:
    return Slicer(PROGRAM, tmp_path_factory.mktemp("slicer"), 256)


def hills() -> np.ndarray:
    """Heights of 16 x 16 squares of 0.5 mm, from 0 to 0.6 mm, slopes up to 40 degrees."""
    y, x = np.meshgrid(*[2.0 * np.pi * np.arange(16) / 16] * 2, indexing="ij")
    return np.asarray(0.15 * (2.0 + np.sin(x + 2.0 * y) + np.cos(2.0 * x)))


@pytest.mark.parametrize("suffix", [".3mf", ".stl", ".obj"])
def test_parts_need_no_repair_and_keep_volume_and_size(tmp_path: Path, slicer: Slicer, suffix: str) -> None:
    tiles = plate_mesh(repeated(np.full((16, 16), 0.3), (3, 3), "tile"), 24.0)
    parts = [
        Part("tiles", tiles, np.vstack([np.eye(3), [0.0, 0.0, 2.0]])),
        Part("hills", plate_mesh(hills(), 8.0), np.vstack([np.eye(3), [20.0, 0.0, 2.0]])),
    ]
    found = slicer.info(write_parts(tmp_path / f"parts{suffix}", parts))
    assert found["manifold"] and found["repairs"] == 0
    assert found["objects"] == (2 if suffix == ".3mf" else 1)
    assert found["facets"] == sum(len(part.body.faces) for part in parts)
    assert found["volume_mm3"] == pytest.approx(sum(volume_mm3(part.body) for part in parts), rel=1e-5)
    np.testing.assert_allclose(found["size_mm"], [36.0, 24.0, 2.0 + hills().max()], atol=1e-3)


def test_resin_layers_are_the_relief(tmp_path: Path, slicer: Slicer) -> None:
    file = write_parts(tmp_path / "hills.3mf", [Part("hills", plate_mesh(hills(), 8.0))])
    told, solid = slicer.resin(file)
    assert told["warnings"] == [] and told["overhanging_pixels"] == 0
    heights, model = plate_heights(solid, 2.0), printed(hills(), 0.5, PRINTER)
    apart = np.rint((heights - model) / PRINTER.layer_mm)
    assert np.abs(apart).max() <= 1 and np.mean(apart == 0) > 0.9


def test_plates_of_flat_pixels_are_sliced_as_they_are(tmp_path: Path, slicer: Slicer) -> None:
    """A print of 160 x 160 pixels: every layer of every pixel."""
    model = printed(hills(), 0.5, PRINTER)
    plate = plate_mesh(model, 8.0, PRINTER.base_mm, stepped=True)
    _, solid = slicer.resin(write_parts(tmp_path / "print.3mf", [Part("print", plate)]))
    np.testing.assert_allclose(plate_heights(solid, PRINTER.base_mm), model, atol=1e-9)


def test_filament_is_sliced(tmp_path: Path, slicer: Slicer) -> None:
    file = write_parts(tmp_path / "hills.3mf", [Part("hills", plate_mesh(hills(), 8.0))])
    told = slicer.filament(file)
    # Layers of 0.3 mm over 2.6 mm, as the slicer has them by default.
    assert told["warnings"] == [] and told["layers"] == 8
