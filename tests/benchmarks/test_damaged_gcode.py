"""Damaged G-code is refused in one line or read as its text says, in a sample of the benchmark's files."""

from benchmarks.prints.damaged_gcode import followed, measured


def test_a_sample_of_damaged_files_is_refused_or_right() -> None:
    found = measured(150, 7)
    assert found["faults"] == [] and found["files"] == 150


def test_the_plain_interpreter_follows_modes() -> None:
    text = "G28\nM83\nG1 X10 Y5 Z1\n;WIDTH:0.5\nG1 X20 E2\nG91\nG1 Y1 E1\nG90\nG92 X0\nG1 X1 E3\nG1 E4\n"
    rows = followed(text)
    assert [row[:5] for row in rows] == [(20, 5, 1, 2, 0.5), (20, 6, 1, 1, 0.5), (21, 6, 1, 3, 0.5)]
