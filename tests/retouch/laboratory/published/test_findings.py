"""Rows of findings: each is read, has a source, and its stimulus and rule fit together."""

from inspect import signature
from pathlib import Path

import numpy as np
import pytest

from relief.ground.errors import InputError
from retouch.laboratory.published.findings import AREA, FILE, RIGHT, Finding, V, load_findings
from retouch.laboratory.published.rules import RULES
from retouch.laboratory.published.stimuli import KINDS, plates
from tactile.readouts import READ_OUTS
from tactile.skin import Skin

FINDINGS = load_findings()
ROWS = [pytest.param(one, id=one.name) for one in FINDINGS.finding]


def test_names_are_unique_and_a_study_is_as_a_whole_fitted_seen_or_new() -> None:
    names = [one.name for one in FINDINGS.finding]
    assert len(set(names)) == len(names)
    marks: dict[str, str] = {}
    for one in FINDINGS.finding:
        assert marks.setdefault(one.study, one.mark) == one.mark, one.study
        assert one.against in ("", *names), one.name
    assert len({one.study for one in FINDINGS.finding if one.mark == "new"}) >= 12


def test_what_is_not_computable_says_what_is_missing() -> None:
    for one in FINDINGS.not_computable:
        assert {"study", "says", "missing"} <= one.keys() <= {"study", "doi", "says", "missing"}, one


@pytest.mark.parametrize("one", ROWS)
def test_the_rule_fits_the_stimulus(one: Finding) -> None:
    assert one.doi == "" or one.doi.startswith("10.")
    every = one.plates(1.0)
    assert len(every) == len(one.at) and all(force > 0.0 for _, force in every)
    for plate, _ in every:
        lengths = {name: value for name, value in plate.items() if name != "kind"}
        signature(KINDS[plate["kind"]]).bind(None, None, **lengths)
        # Each parameter is a number or a word, and the formula takes it.
        assert not any(isinstance(value, list) for value in lengths.values())
    weights, heights = plates(every[0][0], 32, 10.0 / 32)
    assert heights.shape == (len(weights), 32, 32) and np.isfinite(heights).all()
    assert weights.sum() == pytest.approx(1.0)
    rule = {name: value for name, value in one.rule.items() if name != "kind"}
    told, right = RULES[one.rule["kind"]]([1.0 + n**1.5 for n in range(len(every))], one.at, **rule)
    assert isinstance(told, str) and right in (True, False)


def row(tmp_path: Path, changes: dict[str, str]) -> Path:
    """A file with one row."""
    values = {
        **{"name": '"a"', "says": '"b"', "of": '"roughness"', "mark": '"new"', "study": '"c"'},
        **{"stimulus": '{kind = "sphere", radius_mm = 5}', "rule": '{kind = "rises"}', "read": '"abstract"'},
    } | changes
    file = tmp_path / "findings.toml"
    lines = "\n".join(f"{name} = {value}" for name, value in values.items())
    file.write_text(f"not_computable = []\n[[finding]]\n{lines}\n", encoding="utf-8")
    return file


@pytest.mark.parametrize(
    "changes", [{"mark": '"old"'}, {"force": "1"}, {"force_n": '"much"'}, {"unit": '"N"'}]
)
def test_a_fault_is_one_line_with_file_and_row(tmp_path: Path, changes: dict[str, str]) -> None:
    file = row(tmp_path, changes)
    with pytest.raises(InputError, match=r"findings\.toml: finding\.0\.") as fault:
        load_findings(file)
    assert "\n" not in str(fault.value)
    assert FILE.is_file()


def test_forces_are_the_source_s_or_shares_of_the_finger_s_own(tmp_path: Path) -> None:
    stimulus = '{kind = "sphere", radius_mm = 5}'
    (shares,) = load_findings(row(tmp_path, {"stimulus": stimulus, "force_share": "[0.5, 1.0, 2.0]"})).finding
    assert [force for _, force in shares.plates(10.0)] == [5.0, 10.0, 20.0]
    assert shares.at == [0.5, 1.0, 2.0]
    (own,) = load_findings(row(tmp_path, {"stimulus": stimulus, "force_n": "0.6"})).finding
    assert [force for _, force in own.plates(10.0)] == [0.6]


@pytest.mark.slow
@pytest.mark.parametrize(("unit", "judged"), [(None, {V, *READ_OUTS}), ('"V"', {V}), (f'"{AREA}"', {AREA})])
def test_a_row_judges_what_its_unit_says(tmp_path: Path, unit: str | None, judged: set[str]) -> None:
    changes = {"stimulus": '{kind = "bump", high_mm = [0.1, 0.3], sigma_mm = 1}'} | (
        {"unit": unit} if unit else {}
    )
    (one,) = load_findings(row(tmp_path, changes)).finding
    columns = one.columns(Skin(), 32)
    assert {name for name in (V, AREA, *READ_OUTS) if RIGHT.format(name) in columns} == judged
    assert {f"{V} 0", f"{V} 1", f"{AREA} 1"} <= columns.keys()


def test_a_finger_that_cannot_be_pressed_so_says_why(tmp_path: Path) -> None:
    changes = {"stimulus": '{kind = "sphere", radius_mm = [3, 5]}', "force_n": "1000"}
    (one,) = load_findings(row(tmp_path, changes)).finding
    finger = Skin(young_modulus_mpa=0.025, shape="round", radius_mm=9.0, thickness_mm=4.0)
    columns = one.columns(finger, 32)
    assert list(columns) == ["refused"] and "force_n" in str(columns["refused"])


def test_a_read_out_without_ratios_is_not_right(tmp_path: Path) -> None:
    (one,) = load_findings(row(tmp_path, {"stimulus": '{kind = "sphere", radius_mm = [3, 5]}'})).finding
    assert one.verdict([0.0, 1.0]) == ("no ratio", False)
