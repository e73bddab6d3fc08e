"""Public parts: the list, the options that refusals advise, and what counts as a fault of a wrapped part."""

import re
from pathlib import Path

import numpy as np
import pytest

from benchmarks.objects.public.__main__ import PARTS, RESULT, advised, name_of, outcome
from benchmarks.objects.public.found import faults, found
from benchmarks.shared.common import load
from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts

CLOSE = "part.stl: is open: 3 edges border on holes, the largest 17.2 mm wide; mend it (--close-holes)"


def test_the_list_names_forty_files_of_ten_repositories_or_more() -> None:
    assert len({name_of(part) for part in PARTS}) == len(PARTS) >= 40
    assert len({part["repository"] for part in PARTS}) >= 10
    for part in PARTS:
        assert re.fullmatch("[0-9a-f]{40}", part["commit"]) and re.fullmatch("[0-9a-f]{64}", part["sha256"])


def test_results_are_of_the_list_and_each_refusal_is_judged() -> None:
    results = load(RESULT)
    names = {name_of(part) for part in PARTS}
    assert set(results["now"]) <= names
    refused = {name for name, row in results["now"].items() if outcome(row) == "refused"}
    assert refused == set(results["judged"])


@pytest.mark.parametrize(
    ("line", "given", "wanted"),
    [
        (CLOSE, (), ("--close-holes", "18")),
        (CLOSE, ("--close-holes", "18"), ()),
        ("part.stl: passes through itself; unite its parts (--unite)", (), ("--unite",)),
        ("part.glb: 13 um; is that meant? state it (--units)", ("--unite",), ("--unite", "--units", "in")),
        ("part.stl: encloses no volume; give the surface a thickness", (), ()),
    ],
)
def test_options_are_those_that_the_line_advises(
    line: str, given: tuple[str, ...], wanted: tuple[str, ...]
) -> None:
    assert advised(line, given, "in") == wanted


def test_a_part_that_bulges_has_faults_and_a_copy_only_lacks_its_relief(tmp_path: Path) -> None:
    corners = np.stack(np.meshgrid((0.0, 20.0), (0.0, 20.0), (0.0, 20.0), indexing="ij"), -1).reshape(-1, 3)
    sides = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    triangles = np.array([turned for a, b, c, d in sides for turned in ((a, b, c), (a, c, d))])
    box = Body(corners, triangles)
    bulged = Body(corners * (1.0, 1.0, 1.1), triangles)
    file, same, other = (
        write_parts(tmp_path / name, [Part("", body)])
        for name, body in (("file.stl", box), ("same.stl", box), ("other.stl", bulged))
    )
    assert faults(found(file, same, ())) == []
    wrong = " ".join(faults(found(file, other, ())))
    assert "volume" not in wrong and "grown_mm 2.00" in wrong and "away_mm 2.00" in wrong
