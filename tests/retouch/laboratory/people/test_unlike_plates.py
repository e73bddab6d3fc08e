"""People who had unlike plates, and people who answered the other way round."""

import itertools
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest

import retouch
from retouch.laboratory.people.scores import bradley_terry

LABELS = ["smoothest", "smooth", "middle", "rough", "roughest"]
VALUES = dict(zip(LABELS, (0.03, 0.036, 0.043, 0.051, 0.061), strict=True))
SOME = {"P1": LABELS[:3], "P2": LABELS[2:], "P3": LABELS[:3], "P4": LABELS[2:]}
APART = {"P1": LABELS[:2], "P2": LABELS[2:]}


@pytest.fixture
def plates(tmp_path: Path) -> Path:
    """A set of five plates of a texture, without a plan; contact areas fall by roughness."""
    rows = [f"stone,{label},roughness,{k - 2},{v},{1.0 / v}" for k, (label, v) in enumerate(VALUES.items())]
    (tmp_path / "plates.csv").write_text(
        "\n".join(["texture,label,kind,level,roughness,contact_area_mm2", *rows])
    )
    return tmp_path


def answered(folder: Path, headings: str, rows: Iterable[object]) -> dict:
    """What `retouch answers` finds in a table."""
    file = folder / "table.csv"
    file.write_text(headings + "\n" + "\n".join(map(str, rows)))
    return retouch.answers(folder, [file]).as_json()


def rated(folder: Path, some: dict[str, list[str]], falling: tuple[str, ...] = ()) -> dict:
    rows: list[str] = []
    for person, labels in some.items():
        scale, power = 1.0 + len(rows), -1.5 if person in falling else 1.5
        rows += [f"{person},{label},{scale * (20 * VALUES[label]) ** power:.4f}" for label in labels]
    return answered(folder, "person,plate,magnitude", rows)


def sorted_by(folder: Path, orders: Iterable[tuple[str, Iterable[str]]]) -> dict:
    rows = [
        f"{person},{number},{place},{label}"
        for number, (person, labels) in enumerate(orders)
        for place, label in enumerate(labels, start=1)
    ]
    return answered(folder, "person,sort,place,plate", rows)


def compared(folder: Path, pairs: Iterable[tuple[str, str, str, str]], question: str = "rougher") -> dict:
    return answered(folder, f"person,first,second,{question}", map(",".join, pairs))


def pairs_of(
    people: Iterable[str], reversed_people: tuple[str, ...], number: int = 100, right: float = 0.9
) -> list[tuple[str, str, str, str]]:
    """Random pairs of the five plates, told right with a probability, or wrong by reversed people."""
    rng, pairs = np.random.default_rng(1), []
    for person in people:
        for _ in range(number):
            one, two = rng.choice(5, 2, replace=False)
            told = max(one, two) if (rng.random() < right) != (person in reversed_people) else min(one, two)
            pairs.append((person, LABELS[one], LABELS[two], LABELS[told]))
    return pairs


def test_magnitudes_of_people_with_unlike_plates_are_told_as_rated(plates: Path) -> None:
    found = rated(plates, SOME)["magnitudes"]
    told = {one["plate"]: one["relative_magnitude"] for one in found["plates"]}
    expected = [(VALUES[high] / VALUES[low]) ** 1.5 for low, high in itertools.pairwise(LABELS)]
    assert [told[high] / told[low] for low, high in itertools.pairwise(LABELS)] == pytest.approx(
        expected, rel=1e-3
    )
    assert found["order"][0]["spearman"] == 1.0 and not found["notes"]


def test_magnitudes_of_people_with_the_same_plates_are_means(plates: Path) -> None:
    rng = np.random.default_rng(0)
    logs = rng.normal(size=(3, 5))
    ratings = {(i, j): np.exp(logs[i, j] + i) for i in range(3) for j in range(5)}
    rows = [f"P{i},{LABELS[j]},{rating:.12f}" for (i, j), rating in ratings.items()]
    found = answered(plates, "person,plate,magnitude", rows)
    told = {one["plate"]: one["relative_magnitude"] for one in found["magnitudes"]["plates"]}
    mean = np.exp((logs - logs.mean(axis=1, keepdims=True)).mean(axis=0))
    assert [told[label] for label in LABELS] == pytest.approx(mean.tolist())


def test_orders_of_people_with_unlike_plates_are_told_as_answered(plates: Path) -> None:
    sorts = sorted_by(plates, [*SOME.items(), ("P5", ["smooth", "rough"]), ("P1", SOME["P1"])])["sorts"]
    pairs = [
        (person, *pair, pair[0] if LABELS.index(pair[0]) > LABELS.index(pair[1]) else pair[1])
        for person, labels in SOME.items()
        for pair in itertools.permutations(labels, 2)
    ]
    for found in (sorts, compared(plates, pairs)):
        assert list(found["order"]) == [{"texture": "stone", "plates": 5, "spearman": 1.0, "kendall": 1.0}]


