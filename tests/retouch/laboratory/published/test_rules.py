"""Rules of findings: right and wrong curves of each kind."""

from typing import Any

import numpy as np
import pytest

from retouch.laboratory.published.rules import RULES, off_range, top
from tactile.jnd import ROUGHNESS_JND

AT = (1.0, 2.0, 4.0, 8.0)
CASES: list[tuple[str, dict[str, Any], list[float], list[float]]] = [
    ("rises", {}, [1.0, 1.1, 1.2, 1.3], [1.0, 1.1, 1.105, 1.3]),
    ("falls", {}, [4.0, 3.0, 2.0, 1.0], [4.0, 3.0, 3.0, 1.0]),
    ("ratio", {"of": [3, 0], "least": 2.0, "most": 3.0}, [1.0, 0.0, 0.0, 2.5], [1.0, 0.0, 0.0, 3.5]),
    ("peak", {"between": [2.0, 4.0]}, [1.0, 2.0, 2.0, 1.0], [1.0, 2.0, 3.0, 4.0]),
    ("inverted U", {}, [1.0, 2.0, 2.0, 1.0], [1.9, 2.0, 1.5, 1.0]),
    ("range", {"least": 1.0, "most": 2.0}, [0.0, 1.5, 1.5, 9.0], [0.0, 0.5, 0.5, 9.0]),
    ("curve", {"values": [10, 20, 30, 40]}, [1.0, 2.0, 3.0, 4.0], [4.0, 3.0, 2.0, 1.0]),
    (
        "curve",
        {"values": [10, 20, 30, 20], "to": [20, 40, 40, 40], "off": 0.01},
        [1.0, 3.0, 4.0, 2.0],
        [4.0, 3.0, 2.0, 1.0],
    ),
    ("correlates", {"values": [1, 2, 3, 4], "least": 0.9}, [1.0, 2.0, 3.0, 4.1], [1.0, 4.0, 2.0, 3.0]),
    ("alike", {"within": 0.1}, [1.0, 1.05, 1.1, 1.0], [1.0, 1.2, 1.0, 1.0]),
    ("stronger", {"than": [[0, 1], [2, 3]]}, [1.0, 3.0, 1.0, 0.5], [1.0, 1.5, 1.0, 0.5]),
    ("told apart", {"pairs": [[0, 1]], "least": 0.5, "most": 1.5}, [1.0, ROUGHNESS_JND], [1.0, 2.0]),
]


@pytest.mark.parametrize(("rule", "values", "right", "wrong"), CASES)
def test_a_rule_tells_right_from_wrong(
    rule: str, values: dict[str, Any], right: list[float], wrong: list[float]
) -> None:
    assert RULES[rule](right, AT, **values)[1] is not False
    assert not RULES[rule](wrong, AT, **values)[1]


def test_every_rule_is_tried() -> None:
    assert {case[0] for case in CASES} == RULES.keys()


@pytest.mark.parametrize(
    ("rule", "values"), [("ratio", {"of": [0, 1]}), ("alike", {}), ("stronger", {"than": [[0, 1]] * 2})]
)
def test_what_is_negative_has_no_ratio(rule: str, values: dict[str, Any]) -> None:
    # Strain less that under a flat plate may be.
    with pytest.raises(ValueError, match="domain"):
        RULES[rule]([-1.0, -1.05], AT[:2], **values)


def test_what_is_negative_rises_and_falls() -> None:
    assert RULES["rises"]([-2.0, -1.0, 0.5], AT[:3])[1] and not RULES["rises"]([-1.0, -2.0], AT[:2])[1]
    assert RULES["falls"]([-1.0, -2.0], AT[:2])[1] and not RULES["rises"]([1.0, 1.0], AT[:2])[1]


def test_a_smooth_plate_is_not_told_apart() -> None:
    told, right = RULES["told apart"]([0.001, 0.1], AT[:2], pairs=[[0, 1]])
    assert told == "smooth JND" and not right


def test_the_peak_of_a_parabola_is_found_between_samples() -> None:
    assert top(AT, [-(np.log(value / 2.7) ** 2) for value in AT]) == pytest.approx(2.7)
    assert top(AT, [4.0, 3.0, 2.0, 1.0]) == 1.0


def test_a_curve_inside_a_range_is_not_off() -> None:
    assert off_range([2.0, 4.0], [0.4, 0.9], [0.6, 1.0]) == pytest.approx(0.0)
    assert off_range([4.0, 4.0], [0.4, 0.9], [0.6, 1.0]) == pytest.approx(0.4 / np.sqrt(2.0))
