"""`retouch answers`: numbers, the page, and what is refused in one line."""

import csv
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

import retouch
from retouch.commands.main import BAD_INPUT, main
from tests.retouch.laboratory.people.conftest import write_plates

ROUGHER = "person,first,second,rougher\n"
QUESTIONS = ("rougher", "colder", "same", "sorts", "magnitudes")


def told(argv: list[str], capsys: pytest.CaptureFixture[str]) -> dict:
    assert main([*argv, "--json"]) == 0
    content: dict = json.loads(capsys.readouterr().out)
    return content


def test_the_answers_to_every_question_are_told(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    files = [str(made / "answers" / f"answers-{question}.csv") for question in QUESTIONS]
    content = told(["answers", str(made), *files, "-o", str(tmp_path)], capsys)
    assert content["weber_low"] < 0.19 < content["weber_high"]
    assert content["weber_low"] < content["weber"] < content["weber_high"]
    assert content["predicted"]["weber"] == pytest.approx(0.19)
    assert [one["person"] for one in content["people"]] == ["P1", "P2", "P3"]
    assert all(one["answers"] == 40 for one in content["people"])
    assert all(one["spearman"] > 0.7 for one in content["order"]) and len(content["order"]) == 2
    assert content["colder"]["weber_low"] < 0.4
    assert content["colder"]["predicted"]["weber"] == pytest.approx(0.4)
    assert content["sorts"]["sorts"] == 6 and 60.0 < content["sorts"]["neighbours_percent"] <= 100.0
    assert content["sorts"]["predicted_neighbours_percent"] == pytest.approx(84.1, abs=0.1)
    assert content["magnitudes"]["exponent"] == pytest.approx(0.8, abs=0.15)
    assert content["same"]["kinds"]["roughness"]["plates"] == 8
    # Runs are not there, so nothing is known of other fingers.
    assert content["fingers"] == [] and content["best_finger"] is None
    assert (tmp_path / "answers.html").is_file()
    assert json.loads((tmp_path / "answers.json").read_text())["weber"] == content["weber"]


def test_a_person_reads_the_same(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    files = [str(made / "answers" / f"answers-{question}.csv") for question in QUESTIONS]
    assert main(["answers", str(made), *files, "-o", str(tmp_path)]) == 0
    lines = capsys.readouterr().out
    assert "rougher: predicted JND 19 %" in lines and "everybody" in lines and "neighbours sorted" in lines


def test_without_answers_the_plan_tells_how_well_it_will_know(
    made: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    power = told(["answers", str(made)], capsys)["power"]["rougher"]
    assert power["people"] == 3 and power["trials_each"] == 40
    people = [one["people"] for one in power["people_for_10_percent"]]
    assert people == sorted(people, reverse=True)
    assert main(["answers", str(made)]) == 0
    assert "3 people with 40 pairs each will know the JND to about" in capsys.readouterr().out


def test_answers_without_trials_or_plan_are_read(tmp_path: Path) -> None:
    folder = write_plates(tmp_path / "set")
    rows = "".join(
        f"Ann;gravel -1;gravel +{k};gravel +{k}\n"
        f"Ann;gravel +{k};gravel -1;gravel {'+1' if k == 1 else '-1'}\n"
        for k in (1, 2)
    )
    (tmp_path / "a.csv").write_text("\ufeff" + ROUGHER.replace(",", ";") + 3 * rows, encoding="utf-8")
    content = retouch.answers(folder, [tmp_path / "a.csv"]).content
    assert content["answers"] == 12 and content["people"][0]["note"] is not None


def test_names_cannot_write_the_page(made: Path, tmp_path: Path) -> None:
    text = (made / "answers" / "answers-rougher.csv").read_text()
    (tmp_path / "a.csv").write_text(text.replace("P1,", "<script>alert(1)</script>,"))
    page = retouch.answers(made, [tmp_path / "a.csv"], tmp_path).page
    assert page is not None
    shown = page.read_text(encoding="utf-8")
    assert "<script>alert" not in shown and "&lt;script&gt;alert" in shown


def test_a_person_may_be_left_out(made: Path, tmp_path: Path) -> None:
    file = made / "answers" / "answers-rougher.csv"
    content = retouch.answers(made, [file], tmp_path, without=["P2"]).content
    assert [one["person"] for one in content["people"]] == ["P1", "P3"]
    with pytest.raises(retouch.InputError, match="nobody is called 'P9'"):
        retouch.answers(made, [file], tmp_path, without=["P9"])


def test_missing_trials_are_left_out_on_request(made: Path, tmp_path: Path) -> None:
    lines = (made / "answers" / "answers-rougher.csv").read_text().splitlines()
    lines[4] = lines[4].rsplit(",", 1)[0] + ","
    (tmp_path / "a.csv").write_text("\n".join([*lines[:-2], ""]))
    content = retouch.answers(made, [tmp_path / "a.csv"], tmp_path, partial=True).content
    assert content["answers"] == 117
    assert "rougher: 3 trials of the plan are missing" in content["notes"]


BAD: dict[str, tuple[Callable[[list[str]], str | bytes], str]] = {
    "a label of another set": (
        lambda rows: ROUGHER + "A,x 0,x +1,x 0\n",
        "row 2: first: 'x 0' is no plate of",
    ),
    "another label than the two": (
        lambda rows: ROUGHER + "A,gravel -1,gravel +1,gravel +2\n",
        "row 2: rougher: 'gravel +2' is neither 'gravel -1' nor 'gravel +1'",
    ),
    "one plate twice": (
        lambda rows: ROUGHER + "A,gravel -1,gravel -1,gravel -1\n",
        "is the first plate as well",
    ),
    "a missing answer": (lambda rows: ROUGHER + "A,gravel -1,gravel +1,\n", "row 2: rougher: missing"),
    "nobody": (lambda rows: ROUGHER + ",gravel -1,gravel +1,gravel +1\n", "row 2: person: missing"),
    "a missing trial": (lambda rows: "\n".join(rows[:-1]), "trial: 1 trials of the plan are missing"),
    "a double trial": (lambda rows: "\n".join([*rows, rows[-1]]), "is answered twice; row 121 is the first"),
    "a trial that is no number": (
        lambda rows: "\n".join([rows[0], rows[1].replace("P1,1,", "P1,x,")]),
        "row 2: trial: 'x' is not a whole number",
    ),
    "another pair than the plan's": (
        lambda rows: "\n".join([rows[0], "P1,1,bark +1,gravel +2,bark +1"]),
        "is not the plan's",
    ),
    "always the same side": (
        lambda rows: ROUGHER + 3 * "A,gravel -1,gravel +1,gravel -1\nA,gravel +1,gravel -1,gravel +1\n",
        "A always answers the first plate",
    ),
    "no answers": (lambda rows: ROUGHER, "has no answers"),
    "an empty file": (lambda rows: "", "is empty"),
    "unknown columns": (lambda rows: "name,value\na,1\n", "its columns are those of no answers"),
    "two questions": (
        lambda rows: "person,first,second,rougher,colder\nA,a,b,a,a\n",
        "columns of two questions",
    ),
    "two columns of one name": (lambda rows: "person,first,first,second,rougher\n", "two columns 'first'"),
    "a row of too few cells": (lambda rows: ROUGHER + "A,gravel -1\n", "row 2: has 2 cells"),
    "an open quotation": (lambda rows: ROUGHER + 'A,"gravel', "is no CSV"),
    "zero bytes": (lambda rows: ROUGHER.encode() + b"A,\0,b,c\n", "has zero bytes"),
    "no text": (lambda rows: b"\x89PNG\xff\xfe", "is no CSV table in UTF-8"),
    "an endless cell": (lambda rows: ROUGHER + "A" * 1000 + ",a,b,a\n", "a cell is longer than"),
    "a negative magnitude": (
        lambda rows: "person,plate,magnitude\nA,gravel -1,-3\n",
        "row 2: magnitude: '-3' is not a positive number",
    ),
    "an endless magnitude": (
        lambda rows: "person,plate,magnitude\nA,gravel -1,1e999\n",
        "not a positive number",
    ),
    "a sort without a place": (
        lambda rows: "person,sort,place,plate\nA,1,1,gravel -1\nA,1,3,gravel +1\n",
        "has no places 1 to 2",
    ),
    "a place twice": (
        lambda rows: "person,sort,place,plate\nA,1,1,gravel -1\nA,1,1,gravel +1\n",
        "place: 1 is there twice",
    ),
    "neither yes nor no": (lambda rows: "person,first,second,same\nA,gravel -1,gravel +1,maybe\n", "'maybe'"),
}


@pytest.mark.parametrize("kind", BAD)
def test_bad_answers_are_told_in_one_line(
    kind: str, made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write, line = BAD[kind]
    content = write((made / "answers" / "answers-rougher.csv").read_text().splitlines())
    file = tmp_path / "a.csv"
    file.write_bytes(content if isinstance(content, bytes) else content.encode())
    assert main(["answers", str(made), str(file), "-o", str(tmp_path / "out")]) == BAD_INPUT
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and line in error and str(file) in error
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize(
    ("plates", "line"),
    [
        (None, "plates.csv: no such file; the folder holds no finished stimulus set"),
        ("label\na\n", "texture: this column is missing"),
        (
            "texture,label,kind,level,roughness,contact_area_mm2\na,a 0,roughness,0,,30\n",
            "roughness: missing",
        ),
        (
            2 * "texture,label,kind,level,roughness,contact_area_mm2\na,a 0,roughness,0,1,30\n",
            "roughness: 'roughness' is not a positive number",
        ),
    ],
)
def test_a_set_that_is_none_is_refused(
    plates: str | None, line: str, made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    if plates is not None:
        (tmp_path / "plates.csv").write_text(plates)
    assert main(["answers", str(tmp_path), str(made / "answers" / "answers-rougher.csv")]) == BAD_INPUT
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and line in error


def test_no_just_noticeable_difference_is_fitted_to_answers_about_smooth_plates(
    made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answers = made / "answers" / "answers-rougher.csv"
    rows = list(csv.DictReader((made / "plates.csv").read_text().splitlines()))
    label = next(csv.DictReader(answers.read_text().splitlines()))["first"]
    for row in rows:
        row["roughness"] = "0.003" if row["label"] == label else row["roughness"]
    with (tmp_path / "plates.csv").open("w") as file:
        table = csv.DictWriter(file, list(rows[0]))
        table.writeheader()
        table.writerows(rows)
    assert main(["answers", str(tmp_path), str(answers)]) == BAD_INPUT
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and "smooth: V 0.00300 is below 0.004" in error


def test_options_without_what_they_are_for_are_refused(
    made: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["answers", str(made), "--partial"]) == BAD_INPUT
    assert capsys.readouterr().err.count("\n") == 1


def test_a_damaged_plan_is_told(made: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    copy = Path(shutil.copytree(made, tmp_path / "set"))
    (copy / "experiment" / "rougher.csv").write_text("a,b\n")
    assert main(["answers", str(copy)]) == BAD_INPUT
    assert "is no table of a plan" in capsys.readouterr().err