def test_plates_that_no_answers_link_are_named(plates: Path) -> None:
    for found, question in (
        (rated(plates, APART), "magnitudes"),
        (sorted_by(plates, APART.items()), "sorts"),
    ):
        line = next(note for note in found["notes"] if note.startswith(f"{question}: no answers order"))
        assert "(6 such pairs)" in line
        assert [(one["plates"], one["spearman"]) for one in found[question]["order"]] == [(3, 1.0)]


def test_plates_that_are_linked_may_have_no_order(plates: Path) -> None:
    """Both are smoother than the middle one, and nobody compared the two."""
    found = sorted_by(plates, [("P1", ["smoothest", "middle", "rough"]), ("P2", ["smooth", "middle"])])
    assert "no answers order smooth and smoothest" in found["notes"][0] and "(1 such" in found["notes"][0]
    assert found["sorts"]["order"][0]["plates"] == 3


def test_scores_are_the_likeliest() -> None:
    above = np.array([[0.0, 3.0, 1.0], [1.0, 0.0, 4.0], [2.0, 1.0, 0.0]])
    scores = bradley_terry(above)
    shares = 1.0 / (1.0 + np.exp(scores - scores[:, None]))
    assert (above + above.T) * shares @ np.ones(3) == pytest.approx(above.sum(axis=1), abs=1e-6)


@pytest.mark.parametrize("question", ["rougher", "colder"])
def test_who_compared_the_other_way_round_is_named_and_left_out(plates: Path, question: str) -> None:
    # The smoother plate has the larger contact area, so that a share of 0.1 tells the colder one right.
    right, told = (0.9, 7) if question == "rougher" else (0.1, 10)
    pairs = pairs_of(("P1", "P2", "P3", "P4"), ("P3",), right=right)
    content = compared(plates, pairs, question)
    found = content if question == "rougher" else content["colder"]
    assert found["people"][2]["note"] == f"told {told} of 100 pairs right: reversed, not guessed"
    assert found["left_out"] == ["P3"] and found["answers"] == 300
    line = next(note for note in content["notes"] if note.startswith(f"{question}: P3 told {told} of"))
    assert "--without P3" in line
    of_others = compared(plates, [pair for pair in pairs if pair[0] != "P3"], question)
    of_others = of_others if question == "rougher" else of_others["colder"]
    assert found["weber"] == of_others["weber"] and found["order"] == of_others["order"]


def test_who_guesses_is_not_reversed(plates: Path) -> None:
    found = compared(plates, [*pairs_of(("P1", "P2"), ()), *pairs_of(("P3",), (), right=0.5)])
    assert found["left_out"] == [] and "no better than guessing" in found["people"][2]["note"]


def test_who_exchanged_the_keys_in_between_is_named(plates: Path) -> None:
    pairs = [*pairs_of(("P1", "P2"), ()), *pairs_of(("P3",), (), 40), *pairs_of(("P3",), ("P3",), 40)]
    found = compared(plates, pairs)
    (line,) = (note for note in found["notes"] if "half of P" in note)
    assert line.startswith("rougher: the second half of P3's answers told") and found["left_out"] == []


def test_most_people_are_not_left_out(plates: Path) -> None:
    """Where most are reversed, the values may be."""
    found = compared(plates, pairs_of(("P1", "P2", "P3"), ("P1", "P3")))
    assert found["left_out"] == [] and found["answers"] == 300
    assert sum("kept, as more than half of the people are" in note for note in found["notes"]) == 2
    assert "reversed" in compared(plates, pairs_of(("P1",), ("P1",)))["people"][0]["note"]


def test_reversed_sorts_and_magnitudes_are_named_and_left_out(plates: Path) -> None:
    orders = [(person, LABELS[:: -1 if person == "P3" else 1]) for person in ("P1", "P2", "P3")]
    ratings = rated(plates, dict.fromkeys(("P1", "P2", "P3"), LABELS), falling=("P3",))
    for found, question in ((sorted_by(plates, orders), "sorts"), (ratings, "magnitudes")):
        assert found[question]["people"] == 2 and found[question]["order"][0]["spearman"] == 1.0
        said = "told 0 of 10 pairs right" if question == "sorts" else "gave numbers that fall with V"
        line = f"{question}: P3 {said}: reversed, not guessed; left out"
        assert any(note.startswith(line) for note in found["notes"])
    assert ratings["magnitudes"]["exponent"] == pytest.approx(1.5, abs=0.01)
    assert rated(plates, SOME, falling=("P2",))["magnitudes"]["people"] == 3


def test_who_rates_all_plates_alike_is_not_reversed(plates: Path) -> None:
    rows = [f"P{number},{label},{0.1 + number}" for number in range(20) for label in LABELS]
    found = answered(plates, "person,plate,magnitude", rows)["magnitudes"]
    assert found["people"] == 20 and not found["notes"] and not found["order"]
