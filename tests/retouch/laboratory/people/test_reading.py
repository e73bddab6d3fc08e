"""Tables of answers: checked against the plan, with decimal commas, and as other programs write them."""

import csv
import io
import re
import unicodedata
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest

import retouch
from mitsuba_scenes.fingers import DEFAULT_SKIN
from retouch.commands.main import BAD_INPUT, VERBS, main
from retouch.laboratory.people.plan import planned
from retouch.laboratory.people.plates import read_plates
from retouch.laboratory.people.reading import Answers, read_answers
from retouch.laboratory.people.tables import ColumnMap

LOOSE = "person,first,second,rougher\nP1,gravel -1,gravel +2,gravel +2\n"


class Reader:
    """Reads texts as files of answers to the set of the tests."""

    def __init__(self, made: Path, folder: Path) -> None:
        self.made, self.folder = made, folder
        self.own = (made / "answers" / "answers-rougher.csv").read_text()

    def file(self, name: str, text: str | bytes) -> Path:
        file = self.folder / name
        file.write_bytes(text if isinstance(text, bytes) else text.encode())
        return file

    def read(self, *texts: str | bytes, partial: bool = False, **mapped: Mapping) -> Answers:
        files = [self.file(f"{number}.csv", text) for number, text in enumerate(texts)]
        column_map = ColumnMap(**mapped)
        return read_answers(files, read_plates(self.made), planned(self.made, {}), partial, (), column_map)

    def refused(self, *texts: str | bytes, **mapped: Any) -> str:
        with pytest.raises(retouch.InputError) as fault:
            self.read(*texts, **mapped)
        assert "\n" not in str(fault.value)
        return str(fault.value)


@pytest.fixture
def reader(made: Path, tmp_path: Path) -> Reader:
    return Reader(made, tmp_path)


@pytest.mark.parametrize("more", ["", LOOSE.replace("P1", "Ann"), LOOSE])
def test_a_file_without_trials_leaves_the_checks_of_the_others_on(reader: Reader, more: str) -> None:
    others = [more] if more else []
    lines = reader.own.splitlines()
    doubled = reader.own.replace("person,trial", "person, trial")
    assert "is answered twice; row 2 of" in reader.refused(
        reader.own, doubled + "P1,1" + lines[1][4:], *others
    )
    assert "1 trials of the plan are missing" in reader.refused("\n".join(lines[:-1]), *others)
    person, trial, first, second, _ = lines[1].split(",")
    other = reader.own.replace(lines[1], f"{person},{trial},{second},{first},{first}")
    assert "is not the plan's" in reader.refused(other, *others)


def test_a_person_names_trials_in_all_files_or_in_none(reader: Reader) -> None:
    assert "row 2: trial: missing; other answers of P1" in reader.refused(reader.own, LOOSE)
    answers = reader.read(reader.own, LOOSE.replace("P1", "Ann"))
    assert len(answers.pairs["rougher"]) == 121
    assert any("1 people name no trials of the plan;" in note for note in answers.notes)


def test_numbers_are_for_the_plates_of_the_plan(reader: Reader) -> None:
    own = (reader.made / "answers" / "answers-magnitudes.csv").read_text()
    plate = own.splitlines()[1].split(",")[2]
    other = "gravel -1" if plate != "gravel -1" else "gravel +1"
    assert f"row 2: plate: '{other}' is not the plan's" in reader.refused(own.replace(plate, other, 1))


def test_doubles_of_people_outside_the_plan_are_found(reader: Reader) -> None:
    other = reader.own.replace("P", "Q")
    rows = other.splitlines()
    assert "trial: 40 of Q3 is answered twice; row 121 is" in reader.refused("\n".join([*rows, rows[-1]]))
    assert "trial: 1 of Q1 is answered twice; row 2 of" in reader.refused(other, other + rows[1])
    assert len(reader.read(reader.own, other).pairs["rougher"]) == 240


@pytest.mark.parametrize("changed", [str, lambda text: text.replace(",", ";").replace("\n", "\r\n")])
def test_one_table_does_not_count_twice(reader: Reader, changed: Callable[[str], str]) -> None:
    text = LOOSE + "P2,gravel +2,gravel -1,gravel +2\n"
    assert "1.csv: is the same table as" in reader.refused(text, changed(text))


