"""The page a run leaves behind stands alone, tells everything, and trusts nobody's text."""

from __future__ import annotations

import base64
import hashlib
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from optimize.verification.verification import Verification
from relief.ground.formatting import percent, rounded
from retouch.pages import colour_maps
from retouch.pages.content import Baseline, Report
from retouch.pages.figures import PERCENTILE, SHOWN_SIDE, change_percent
from retouch.pages.meanings import MEANINGS
from retouch.pages.page import write_report
from tests.retouch.pages.outline import Outline
from tests.retouch.pages.plausible import FINGERS, content, noisy, plausible, verified, with_sides

HOSTILE = '<script>alert("x")</script><img src=x onerror=alert(1)> & "quoted"'


def page(tmp_path: Path, report: Report) -> str:
    return write_report(tmp_path, report).read_text(encoding="utf-8")


def test_the_page_asks_nothing_of_a_network(tmp_path: Path) -> None:
    (tmp_path / "plate.stl").touch()
    text = page(tmp_path, plausible())
    assert not re.search(r"https?://", text)
    assert not re.search(r"url\(|@import|<link|<iframe|<object", text)
    fetched = Outline(text).fetched
    assert fetched
    assert {link for link in fetched if not link.startswith("data:image/png;base64,")} == {"plate.stl"}


def test_only_the_scripts_own_hash_may_run(tmp_path: Path) -> None:
    text = page(tmp_path, plausible())
    (script,) = re.findall(r"<script>(.*?)</script>", text, re.DOTALL)
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode("ascii")
    assert (
        f"default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'sha256-{digest}'" in text
    )


def test_the_page_is_well_formed_and_has_no_unfilled_place(tmp_path: Path) -> None:
    outline = Outline(page(tmp_path, plausible()))
    assert outline.open == []
    for leftover in ("{{", "{%", "None", "nan", "Undefined"):
        assert leftover not in outline.text


def test_it_shows_every_condition_before_after_and_by_difference(tmp_path: Path) -> None:
    report = plausible()
    text = page(tmp_path, report)
    for name in report.conditions:
        assert text.count(f'alt="{name}, before"') == 2  # once more beside the baseline
        assert text.count(f'alt="{name}, after"') == 1
        assert text.count(f'alt="{name}, linear scaling"') == 1
        assert text.count(f'alt="{name}, signed difference"') == 2


def test_it_tells_how_other_fingers_feel_the_change(tmp_path: Path) -> None:
    text = " ".join(Outline(page(tmp_path, plausible())).text.split())
    assert "the result is +1.65 to +2.85 just-noticeable differences from the original" in text
    assert "Stiffer skin1.00.750.04300.0573+1.65" in text and "drew" not in text
    drawn = replace(plausible(), verification=verified(touch={"fingers": {**FINGERS, "weight": 20.0}}))
    text = " ".join(Outline(page(tmp_path, drawn)).text.split())
    assert "The descent drew the others toward the change of the first, with a weight of 20:" in text


def test_it_tells_target_achieved_and_verified_roughness_and_the_odds(tmp_path: Path) -> None:
    text = " ".join(Outline(page(tmp_path, plausible())).text.split())
    for words in (
        "target 0.0700",
        "original 0.0430",
        "verified by finite elements",
        "0.0706",
        "0.0699",
        "99 of 100",
    ):
        assert words in text


def test_the_contact_fractions_are_those_of_all_places(tmp_path: Path) -> None:
    """The maps show the first place, where a larger share is in contact than in the mean."""
    told = replace(plausible(), verification=verified(touch={"initial_contact_fraction": 0.31}))
    text = Outline(page(tmp_path, told)).text
    assert "before: 55 % in contact" in text and "Contact fraction0.31\N{EN DASH}\N{EN DASH}0.48" in text
    places = {"centres_mm": [[5, 5], [5, 9]], "initial_roughness": [0.04, 0.046], "count": 2}
    steered = places | {"verified_roughness": [0.07, 0.071]}
    several = verified(touch={"initial_contact_fraction": 0.31, "places": {"count": 2, "steered": steered}})
    text = " ".join(Outline(page(tmp_path, replace(plausible(), verification=several))).text.split())
    assert "before: 55 % in contact at this place" in text and "the first of its 2 places" in text
    assert "Each number is a mean over the 2 places that were steered." in text


