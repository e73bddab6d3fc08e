"""G-code of seven slicers gives the beads that it was composed from; damage is refused in one line."""

import io
import re
import sys
import zipfile
from pathlib import Path

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.ground.formats import is_gcode, is_mesh
from relief.solids.filament.beads import Beads, Role, SlicedPart
from relief.solids.filament.gcode_reader import read_gcode
from tests.relief.solids.filament.gcode_forms import (
    CASES,
    FORMS,
    SLICERS,
    Form,
    Laid,
    binary,
    box,
    composed,
    project,
)


def read(folder: Path, content: bytes, name: str = "part.gcode") -> SlicedPart:
    path = folder / name
    path.write_bytes(content)
    return read_gcode(path)


def compare(found: Beads, laid: list[Laid], by_comments: bool = True) -> None:
    """Each bead is the one that was composed; an arc is many, on its circle and within 1 um of it."""
    at = 0
    for bead in laid:
        count = 1
        if bead.arc is not None:
            while not np.allclose(found.end[at + count - 1], bead.end, atol=1e-6) and at + count < len(found):
                count += 1
        part = found.part(np.arange(at, at + count))
        at += count
        np.testing.assert_allclose(part.start[0], bead.start, atol=1e-6)
        np.testing.assert_allclose(part.end[-1], bead.end, atol=1e-6)
        np.testing.assert_array_equal(part.end[:-1], part.start[1:])
        assert part.filament_mm.sum() == pytest.approx(bead.filament_mm, abs=1e-9)
        assert set(part.role) == {bead.role} and set(part.layer) == {bead.layer}
        if bead.role != Role.CUSTOM:
            np.testing.assert_allclose(part.height, bead.height, atol=1e-6)
            np.testing.assert_allclose(part.width, bead.width, atol=1e-6 if by_comments else 2e-3)
        if bead.arc is not None:
            x, y, radius = bead.arc
            places = np.stack([part.start, 0.5 * (part.start + part.end), part.end])[..., :2]
            apart = np.linalg.norm(places - (x, y), axis=-1) - radius
            # The ends are rounded to 1 um, and so is the way from one to the centre.
            assert np.abs(apart[[0, 2]]).max() < 2e-3 and np.abs(apart[1]).max() < 3e-3
    assert at == len(found)


@pytest.mark.parametrize(("slicer", "form"), CASES)
def test_all_forms_of_all_slicers(tmp_path: Path, slicer: str, form: str) -> None:
    how, parts = FORMS[form]
    text, laid, stated = composed(SLICERS[slicer], how, parts(SLICERS[slicer]))
    part = read(tmp_path, text)
    assert part.warnings == () and part.slicer == SLICERS[slicer].name
    compare(part.beads, laid, slicer != "Cura")
    assert part.header_mm == pytest.approx(stated, abs=0.02)
    for role in Role:
        amount = sum(bead.filament_mm for bead in laid if bead.role == role)
        assert part.filament_mm.get(role.name.lower(), 0.0) == pytest.approx(amount, abs=1e-9)


@pytest.mark.parametrize("compression", range(4))
@pytest.mark.parametrize(("encoding", "spaces"), [(0, True), (1, False), (2, True), (2, False)])
def test_binary_files(tmp_path: Path, compression: int, encoding: int, spaces: bool) -> None:
    text, laid, stated = composed(SLICERS["PrusaSlicer"], Form(relative_e=True), box())
    part = read(tmp_path, binary(text, compression, encoding, spaces), "part.bgcode")
    assert part.slicer == "PrusaSlicer 2.9.1" and part.header_mm == pytest.approx(stated, abs=0.02)
    assert part.settings["nozzle_diameter"] == "0.4"
    if encoding == 1:  # Without comments there are neither types nor sizes.
        assert set(part.beads.role) == {Role.OTHER_PART} and len(part.beads) == len(laid)
    else:
        assert part.warnings == ()
        compare(part.beads, laid)