def columns(text: str, *names: str) -> list[list[str]]:
    rows = list(csv.DictReader(io.StringIO(text)))
    return [list(names), *([row[name] for name in names] for row in rows)]


@pytest.mark.parametrize(
    "copied",
    [
        lambda rows: (rows, [rows[0], *rows[:0:-1]]),
        lambda rows: (rows[:81], rows),
        lambda rows: (rows + rows[1:],),
        lambda rows: (rows, [[*row[::-1], "note"] for row in rows]),
    ],
    ids=["reordered", "exported again", "in one file", "other columns"],
)
def test_copies_without_trials_do_not_count_twice(reader: Reader, copied: Callable) -> None:
    rows = columns(reader.own, "person", "first", "second", "rougher")
    fault = reader.refused(*map(text_of, copied(rows)))
    assert "would count twice" in fault and "0.csv" in fault
    # A person may be asked the same twice, as trial numbers say.
    numbered = [[*row, str(k) if k else "trial"] for k, row in enumerate(rows + rows[1:])]
    again = text_of(numbered).replace("P", "Q")
    assert len(reader.read(again).pairs["rougher"]) == 240


@pytest.mark.parametrize("question", ["rougher", "magnitudes"])
def test_people_whose_answers_are_copies_are_named(reader: Reader, question: str) -> None:
    own = (reader.made / "answers" / f"answers-{question}.csv").read_text()
    notes = reader.read(own, own.replace("P", "Q")).notes
    assert any("6 people's answers are all among those of another person" in note for note in notes)
    assert not any("copies" in note for note in reader.read(own).notes)


def test_a_sort_has_the_plates_of_its_trial(reader: Reader) -> None:
    own = (reader.made / "answers" / "answers-sorts.csv").read_text()
    other = own.replace("P1,1,", "P1,0,").replace("P1,2,", "P1,1,").replace("P1,0,", "P1,2,")
    assert "row 2: plate: " in reader.refused(other) and "of trial 2" in reader.refused(other)
    lines = [line for line in own.splitlines() if ",5," not in line]
    assert "6 trials of the plan are missing" in reader.refused("\n".join(lines))
    assert len(reader.read("\n".join(lines), partial=True).sorts) == 6


def test_a_person_may_sort_twice_in_the_same_row_of_two_files(reader: Reader) -> None:
    texts = [f"person,sorts\nAnn,{texture} -1; {texture} +1;\n" for texture in ("gravel", "bark")]
    assert len(reader.read(*texts).sorts) == 2


def test_words_of_r_and_pandas(reader: Reader) -> None:
    rows = list(csv.reader(io.StringIO(reader.own)))
    floats = text_of([rows[0], *([row[0], f"{row[1]}.0", *row[2:]] for row in rows[1:])])
    assert reader.read(floats) == reader.read(reader.own)
    rows[4][-1] = "NA"
    assert "row 5: rougher: missing; --partial" in reader.refused(text_of(rows))
    assert len(reader.read(text_of(rows), partial=True).pairs["rougher"]) == 119


def test_letters_count_however_they_are_composed(reader: Reader) -> None:
    text = LOOSE.replace("P1", "Zo\u00eb")
    assert "is the same table as" in reader.refused(text, unicodedata.normalize("NFD", text))
    assert "0.csv: row 2: is no CSV table in UTF-8" in reader.refused(text.encode("cp1252"))


def test_who_always_answers_the_same_is_named_with_the_file(reader: Reader) -> None:
    same = "person,first,second,rougher\n" + 6 * "Ann,gravel -1,gravel +2,second\n"
    assert "1.csv: rougher: Ann always answers the second" in reader.refused(LOOSE, same)


MAGNITUDES = "person;plate;magnitude\nP1;gravel -1;{}\nP1;gravel +1;{}\n"


