"""G-code of PrusaSlicer, where there is one: sums over E, computed in another way, and sizes of a box."""

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from relief.solids.body import Part
from relief.solids.export.parts import write_parts
from relief.solids.export.plate_export import plate_mesh
from relief.solids.filament.beads import Role, SlicedPart
from relief.solids.filament.gcode_reader import read_gcode

PROGRAM = "prusa-slicer"
pytestmark = pytest.mark.skipif(shutil.which(PROGRAM) is None, reason="there is no PrusaSlicer here")
OPTIONS = {
    "as it is": [],
    "relative": ["--use-relative-e-distances", "--layer-gcode", "G92 E0"],
    "purge": ["--start-gcode", "G28\nG1 Z0.3\nG1 X80 E12 F600\nG92 E0"],
    "fuzzy": ["--fuzzy-skin", "external", "--fuzzy-skin-thickness", "0.3", "--fuzzy-skin-point-dist", "0.8"],
    "vase": ["--spiral-vase", "--perimeters", "1", "--top-solid-layers", "0", "--fill-density", "0"],
    "supports": ["--support-material", "--rotate-x", "30", "--brim-width", "3", "--raft-layers", "1"],
    "volumetric": ["--use-volumetric-e", "--start-gcode", "M200 D1.75"],
}


def sliced(folder: Path, options: list[str]) -> tuple[SlicedPart, str]:
    """A block of 12 x 12 x 4 mm, sliced with options, as the reader has it and as text."""
    part = write_parts(folder / "block.stl", [Part("block", plate_mesh(np.full((8, 8), 2.0), 12.0))])
    file = folder / "block.gcode"
    command = [PROGRAM, "--export-gcode", str(part), "-o", str(file), *options]
    subprocess.run(command, capture_output=True, check=True, timeout=120)
    return read_gcode(file), file.read_text(encoding="utf-8")


def extruded(text: str) -> float:
    """Filament, mm, of all moves that have X or Y and push E forward, word by word."""
    relative, last, total, scale = False, 0.0, 0.0, 1.0
    for line in text.splitlines():
        words = line.split(";")[0].split()
        if not words:
            continue
        values = {word[0]: word[1:] for word in words[1:]}
        if words[0] in ("M82", "M83"):
            relative = words[0] == "M83"
        elif words[0] == "M200":
            scale = 4.0 / (np.pi * float(values["D"]) ** 2)
        elif words[0] == "G92" and "E" in values:
            last = float(values["E"])
        elif words[0] == "G1" and "E" in values:
            push = float(values["E"]) - (0.0 if relative else last)
            last = float(values["E"])
            total += max(push, 0.0) * ("X" in values or "Y" in values)
    return total * scale


@pytest.mark.parametrize("name", OPTIONS)
def test_sums_are_those_of_the_text_and_of_its_header(tmp_path: Path, name: str) -> None:
    part, text = sliced(tmp_path, OPTIONS[name])
    assert part.warnings == () and part.slicer.startswith("PrusaSlicer")
    assert sum(part.filament_mm.values()) == pytest.approx(extruded(text), rel=1e-9)
    assert part.header_mm is not None
    own = sum(part.filament_mm.values()) - part.filament_mm.get("custom", 0.0)
    assert own == pytest.approx(part.header_mm, rel=2e-4)
    assert part.filament_mm.get("custom", 0.0) == pytest.approx(12.0 if name == "purge" else 0.0)
    walls = part.beads.part(part.beads.role == Role.OUTER_WALL)
    assert len(walls) and part.settings["layer_height"] == "0.3"
    if name == "as it is":
        # The outer wall lies half of its width within the part.
        ends = walls.start[:, 0] + np.array([[-0.5], [0.5]]) * walls.width
        assert np.ptp(ends) == pytest.approx(12.0, abs=2e-3)
        heights = np.unique(np.round(walls.height, 6))
        np.testing.assert_allclose(heights, [0.3, 0.35])


def test_widths_by_e_are_those_of_the_comments(tmp_path: Path) -> None:
    """The comments taken out, walls have the same sizes within what five decimals of E leave."""
    part, text = sliced(tmp_path, [])
    file = tmp_path / "bare.gcode"
    kept = [line for line in text.splitlines() if not line.startswith((";WIDTH", ";HEIGHT"))]
    file.write_text("\n".join(kept), encoding="utf-8")
    bare = read_gcode(file).beads
    # A bridge has its diameter as its height in the comments, and lies on a layer all the same.
    same = (part.beads.role != Role.BRIDGE) & (np.linalg.norm(bare.end - bare.start, axis=1) > 0.5)
    np.testing.assert_allclose(bare.height[same], part.beads.height[same], atol=1e-9)
    np.testing.assert_allclose(bare.width[same], part.beads.width[same], atol=2e-3)
