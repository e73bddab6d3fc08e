"""The scoreboard: it goes on where it was left, counts as it says, and its page shows every row."""

import json
from pathlib import Path

import pytest

import retouch
from benchmarks.docs.pages import WIDTHS, faults
from benchmarks.shared.browser import Browser, chromium
from relief.ground.errors import InputError
from retouch.commands.main import main
from retouch.laboratory.published import scoreboard
from retouch.laboratory.published.findings import RIGHT, Finding, Findings, V, load_findings
from retouch.laboratory.published.page import scoreboard_page
from retouch.laboratory.published.scoreboard import GROUPS, Scoreboard, agreements, compute

MADE = {"says": "rougher", "of": "roughness", "read": "abstract"}
WAVES = {"kind": "grating", "half_mm": 1.25, "high_mm": [0.1, 0.3], "wave": "sine"}


def finding(name: str, study: str, **values: object) -> Finding:
    """A finding of a new study about higher waves."""
    every = {"name": name, "study": study, "mark": "new", "stimulus": WAVES, "rule": {"kind": "rises"}}
    return Finding.model_validate(MADE | every | values)


FEW = Findings(
    finding=[finding("higher", "A 1990"), finding("lower", "B 2001", rule={"kind": "falls"}, mark="seen")],
    not_computable=[{"study": "C", "doi": "10.1/x", "says": "smooth", "missing": "depth"}],
)