@pytest.mark.parametrize("mark", [";", "\t", ","])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16"])
def test_decimal_commas_and_tabs(reader: Reader, mark: str, encoding: str) -> None:
    table = MAGNITUDES.format('"0,305"', '"12,5"').replace(";", mark)
    assert [one.magnitude for one in reader.read(table.encode(encoding)).magnitudes] == [0.305, 12.5]


@pytest.mark.parametrize(
    ("numbers", "line"),
    [
        (("0,3", "1,000"), "row 3: magnitude: '1,000' may have decimals or thousands"),
        (("1.000", "2,5"), "row 2: magnitude: '1.000' may have decimals or thousands"),
        (("1.000,5", "2"), "'1.000,5' is not a positive number"),
        (("1_000", "2"), "'1_000' is not a positive number"),
        (("1,000,000", "2"), "'1,000,000' is not a positive number"),
    ],
)
def test_a_number_that_may_be_two_is_refused(reader: Reader, numbers: tuple[str, str], line: str) -> None:
    assert line in reader.refused(MAGNITUDES.format(*numbers))


def test_a_decimal_comma_among_commas_is_refused(reader: Reader) -> None:
    text = "person,plate,magnitude,\nP1,gravel -1,7,\nP1,gravel +2,12,5\n"
    assert "row 3: '5' stands under no heading" in reader.refused(text)


def test_points_are_decimal_where_no_number_has_a_comma(reader: Reader) -> None:
    assert reader.read(MAGNITUDES.format("1.000", "2.5")).magnitudes[0].magnitude == 1.0


# As PsychoPy writes: a mark of UTF-8, a delimiter behind each last cell, and quotes only where a cell has
# commas or line breaks; the plan was the file of conditions.
PSYCHOPY = (
    "\ufefftrials.thisN,notes,person,trial,first,second,rougher,practice.keys,key_resp.keys,key_resp.rt,"
    "participant,date,psychopyVersion,\n"
    ',,,,,,,,space,,P1,2026-03-02_10h12.31.120,2024.2.4,\n0,"touch,\nlook",,,gravel -1,gravel +1,,,left,,'
    "P1,2026-03-02_10h12.31.120,2024.2.4,\n"
)
FOREIGN = {"person": "participant", "rougher": "key_resp.keys"}
LEFT_RIGHT = {"rougher": {"left": "first", "right": "second"}}


def psychopy(own: str, rows: int, answers: Mapping[int, str]) -> str:
    """The first trials of P1 as data of PsychoPy."""
    text = PSYCHOPY
    for number, row in enumerate(list(csv.DictReader(io.StringIO(own)))[:rows]):
        key = answers.get(number, "left" if row["rougher"] == row["first"] else "right")
        text += f"{number},,X,{row['trial']},{row['first']},{row['second']},None,,{key},1.25,P1,,2024.2.4,\n"
    return text


def test_tables_of_psychopy(reader: Reader) -> None:
    expected = reader.read(reader.own).pairs["rougher"][:40]
    answers = reader.read(psychopy(reader.own, 40, {}), columns=FOREIGN, values=LEFT_RIGHT)
    assert answers.pairs["rougher"] == expected
    assert answers.notes[0].startswith("2 rows of the files are no answers")
    assert "row 5: rougher: missing" in reader.refused(
        psychopy(reader.own, 40, {0: "None"}), columns=FOREIGN, values=LEFT_RIGHT
    )
    fault = reader.refused(psychopy(reader.own, 40, {0: "up"}), columns=FOREIGN, values=LEFT_RIGHT)
    assert "row 5: rougher: 'up' is neither" in fault
    assert "trials of the plan are missing" in reader.refused(
        psychopy(reader.own, 39, {}), columns=FOREIGN, values=LEFT_RIGHT
    )
    fault = reader.refused(psychopy(reader.own, 0, {}), columns=FOREIGN, values=LEFT_RIGHT)
    assert "0.csv: has no answers" in fault
    fault = reader.refused(psychopy(reader.own, 40, {}), columns=FOREIGN | {"person": "particpant"})
    assert "columns: person:" in fault and "has no column 'particpant'" in fault