def test_the_noise_of_the_pictures_is_told_with_their_change(tmp_path: Path) -> None:
    text = " ".join(Outline(page(tmp_path, noisy("known", "Small."))).text.split())
    for words in (
        "to the eye a change of",
        "bounds of the mean: 2.2 to 2.4 %",
        *("4.32 ± 0.03", "4.32 ± 0.04", "4.32 ± 0.05"),
        "Small. Each picture is the mean of 4 pictures with 64 samples a pixel",
        "a standard error of 1.4 to 1.6 % of the mean picture",
        "noise alone reads as a mean change of 0.52 % of the mean picture",
    ):
        assert words in text


def test_a_change_that_noise_blurs_is_told_as_about_right(tmp_path: Path) -> None:
    text = " ".join(Outline(page(tmp_path, noisy("coarse", "Blurred."))).text.split())
    assert "to the eye a change of about" in text and "about, of the mean picture" in text


def test_a_change_within_the_noise_is_not_called_one(tmp_path: Path) -> None:
    text = " ".join(Outline(page(tmp_path, noisy("within_noise", "Lost in noise."))).text.split())
    assert "to the eye a change no larger than the noise of the pictures" in text
    assert "to the eye a change of" not in text and "Lost in noise." in text


def test_the_same_pictures_are_called_the_same(tmp_path: Path) -> None:
    text = " ".join(Outline(page(tmp_path, noisy("same", "The same."))).text.split())
    assert "to the eye the same." in text and "bounds of the mean" not in text


def test_a_scene_with_colour_is_shown_in_colour(tmp_path: Path) -> None:
    report = plausible()
    note = "every number follow luminance"
    assert note not in page(tmp_path, report)
    tint = np.array([1.0, 0.5, 0.2])
    before, after = (side.pictures[..., None] * tint for side in report.sides)
    shown = page(tmp_path, with_sides(report, colours=(before, after)))
    assert note in shown and len(shown) < 6e6
    exposed = min(report.white, float(np.percentile(report.before.pictures, PERCENTILE)))
    assert colour_maps.picture_uri(before[0], exposed, SHOWN_SIDE) in shown


def test_hostile_words_stay_words(tmp_path: Path) -> None:
    report = plausible()
    hostile = replace(
        report,
        title=HOSTILE,
        conditions=[HOSTILE] * 3,
        verification=verified(stop={"reason": HOSTILE, "message": HOSTILE, "steps": 1}),
        settings={HOSTILE: HOSTILE},
        baseline=Baseline(HOSTILE, report.before.pictures),
    )
    outline = Outline(page(tmp_path, hostile))
    assert outline.tags.count("script") == 2  # heights of the figure whose lamp moves, and the program
    assert outline.handlers == []
    assert "x" not in outline.fetched
    assert HOSTILE in outline.text


def test_a_run_without_roughness_verification_pressure_history_or_baseline_has_its_page(
    tmp_path: Path,
) -> None:
    touch = {"target_contact_area_mm2": 45.0, "contact_area_mm2": 45.2, "contact_fraction": 0.4}
    bare = replace(
        with_sides(plausible(), pressure=(None, None)),
        verification=Verification.from_json(content() | {"touch": touch}),
        history=[],
        baseline=None,
        settings={},
    )
    outline = Outline(page(tmp_path, bare))
    assert outline.open == []
    assert "45.2" in outline.text


def test_steps_that_went_wrong_leave_a_gap_in_the_curve(tmp_path: Path) -> None:
    report = plausible()
    broken = [*report.history, dict(report.history[-1]) | {"step": 13, "roughness": float("nan")}]
    text = page(tmp_path, replace(report, history=broken))
    assert not re.search(r"[ML][^\"]*nan", text)
    assert "nan" not in Outline(text).text


def test_energies_are_drawn_where_the_history_has_them(tmp_path: Path) -> None:
    report = plausible()
    assert "Energies" not in Outline(page(tmp_path, report)).text
    rows = [
        {**step, "energy_contact_area_mm2": 4.0 * 0.9**k, "energy_visual": 0.02 * k}
        for k, step in enumerate(report.history)
    ]
    text = Outline(page(tmp_path, replace(report, history=rows))).text
    assert "Energies, without weights" in text


@pytest.mark.slow
def test_large_pictures_under_many_lights_stay_below_6_mb(tmp_path: Path) -> None:
    small = plausible(azimuths=tuple(range(0, 360, 30)))
    noise = np.random.default_rng(0).uniform(0.0, 0.2, (12, 700, 700))
    grid = noise[0]
    large = with_sides(
        replace(small, baseline=None),
        pictures=(noise, noise[::-1]),
        strain=(grid, grid),
        pressure=(grid, grid),
        heights=(grid, grid[::-1]),
    )
    large = replace(large, baseline=Baseline("linear scaling", noise))
    assert write_report(tmp_path, large).stat().st_size < 6e6