@pytest.fixture(autouse=True)
def _small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Few samples and one finger."""
    small = {False: (48, ("paper",), 1.0), True: (32, ("paper",), 1.0)}
    monkeypatch.setattr(scoreboard, "FORMS", small)
    monkeypatch.setattr("retouch.laboratory.published.page.FORMS", small)


def test_what_is_done_is_kept_and_what_is_missing_computed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pressed = []
    original = Finding.columns

    def interrupted(self: Finding, *arguments: object) -> object:
        pressed.append(self.name)
        if self.name == "lower" and pressed.count("lower") == 1:
            raise KeyboardInterrupt
        return original(self, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(Finding, "columns", interrupted)
    with pytest.raises(KeyboardInterrupt):
        compute(FEW, tmp_path, True, False, False)
    half = compute(FEW, tmp_path, True, False, True)
    assert len(half.records) == 1 and b"not pressed yet" in scoreboard_page(half)
    board = compute(FEW, tmp_path, True, False, False)
    assert pressed == ["higher", "lower", "lower"]
    assert compute(FEW, tmp_path, True, False, False) == board
    (tmp_path / "rows").joinpath(board.tables[0].rows[0].key[:12], "study.json").write_text("{torn")
    assert compute(FEW, tmp_path, True, False, False) == board
    row = tmp_path / "rows" / board.tables[0].rows[0].key[:12] / "study.json"
    for columns in ({}, {"V, right": 1, "V, numbers": None}):
        row.write_text(json.dumps({"key": board.tables[0].rows[0].key, "columns": columns}))
        assert len(compute(FEW, tmp_path, True, False, True).records) == 1
    assert pressed[3:] == ["higher"]
    compute(FEW, tmp_path, True, True, False)
    assert pressed[4:] == ["higher", "lower"]


def test_texts_may_change_and_stimuli_not(tmp_path: Path) -> None:
    first = compute(FEW, tmp_path, True, False, False)
    retold = FEW.finding[0].model_copy(update={"says": "otherwise", "doi": "10.1/y"})
    again = compute(Findings(finding=[retold], not_computable=[]), tmp_path, True, False, True)
    assert again.records == {key: first.records[key] for key in again.records} != {}
    higher = retold.model_copy(update={"stimulus": WAVES | {"high_mm": [0.1, 0.4]}})
    assert not compute(Findings(finding=[higher], not_computable=[]), tmp_path, True, False, True).records


def test_forms_do_not_share_a_folder_and_other_files_stay(tmp_path: Path) -> None:
    out = tmp_path / "board"
    board = compute(FEW, out, True, False, False)
    (out / "study.json").write_bytes(board.model_dump_json().encode())
    with pytest.raises(InputError, match="holds the quick form"):
        compute(FEW, out, False, False, False)
    (tmp_path / "thesis.txt").touch()
    with pytest.raises(InputError, match="not a study's"):
        compute(FEW, tmp_path, True, False, False)


def test_agreement_takes_studies_as_the_unit() -> None:
    def right(by_v: bool, by_other: bool) -> dict[str, bool | int | float | str | None]:
        return {RIGHT.format(V): by_v, RIGHT.format("strain_mean"): by_other}

    rows = [
        (finding("a", "A"), "paper", right(True, True)),
        (finding("b", "A"), "paper", right(False, True)),
        (finding("c", "B", dimensions="assumed"), "paper", right(True, False)),
        (finding("d", "B", against="c"), "paper", right(False, False)),
        (finding("e", "C", mark="seen"), "paper", right(False, False)),
        (finding("f", "D"), "measured", right(False, False)),
    ]
    by_v, by_strain = agreements("new", "paper", rows)
    assert (by_v["right"], by_v["rows"], by_v["studies"]) == (2, 3, 2)
    # A has half of its rows right, and B its one that is not contested.
    assert by_v["share"] == pytest.approx(0.75)
    # Wilson's interval of 0.75 with n = 2, by his formula.
    assert (by_v["low"], by_v["high"]) == pytest.approx((0.1979, 0.9733), abs=2e-4)
    assert (by_strain["gained"], by_strain["lost"], by_strain["p"]) == (1, 1, 1.0)
    (stated, _) = agreements("new, dimensions stated", "paper", rows)
    assert (stated["rows"], stated["share"]) == (2, 0.5)
    (known, _) = agreements("known or fitted", "paper", rows)
    assert (known["rows"], known["share"], known["p"]) == (1, 0.0, 1.0)


def test_the_sign_test_is_exact() -> None:
    rows = [
        (finding(str(n), str(n)), "paper", {RIGHT.format(V): False, RIGHT.format("strain_mean"): True})
        for n in range(6)
    ]
    *_, one = agreements("new", "paper", rows)  # type: ignore[arg-type]
    assert one["p"] == pytest.approx(2.0 / 2**6)


@pytest.mark.slow
def test_the_page_shows_every_row_and_fits_every_window(tmp_path: Path) -> None:
    rows = [*FEW.finding, finding("contested", "D", against="higher", assumed="force", doi="10.1/z")]
    board = compute(Findings(finding=rows, not_computable=FEW.not_computable), tmp_path, True, False, False)
    page = scoreboard_page(board)
    for text in ("A 1990", "contradicts “higher”", "https://doi.org/10.1/z", "depth", "None does"):
        assert text.encode() in page, text
    file = tmp_path / "index.html"
    file.write_bytes(page)
    if chromium():
        with Browser() as browser:
            for width in WIDTHS:
                assert not faults(browser, file, width)


@pytest.mark.slow
def test_the_command_writes_the_study(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("retouch.verbs.studying.load_findings", lambda: FEW)
    out = tmp_path / "published"
    assert main(["study", "published", "--quick", "-o", str(out), "--json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert [Path(name).name for name in told["files"]] == ["index.html", "rows.csv", "study.json"]
    assert all(Path(name).is_file() for name in told["files"])
    assert {row["finding"] for row in told["rows"]} == {"higher", "lower"}
    board = Scoreboard.model_validate_json((out / "study.json").read_bytes())
    assert board.quick and {one["group"] for one in board.agreement} == set(GROUPS)
    tables = retouch.study("published", out, quick=True, redraw=True, quiet=True)
    assert (tables.done, tables.missing, tables.complete) == (2, 0, True)


@pytest.mark.parametrize(
    "option", [["--textures", "."], ["--from", "x.json"], ["--workers", "2"], ["--dask", "local"]]
)
def test_options_of_runs_are_refused(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], option: list[str]
) -> None:
    assert main(["study", "published", "-o", str(tmp_path / "out"), *option]) == 2
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "published: takes no textures" in error
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
def test_the_list_has_the_scoreboard() -> None:
    listed = {one["name"]: one for one in retouch.list_studies()}["published"]
    assert listed["whole"]["rows"] == len(load_findings().finding)
    with pytest.raises(InputError, match="published"):
        retouch.study("publishes")