def jspsych(rows: list[dict[str, str]]) -> str:
    """Rows as jsPsych writes them: all cells quoted, and columns that a row lacks empty."""
    headings = list(dict.fromkeys(name for row in rows for name in row))
    text = io.StringIO()
    table = csv.DictWriter(text, headings, "", quoting=csv.QUOTE_ALL)
    table.writeheader()
    table.writerows(rows)
    return text.getvalue()


def test_tables_of_jspsych(reader: Reader) -> None:
    begin = {"rt": "812", "trial_type": "html-button-response", "subject": "Ann"}
    long = '<p>Which is "rougher",\nthe first or the second?</p>' + 200_000 * "="
    trial = {**begin, "stimulus": long, "first": "gravel -1", "second": "gravel +1"}
    rows = [
        {**begin, "trial_type": "preload", "success": "true"},
        {**begin, "response": "0", "stimulus": "<p>Begin</p>"},
        {**trial, "response": "1"},
        {**trial, "response": "0"},
        {**trial, "response": "null"},
        {**begin, "same_answer": "1", "first": "bark +1", "second": "bark +2"},
    ]
    columns = {"person": "subject", "rougher": "response", "same": "same_answer"}
    values = {"rougher": {"0": "first", "1": "second"}, "same": {"0": "yes", "1": "no"}}
    assert "row 9: rougher: missing" in reader.refused(jspsych(rows), columns=columns, values=values)
    answers = reader.read(jspsych(rows), partial=True, columns=columns, values=values)
    assert [one.told for one in answers.pairs["rougher"]] == ["gravel +1", "gravel -1"]
    assert [one.told for one in answers.pairs["same"]] == ["no"]
    assert "rougher: 1 trials have no answer" in answers.notes
    assert any(note.startswith("2 rows of the files are no answers") for note in answers.notes)


def qualtrics(reader: Reader, column: str, person: str = "P1") -> list[list[str]]:
    """The rougher plates of three people in a row each, and a sort of the first, as Qualtrics writes them."""
    own = list(csv.DictReader(io.StringIO(reader.own)))
    headings = ["StartDate", "ResponseId", "Who", *(column.replace("#", str(k)) for k in range(1, 41))]
    texts = ["Start Date", "Response ID", "Who are you?", *(40 * [400 * "Which plate feels rougher? "])]
    imports = [f'{{"ImportId":"{name}","timeZone":"Europe/Berlin"}}' for name in headings]
    rows = [headings, texts, imports]
    for number, name in enumerate((person, "P2", "P3")):
        told = [row["rougher"] for row in own[40 * number : 40 * number + 40]]
        firsts = [row["first"] for row in own[40 * number : 40 * number + 40]]
        answers = ["1" if one == first else "2" for one, first in zip(told, firsts, strict=True)]
        rows.append(["2026-03-02 10:12:31", f"R_{number}", name, *answers])
    return rows


def text_of(rows: list[list[str]], mark: str = ",") -> str:
    text = io.StringIO()
    csv.writer(text, delimiter=mark).writerows(rows)
    return text.getvalue()


WHO = {"person": "Who"}
ONE_TWO = {"rougher": {"1": "first", "2": "second", "-99": ""}}


@pytest.mark.parametrize(
    ("column", "columns"),
    [
        ("rougher 0#", WHO),
        ("rougher_#", WHO),
        ("#_Q7", WHO | {"rougher": "#_q7"}),
        ("Q#", WHO | {f"rougher {k}": f"Q{k}" for k in range(1, 41)}),
    ],
)
def test_tables_of_qualtrics(reader: Reader, column: str, columns: dict[str, str]) -> None:
    expected = reader.read(reader.own)
    rows = qualtrics(reader, column)
    answers = reader.read(text_of(rows), columns=columns, values=ONE_TWO)
    assert answers.pairs == expected.pairs and not answers.notes
    assert reader.read(text_of(rows, "\t").encode("utf-16"), columns=columns, values=ONE_TWO) == answers
    for changed, fault in (
        ({3: "-99"}, "1 trials of the plan are missing, the first is 1 of P2"),
        ({3: "3"}, "row 5: rougher 1: rougher: '3' is neither"),
        ({3: ""}, "1 trials of the plan are missing, the first is 1 of P2"),
        ({2: "P9"}, "row 5: rougher 1: trial: P9 has no trial 1 in the plan"),
        ({2: "P1"}, "row 5: rougher 1: trial: 1 of P1 is answered twice; row 4 is the first"),
    ):
        row = [changed.get(k, cell) for k, cell in enumerate(rows[4])]
        changed_text = text_of([*rows[:4], row, rows[5]])
        assert fault in reader.refused(changed_text, columns=columns, values=ONE_TWO)