def test_projects(tmp_path: Path) -> None:
    text, laid, _ = composed(SLICERS["Bambu Studio"], Form(), box())
    part = read(tmp_path, project(text), "part.gcode.3mf")
    compare(part.beads, laid)
    file = io.BytesIO(project(text))
    with zipfile.ZipFile(file, "a") as archive:
        archive.writestr("Metadata/plate_12.gcode", "G28")
    part = read(tmp_path, file.getvalue(), "part.gcode.3mf")
    assert part.warnings == ("holds several plates: plate 2 is read, not 12",)
    with pytest.raises(InputError, match="holds no G-code; slice a plate"):
        read(tmp_path, file.getvalue().replace(b".gcode", b".gcope"), "part.3mf")
    with pytest.raises(InputError, match="damaged or not a project"):
        read(tmp_path, project(text)[:-40], "part.gcode.3mf")


def test_names() -> None:
    names = ("a.gcode", "A.GCO", "a.g", "a.bgcode", "a.gcode.3mf")
    assert all(is_gcode(Path(name)) and not is_mesh(Path(name)) for name in names)
    assert not is_gcode(Path("a.3mf")) and is_mesh(Path("a.3mf"))


PRUSA = composed(SLICERS["PrusaSlicer"], Form(), box())[0]
CURA = composed(SLICERS["Cura"], Form(), box())[0]


def changed(pattern: str, by: str, text: bytes = PRUSA) -> bytes:
    out, count = re.subn(pattern, by, text.decode(), count=1, flags=re.MULTILINE)
    assert count == 1
    return out.encode()


