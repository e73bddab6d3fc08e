"""Published facts of touch: which of them a skin gets right (docs/evidence/touch.md)."""

import numpy as np
import pytest

import tactile
from benchmarks.skin.experiment_plates import dots, grating, series
from benchmarks.skin.facts import FACTS
from optimize.settings.skins import load_skin
from retouch.laboratory.published.rules import top

FELT = {one.name: one for one in series()}
RIGHT = {
    # Fact: the skins that get it right, of "paper" and "firm".
    "peak of spacing": {"firm"},  # dots are roughest 2 to 3 mm apart (Hollins and Bensmaïa 2007)
    "small dots": {"firm"},  # small dots are rougher than large ones (Blake 1997, Tymms 2017)
    "small dots, high": {"firm"},
    "spacing both ways": {"paper", "firm"},  # dots near and far are smoother than between
    "waves": {"paper", "firm"},  # gratings: an inverted U over half periods (Drewing 2016)
    "height": {"paper"},  # higher dots are rougher (Blake 1997)
}


def roughness(skin: str, name: str) -> list[float]:
    """Roughness of a series at the first of its phases."""
    plates = FELT[name].heights[:, 0].astype(np.float32)
    return tactile.roughness(tactile.press(plates, skin=load_skin(skin)).strain).tolist()


@pytest.mark.slow
@pytest.mark.parametrize("skin", ["paper", "firm"])
def test_skins_get_the_facts_right_that_the_page_says(skin: str) -> None:
    names = ("spacing", "diameter", "diameter, high", "height", "waves")
    felt = {name: roughness(skin, name) for name in names}
    right = {fact.name: fact.of(felt).right for fact in FACTS if fact.name in RIGHT}
    assert right == {name: skin in skins for name, skins in RIGHT.items()}


def test_dots_have_their_height_spacing_and_width() -> None:
    plate = dots(1.5, 0.35, 2.5, (0.0, 0.0))
    assert plate.max() == pytest.approx(0.35)
    assert np.allclose(plate, np.roll(plate, 32, axis=0))  # 2.5 of 10 mm
    # A truncated cone's volume, four by four of them.
    low, top = 0.75 + 0.35 / np.sqrt(3.0), 0.75
    volume = np.pi * 0.35 / 3.0 * (low**2 + low * top + top**2)
    assert plate.mean() == pytest.approx(16.0 * volume / 100.0, rel=1e-3)


@pytest.mark.parametrize("square", [False, True])
def test_gratings_rise_as_much_as_they_fall(square: bool) -> None:
    plate = grating(1.25, 0.3, square, 0.25)
    assert plate.mean() == pytest.approx(0.15, abs=1e-9)
    assert (plate.min(), plate.max()) == pytest.approx((0.0, 0.3), abs=2e-3)


def test_the_peak_of_a_parabola_is_found_between_samples() -> None:
    values = (1.0, 2.0, 4.0, 8.0)
    assert top(values, [-(np.log(value / 2.7) ** 2) for value in values]) == pytest.approx(2.7)
    assert top(values, [4.0, 3.0, 2.0, 1.0]) == 1.0