def test_a_sort_may_stand_in_one_cell(reader: Reader) -> None:
    labels = ("gravel -1", "gravel +0", "gravel +1")
    for cell in ("; ".join(labels), str(list(labels)), str(list(labels)).replace("'", '"')):
        text = text_of([["person", "sorts"], ["Ann", cell], ["Ben", ""]])
        assert [one.labels for one in reader.read(text).sorts] == [labels]
    own = (reader.made / "answers" / "answers-sorts.csv").read_text()
    rows: dict[str, list[str]] = {}
    for row in csv.DictReader(io.StringIO(own)):
        rows.setdefault(f"{row['person']} {row['trial']}", []).append(row["plate"])
    wide = [[name, "|".join(rows[f"{name} 1"]), "|".join(rows[f"{name} 2"])] for name in ("P1", "P2", "P3")]
    text = text_of([["person", "sorts 1", "sorts_2"], *wide]).replace("|", ";")
    assert reader.read(text).sorts == reader.read(own).sorts
    assert "plate: 'rock' is no plate" in reader.refused("person,sorts\nAnn,gravel -1;rock\n")
    assert "row 2: plate: 'a' is no plate" in reader.refused(f"person,sorts\nAnn,{'a;' * 9000}\n")


@pytest.mark.parametrize(
    ("words", "line"),
    [
        (("--columns", "persn=participant"), "--columns: 'persn' is no column of answers"),
        (("--columns", "person"), "--columns: 'person': expected name=value"),
        (("--columns", "person="), "has no column ''"),
        (("--values", "left=first"), "--values: 'left=first' is no column of answers"),
        (("--values", "rugher:left=first"), "--values: 'rugher' is no column of answers"),
        (("--columns", "person=who"), "--columns: person: "),
        (("--columns", "rougher=a=b"), "has no column 'a=b'"),
        (("--columns", "person=a", "--columns", "person=b"), "--columns: 'person' is there twice"),
        (("--columns", "first=key,second=Key"), "--columns: 'key' cannot stand for two columns"),
        (("--values", "rougher:1=first,1=second"), "--values: '1' is there twice"),
        (("--values", "rougher:1=first", "--values", "rougher:2=second"), "'rougher' is there twice"),
    ],
)
def test_bad_maps_are_refused(
    words: tuple[str, str], line: str, reader: Reader, capsys: pytest.CaptureFixture[str]
) -> None:
    file = reader.file("a.csv", reader.own)
    assert main(["answers", str(reader.made), str(file), *words]) == BAD_INPUT
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and line in error


def test_the_command_takes_maps(reader: Reader, capsys: pytest.CaptureFixture[str]) -> None:
    files = [
        reader.file(
            "p.csv", psychopy(reader.own, 40, {}).replace("left", "f, j").replace(",f, j,", ',"f, j",')
        )
    ]
    words = ["--columns", "person=participant", "--columns", "rougher=key_resp.keys"]
    words += ["--values", 'rougher:"f, j=first",right=second', "-o", str(reader.folder / "out")]
    assert main(["answers", str(reader.made), *map(str, files), *words]) == 0
    assert "2 rows of the files are no answers" in capsys.readouterr().out


@pytest.mark.parametrize("verb", VERBS)
def test_a_help_states_each_default_once_and_by_itself(
    verb: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", "10000")
    with pytest.raises(SystemExit):
        main([verb, "--help"])
    for line in capsys.readouterr().out.splitlines():
        assert line.count("(default") < 2 and not re.search(rf"[a-z]{DEFAULT_SKIN}\b", line)