AFTER_LAYER = r"(;LAYER_CHANGE\n;Z:0.5)"
FAULTS = {
    "cut": (PRUSA[: len(PRUSA) // 2], "is cut off: lacks the line 'filament used [mm]'"),
    "cut, Cura": (CURA[: len(CURA) * 2 // 3], "is cut off: lacks the line 'End of Gcode'"),
    "empty": (b"", "extrudes nothing"),
    "no extrusion": (b"G28\nG1 X10 Y10\nG1 E5\nG1 X20\n", "extrudes nothing"),
    "stl": (b"solid part\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\n", "extrudes nothing"),
    "picture": (b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR", "is no G-code: holds bytes that no text has"),
    "xml": (b'<?xml version="1.0"?>\n<a/>', "line 1: is no G-code"),
    "spline": (changed(AFTER_LAYER, r"\1\nG5 I0 J3 X1 Y1"), "G5: splines are not read"),
    "plane": (changed(AFTER_LAYER, r"\1\nG18"), "G18: arcs in other planes"),
    "origin": (changed(AFTER_LAYER, r"\1\nG55"), "G55: coordinates from other origins"),
    "origin by G10": (changed(AFTER_LAYER, r"\1\nG10 L2 P1 X5"), "G10: coordinates from other origins"),
    "turned": (changed(AFTER_LAYER, r"\1\nG68 R30"), "G68: scaled or rotated coordinates"),
    "babysteps": (changed(AFTER_LAYER, r"\1\nM290 Z0.1"), "M290: changes of height"),
    "loop": (changed(AFTER_LAYER, r"\1\nM808 L4"), "M808: repeated commands"),
    "number": (changed(r"^G0 X45.000 Y45.000", "G0 X45.0.1 Y45.000"), "is no G"),
    "nan": (changed(r"^G1 Y55.000", "G1 Ynan"), "is no G"),
    "far": (changed(r"^G1 Y55.000", "G1 Y55000000"), "lies more than 10 m away"),
    "long": (changed(r"^G1 Y55.000", "G1 Y" + "1" * 400), "is no G"),
    "long line": (b"G1 " + b"X1 " * 30_000, "line 1: is no G1: 'G1 X1 X1"),
    "G92": (changed(r"^G92 E0", "G92 E1.2.3"), "is no G92: 'G92 E1.2.3'"),
    "no code": (changed(r"^G1 Y55.000", "Y55.000"), "is no G-code"),
    "negative width": (changed(r"^;WIDTH:0.48", ";WIDTH:-0.48"), "'-0.48' is no width or height"),
    "absurd width": (changed(r"^;WIDTH:0.48", ";WIDTH:480"), "'480' is no width or height"),
    "width in words": (changed(r"^;HEIGHT:0.2", ";HEIGHT:nan"), "'nan' is no width or height"),
    "absurd E": (changed(r"^G1 X54.550 E\S+", "G1 X54.55 E900", CURA), "lays a bead wider than 50 mm"),
    "arc": (b"G28\nG1 X10 Y10 Z1\nG3 X20 Y10 I4 J0 E3\n", "line 3: an arc does not reach its end"),
    "arc without centre": (b"G28\nG1 X10 Y10\nG2 X20 Y10 E3\n", "an arc does not reach its end"),
    "arc of small radius": (b"G28\nG1 X10 Y10\nG2 X20 Y10 R3 E3\n", "an arc does not reach its end"),
    "arc of many turns": (b"G28\nG1 X10 Y10 Z1\nG2 X10 Y10 I5 J0 P999999999 E3\n", "an arc has more than"),
    "arc around its start": (b"G28\nG1 X10 Y10 Z1\nG2 X10 Y10 R0.01 E3\n", "line 3: lays a bead wider"),
    "bgcode": (binary(PRUSA, 1, 2)[:-9], "is cut off, damaged, or too large, at byte"),
    "bgcode of another version": (b"GCDE\2\0\0\0\1\0", "version 2 of binary G-code is not read"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_faults_are_one_line(tmp_path: Path, fault: str) -> None:
    content, line = FAULTS[fault]
    with pytest.raises(InputError) as caught:
        read(tmp_path, content)
    assert str(caught.value).startswith(f"{tmp_path / 'part.gcode'}: ") and line in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_arc_of_huge_radius_is_a_line(tmp_path: Path) -> None:
    beads = read(tmp_path, b"G20\nG1 Z0.01\nG3 X1 J999999999999 E0.04\n").beads
    assert len(beads) == 1 and beads.end[0] == pytest.approx((25.4, 0.0, 0.254), abs=1e-2)


def test_a_changed_block_of_a_binary_file(tmp_path: Path) -> None:
    content = bytearray(binary(PRUSA, 3, 2))
    content[-200] ^= 4
    with pytest.raises(InputError, match="checksum of the block at byte"):
        read(tmp_path, bytes(content))


def test_doubts_are_lines(tmp_path: Path) -> None:
    def lines(content: bytes) -> tuple[str, ...]:
        return read(tmp_path, content).warnings

    missing = changed(
        r"^G1 X54.550 E\S+ F1800\n", "", composed(SLICERS["PrusaSlicer"], Form(relative_e=True), box())[0]
    )
    assert len(lines(missing)) == 1 and lines(missing)[0].startswith("is cut off or altered: its moves take")
    assert lines(changed("^;TYPE:Internal infill", ";TYPE:Foam")) == (
        "has unknown types, taken as parts, or unknown commands, left out: type 'Foam' (line 44)",
    )
    assert "G7 (line 7)" in lines(changed(r"^G21.*", "G7 X1"))[0]
    assert lines(b"G28\nG1 X10 Y10 Z0.2\nG1 X20 E0.4\n") == (
        "states no length of filament, so that missing moves would not show",
        "states no diameter of filament: widths are those of 1.75 mm",
    )


def test_lines_that_move_nothing(tmp_path: Path) -> None:
    parked = changed(
        AFTER_LAYER, r"\1\nP0 S1 L1 D0; park the tool\nG2814 Z0.32\nG92 E0 (reset)\nG1 E.8 (prime)"
    )
    part = read(tmp_path, parked)
    assert part.warnings == () and np.array_equal(part.beads.end, read(tmp_path, PRUSA).beads.end)


def test_a_raft_of_cura_is_support(tmp_path: Path) -> None:
    raft = "G92 E0\n;LAYER:-2\nG0 X0 Y0 Z0.3\nG1 X50 E2\n;TIME_ELAPSED:1.5\n;LAYER:-1\nG0 Z0.5\nG1 X0 E4\n"
    raft += ";TIME_ELAPSED:2.5\nG92 E0\n;LAYER:0"
    part, sound = read(tmp_path, changed("^;LAYER:0", raft, CURA)), read(tmp_path, CURA)
    assert part.filament_mm == {**sound.filament_mm, "support": 4.0}
    assert part.beads.layer[-1] == sound.beads.layer[-1] + 2


def test_creality_print_4_states_a_length_twice(tmp_path: Path) -> None:
    head = ";Filament used:0.04m\n;Filament Length:0.040000\n;Creality Print GCode Generated by CXEngine\n"
    head += ";Creality Print Version : V4.3.8.7058\n;LAYER:0\n;TYPE:WALL-OUTER\n"
    part = read(tmp_path, (head + "G1 X0 Y0 Z0.2\nG1 X1000 E40\n").encode())
    assert part.header_mm == 40.0 and part.slicer == "Creality Print V4.3.8.7058"
    assert part.warnings == ("states no diameter of filament: widths are those of 1.75 mm",)


def test_layers_without_comments(tmp_path: Path) -> None:
    text = b"G28\nG1 X60 E9 ; intro line\nG92 E0\nG1 X0 Y0 Z0.2\nG1 X50 E2\nG1 Z0.4\nG1 X0 E4\n"
    part = read(tmp_path, text + b"; filament used = 4.0mm (0.0cm3)\n")
    assert part.filament_mm == {"other_part": 4.0, "custom": 9.0}
    np.testing.assert_allclose(part.beads.height[1:], 0.2)


@pytest.mark.parametrize(("by", "said"), [("G1 Y955", True), ("G1 Y56", False)])
def test_a_move_to_a_wrong_place_is_a_line(tmp_path: Path, by: str, said: bool) -> None:
    warnings = read(tmp_path, changed(r"^G1 Y55.000", by)).warnings
    assert (warnings != ()) == said and all(line.startswith("is perhaps damaged: line") for line in warnings)


def test_a_layer_far_above_the_others_is_a_line(tmp_path: Path) -> None:
    (line,) = read(tmp_path, PRUSA.replace(b"G1 Z0.500", b"G1 Z600")).warnings
    assert re.search(r"is perhaps damaged: line \d+ lies 600 mm above the bed", line)


def test_ultimaker_states_volumes(tmp_path: Path) -> None:
    section = np.pi / 4.0 * 2.85**2
    text = ";FLAVOR:UltiGCode\n;MATERIAL:9.6\n;Generated with Cura_SteamEngine 4.0\n;LAYER:0\n"
    text += ";TYPE:WALL-OUTER\nG0 X0 Y0 Z0.2\nG10\nG11\nG1 X100 E9.6\n;TIME_ELAPSED:1\n;End of Gcode\n"
    part = read(tmp_path, text.encode())
    assert part.header_mm == pytest.approx(9.6 / section)
    assert part.filament_mm["outer_wall"] == pytest.approx(9.6 / section)
    assert part.beads.width[0] == pytest.approx(9.6 / 100 / 0.2 + 0.2 * (1.0 - np.pi / 4.0))


def test_without_layers_heights_are_steps(tmp_path: Path) -> None:
    rows = ["G28", "G1 X10 Y10 Z0.25"]
    for z in (0.25, 0.45, 0.65):
        rows += [f"G1 Z{z}", "G1 X0 Y0", "G92 E0", "G1 X20 E0.7"]
    part = read(tmp_path, "\n".join(rows).encode())
    np.testing.assert_allclose(part.beads.height, [0.25, 0.2, 0.2])
    np.testing.assert_array_equal(part.beads.layer, [0, 1, 2])
    assert set(part.beads.role) == {Role.OTHER_PART}


def test_heatshrink_is_an_extra(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "heatshrink2", None)
    with pytest.raises(InputError, match=r"needs the extra bgcode: pip install 'retouch\[bgcode\]'"):
        read(tmp_path, binary(PRUSA, 3, 2))
    assert len(read(tmp_path, binary(PRUSA, 1, 2)).beads)


def test_hostile_lines_end_soon(tmp_path: Path) -> None:
    """Each of these once took quadratic time, or gigabytes."""
    for text in (
        b";" + b" " * 300_000 + b"x",
        b"G92 " + b"X1" * 200_000,
        b"; generated by" + b" " * 300_000 + b"!",
    ):
        with pytest.raises(InputError, match="extrudes nothing"):
            read(tmp_path, text)
