"""A finger is found again in answers and measurements, and open ends are said."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import retouch
from relief.ground.errors import InputError
from retouch.laboratory.people.comparisons import Question
from retouch.laboratory.people.plates import SetPlate
from retouch.laboratory.people.reading import JudgedPair
from retouch.laboratory.people.skin_fit.measurements import (
    Measurement,
    log_likelihood,
    predicted,
    read_measurements,
)
from retouch.laboratory.people.skin_fit.proposal import fitted_skin, held_out
from retouch.laboratory.people.skin_fit.tried_fingers import DEPTHS, STIFFNESS, Felt, fitted_logs, varied

PAPER, MEASURED = retouch.Skin(), retouch.load_skin("measured")
TEXTURES = ("a", "b", "c", "d", "e")
LABELS = tuple(f"{texture} {level}" for texture in TEXTURES for level in range(4))


def felt() -> Felt:
    """V of textures whose levels lie farther apart to stiff fingers, to deep receptors, or to neither."""
    level = np.tile(np.arange(4.0), len(TEXTURES)) * 0.2
    stiff = np.repeat([0.6, 0.0, -0.4, 0.3, -0.2], 4) * np.log(STIFFNESS)[:, None, None]
    deep = np.repeat([0.0, 0.9, -0.9, -0.5, 0.5], 4) * (DEPTHS - 1.0)[:, None]
    skins = tuple(tuple(varied(PAPER, one, other) for other in DEPTHS) for one in STIFFNESS)
    return Felt(skins, LABELS, level * np.exp(stiff + deep) - 3.0)


def answers(stiffness: int, depth: int, rng: np.random.Generator) -> Question:
    values = felt().values(stiffness, depth)
    pairs = []
    for person in ("A", "B"):
        for one in LABELS * 2:
            for other in LABELS:
                if one != other and one[0] == other[0]:
                    difference = math.log(values[other] / values[one]) + 0.17 * rng.standard_normal()
                    pairs.append(JudgedPair(person, one, other, other if difference > 0.0 else one))
    return Question.of("rougher", pairs)


@pytest.mark.slow
def test_the_finger_of_the_answers_is_found(rng: np.random.Generator) -> None:
    stiffness, depth = 6, 3
    question = answers(stiffness, depth, rng)
    fitted, skin = fitted_skin(fitted_logs(question, felt()), PAPER)
    truth = (STIFFNESS[stiffness] * PAPER.young_modulus_mpa, DEPTHS[depth] * PAPER.depth_mm)
    for one, true in zip(fitted, truth, strict=True):
        assert one.low is None or one.low <= true
        assert one.high is None or true <= one.high
    assert skin.depth_mm == fitted[1].value
    plates = {
        label: SetPlate(label, label[0], "roughness", 0.0, 0.05, 30.0, None, Path()) for label in LABELS
    }
    held = held_out(question, felt(), plates)
    assert held is not None and held.own > held.start and held.textures == len(TEXTURES)


def test_what_answers_do_not_tell_has_open_ends() -> None:
    flat = np.zeros((len(STIFFNESS), len(DEPTHS)))
    for one in fitted_skin(flat, PAPER)[0]:
        assert one.low is None and one.high is None


def test_stiffness_varies_all_layers() -> None:
    other = varied(MEASURED, 2.0, 1.0)
    assert other == replace(MEASURED, young_modulus_mpa=0.05, layers=((0.6, 0.26),))
    assert varied(PAPER, 1.0, 10.0).depth_mm < PAPER.thickness_mm


def test_prints_and_grooves_are_those_of_the_evidence() -> None:
    """`docs/evidence/touch.md`: 67 mm² at 1 N; log residuals of +0.23 and +0.01 at 0.06 and 0.28 mm."""
    assert predicted(Measurement(1.0, 1.0), MEASURED) == pytest.approx(67.0, rel=0.02)
    assert predicted(Measurement(2.0, 1.0, 0.35), MEASURED) == pytest.approx(0.0755, rel=0.08)
    assert predicted(Measurement(2.0, 1.0, 1.0), MEASURED) == pytest.approx(0.283, rel=0.08)


def test_a_softer_finger_prints_more_and_sinks_deeper() -> None:
    softer = varied(MEASURED, 0.5, 1.0)
    for one in (Measurement(1.0, 1.0), Measurement(1.0, 1.0, 1.0)):
        assert predicted(one, softer) > 1.1 * predicted(one, MEASURED)


def test_an_error_that_all_measurements_share_costs_less() -> None:
    grooves = [Measurement(1.0, 0.2, width) for width in (0.5, 1.0, 1.5)]
    alike = log_likelihood(grooves, [0.25] * 3)
    assert log_likelihood(grooves, [0.2] * 3) == 0.0 > alike
    assert alike > log_likelihood(grooves, [0.25, 0.16, 0.25])


@pytest.mark.parametrize(
    ("text", "line"),
    [
        ("force_n,area_mm2\n1,\n", "row 2: is neither a print"),
        ("force_n,area_mm2,groove_mm,depth_mm\n1,50,1,\n", "row 2: is neither a print"),
        ("force_n,groove_mm,depth_mm\n1,9,0.1\n", "groove_mm: 9 is outside"),
        ("force_n,area_mm2\n-1,5\n", "row 2: force_n: '-1' is not a positive number"),
        ("force,area\n1,5\n", "its columns are not some of force_n"),
        ("force_n,area_mm2\n", "has no measurements"),
    ],
)
def test_bad_measurements_are_told_in_one_line(text: str, line: str, tmp_path: Path) -> None:
    (tmp_path / "press.csv").write_text(text)
    with pytest.raises(InputError, match=rf"press\.csv: .*{line}"):
        read_measurements(tmp_path / "press.csv", MEASURED)


def test_a_flat_finger_has_no_print(tmp_path: Path) -> None:
    (tmp_path / "press.csv").write_text("force_n,area_mm2\n1,60\n")
    with pytest.raises(InputError, match="--skin measured"):
        read_measurements(tmp_path / "press.csv", PAPER)