def test_only_files_that_exist_are_offered(tmp_path: Path) -> None:
    (tmp_path / "heights.png").touch()
    text = page(tmp_path, plausible())
    assert 'href="heights.png"' in text and "white 3.00 mm" in text
    assert "plate.stl" not in text


def test_deck_card_captions_and_baseline_tell_one_number(tmp_path: Path) -> None:
    """The mean over the pixels that show the plate, in % of the mean picture over these pixels."""
    report = plausible(azimuths=(10,))
    before, after = np.full((1, 64, 64), 0.2), np.full((1, 64, 64), 0.2)
    after[:, :32] += 0.0102
    plate = np.zeros_like(before)
    plate[:, :32] = 2.0
    before[:, 32:] = 0.9
    after[:, 32:] = 0.9
    baseline = Baseline("linear scaling", before + 0.05)
    told = with_sides(replace(report, baseline=None), pictures=(before, after))
    told = replace(told, plate=plate, white=0.5, baseline=baseline)
    text = " ".join(Outline(page(tmp_path, told)).text.split())
    for words in (
        f"to the eye a change of {percent(5.1)} of the mean picture.",
        f"To the eye 5.1 % of the mean picture; rms {percent(5.1)}",
        f"changed by {percent(5.1)} of the mean picture (rms {percent(5.1)}){percent(2.04)} of white",
        f"by {percent(25)} of the mean picture instead of {percent(5.1)}",
        "The figures count the pixels that show the plate, not those beside it.",
    ):
        assert " ".join(words.split()) in text
    assert "beside it" not in Outline(page(tmp_path, report)).text


def test_conditions_count_by_the_weights_of_their_cameras(tmp_path: Path) -> None:
    report = plausible(azimuths=(10, 130))
    before = np.full((2, 64, 64), 0.2)
    after = before + np.array([0.0, 0.02])[:, None, None]
    weighted = with_sides(
        replace(report, baseline=None, cameras=np.array([0.75, 0.25])), pictures=(before, after)
    )
    text = " ".join(Outline(page(tmp_path, weighted)).text.split())
    assert " ".join(f"to the eye a change of {percent(2.5)} of".split()) in text


def test_the_lift_is_told_apart_from_the_change(tmp_path: Path) -> None:
    report = plausible()
    wave = 0.02 * np.sign(np.sin(np.arange(64) + 0.5)) * np.ones((64, 1))
    wave -= wave.mean()
    rms = 1000.0 * wave.std()
    original = report.before.relief.heights
    lifted = with_sides(report, heights=(original, original + wave + 0.45))
    (tmp_path / "plate.stl").touch()
    text = " ".join(Outline(page(tmp_path, lifted)).text.split())
    assert f"The heights change by {rounded(rms)} µm (root mean square about the mean)." in text
    assert "the whole relief is lifted by 450 µm, which a finger does not feel" in text
    assert f"The heights change by {rounded(rms)} µm (rms, without the lift)" in text
    assert f"Root mean square about the mean{original.std():.3f}" in text
    assert f"Mean height{original.mean():.3f}{lifted.after.relief.heights.mean():.3f}" in text
    same = with_sides(report, heights=(original, original + wave))
    assert "the whole relief is" not in Outline(page(tmp_path, same)).text


def test_each_headline_number_says_what_it_is(tmp_path: Path) -> None:
    text = Outline(page(tmp_path, plausible())).text
    for name in ("roughness", "jnd", "eye", "time", "dssim"):
        assert MEANINGS[name] in text


def test_the_page_says_where_the_eye_is(tmp_path: Path) -> None:
    look = {"distance_cm": 40.0, "pixels_per_degree": [89.4, 89.4, 86.0]}
    told = replace(plausible(), verification=verified(look=look))
    text = " ".join(Outline(page(tmp_path, told)).text.split())
    assert "the eye is 40 cm from the plate, where a degree of its view holds 86 to 89 pixels" in text


def test_picture_change_is_in_percent_of_white_and_of_the_mean_picture() -> None:
    before = np.full((4, 4), 0.25)
    after = before + np.array([0.01, -0.03, 0.01, -0.03])
    change = change_percent(before, after, white=0.5)
    assert change.mean_of_white == pytest.approx(4.0)
    assert change.mean_of_picture == pytest.approx(8.0)
    assert change.rms_of_white == pytest.approx(100 * np.sqrt((0.01**2 + 0.03**2) / 2) / 0.5)
    assert change.rms_of_picture == pytest.approx(2 * change.rms_of_white)
