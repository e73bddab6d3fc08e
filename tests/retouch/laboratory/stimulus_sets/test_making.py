"""A set of stimuli: its levels are felt, its plates are solids, and it goes on where it was left."""

import csv
import json
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from benchmarks.shared.browser import Browser, chromium
from mitsuba_scenes import find_texture
from relief.ground.errors import InputError
from relief.ground.files import only_writer
from relief.heightmap import load_height_map, save_heights_exr
from relief.relief import Relief
from relief.solids.export.plate_export import RAISED_MM
from retouch.laboratory.palettes.palette import Palette
from retouch.laboratory.stimulus_sets.levels import study_of, write_study_file
from retouch.laboratory.stimulus_sets.making import make
from retouch.laboratory.stimulus_sets.plate_set import LABEL_MM, PrintSettings
from retouch.laboratory.stimulus_sets.plates import cut_square, plate_bodies
from retouch.laboratory.stimulus_sets.prediction import probability
from retouch.laboratory.stimulus_sets.stimulus_set import StimulusSet
from retouch.laboratory.studies import row_job
from retouch.laboratory.studies.rows import expand
from retouch.laboratory.studies.study_file import LONGEST_NAME
from retouch.pages.sentences import TextTable
from retouch.verbs.stimulus_plates import plate_fields
from tests.retouch.laboratory.stimulus_sets.conftest import request
from tests.retouch.laboratory.studies.conftest import in_process

pytestmark = pytest.mark.slow

SCALES = (("a", 1.0), ("b", 2.0))
LABELS = ["hills 0", "hills +1", "hills area 1.1", "hills +1 scaled"]


def content(out: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads((out / "stimuli.json").read_text())
    return found


def plates(out: Path) -> dict[str, dict[str, Any]]:
    return {plate["label"]: plate for texture in content(out)["textures"] for plate in texture["plates"]}


def test_two_commands_do_not_write_into_one_folder(stimuli: StimulusSet, tmp_path: Path) -> None:
    with only_writer(tmp_path), pytest.raises(InputError, match="another command is writing into this"):
        make(stimuli, tmp_path, in_process)
    assert list(tmp_path.iterdir()) == []


def test_every_level_is_felt_as_designed(whole: Path, tile: Path) -> None:
    found = plates(whole)
    assert list(found) == LABELS
    for label in LABELS[:2]:
        assert found[label]["jnd"] == pytest.approx(found[label]["level"], abs=0.06)
    original = found["hills 0"]
    assert original["jnd"] == 0.0 and original["picture_change_percent"] == 0.0
    ratio = found["hills area 1.1"]["contact_area_mm2"] / original["contact_area_mm2"]
    assert ratio == pytest.approx(1.1, rel=0.011) and abs(found["hills area 1.1"]["jnd"]) < 0.06
    assert found["hills +1"]["picture_change_percent"] < found["hills +1 scaled"]["picture_change_percent"]
    untouched = load_height_map(whole / original["folder"] / "heights.exr").heights
    assert np.abs(untouched - load_height_map(tile).heights).max() < 1e-6


def test_what_people_should_tell_follows_from_what_is_felt(whole: Path) -> None:
    (texture,) = content(whole)["textures"]
    levels = texture["levels"]
    jnd = levels["jnd"]
    assert levels["judged_rougher"][1][0] == pytest.approx(probability(jnd[1] - jnd[0]), abs=1e-6)
    assert 82.0 < levels["neighbours_percent"] < 86.0
    assert levels["sorted_percent"] == pytest.approx(levels["neighbours_percent"], abs=0.01)
    fingers = {finger["name"]: finger for finger in levels["fingers"]}
    assert len(fingers) == 6 and all(finger["jnd"][0] == 0.0 for finger in fingers.values())
    softer = fingers["softer skin"]
    assert softer["neighbours_percent"] == pytest.approx(100.0 * probability(softer["jnd"][1]), abs=1e-3)
    assert texture["contact"]["labels"] == ["hills 0", "hills area 1.1"]
    (colder,) = texture["contact"]["colder_percent"]
    assert colder == pytest.approx(61.1, abs=1.5)
    pairs = {(pair["first"], pair["second"]): pair for pair in texture["pairs"]}
    assert len(pairs) == 6
    ours, scaled = (pairs["hills 0", label] for label in ("hills +1", "hills +1 scaled"))
    assert 0.0 < ours["picture_difference_percent"] < scaled["picture_difference_percent"]
    with (whole / "plates.csv").open() as file:
        assert [row["label"] for row in csv.DictReader(file)] == LABELS


def test_the_plates_are_solids_named_by_their_labels(whole: Path) -> None:
    scene: Any = trimesh.load(whole / "print" / "hills.3mf")
    assert sorted(scene.geometry) == sorted(LABELS)
    bounds = []
    for name in scene.graph.nodes_geometry:
        placement, geometry = scene.graph[name]
        solid = scene.geometry[geometry].copy().apply_transform(placement)
        assert solid.is_volume and np.allclose(solid.extents[:2], 25.0, atol=1e-4)
        assert solid.bounds[0, 2] == pytest.approx(0.0, abs=1e-6)
        bounds.append(solid.bounds[:, :2])
    low, high = np.min(bounds, axis=(0, 1)), np.max(bounds, axis=(0, 1))
    assert (low >= 0.0).all() and (high <= (120.0, 68.0)).all()
    for one in range(len(bounds)):
        for other in range(one):
            assert ((bounds[one][0] > bounds[other][1]) | (bounds[other][0] > bounds[one][1])).any(), (
                "plates overlap"
            )


def test_plates_are_the_repeated_tile_and_equally_high() -> None:
    generator = np.random.default_rng(0)
    tiles = {
        name: Relief(generator.uniform(0.0, high, (20, 20)), 10.0) for name, high in (("a", 1.0), ("b", 2.0))
    }
    heights, side_mm = cut_square(tiles["b"].heights, 10.0, 25.0)
    assert heights.shape == (50, 50) and side_mm == 25.0
    assert (heights[:20, :20] == tiles["b"].heights).all() and (
        heights[20:40, 30:] == heights[:20, 10:30]
    ).all()
    large = generator.uniform(size=(70, 60))
    middle, side_mm = cut_square(large, 30.0, 25.0)
    assert side_mm == 25.0 and (middle == large[10:60, 5:55]).all()
    means = []
    for label, body in plate_bodies(tiles, PrintSettings()).items():
        top = body.vertices[body.vertices[:, 2] > LABEL_MM + 0.5]
        inner = top[(np.abs(top[:, :2]) < 12.5).all(axis=1)]
        means.append(inner[:, 2].mean())
        assert inner[:, 2].min() >= LABEL_MM + PrintSettings().base_mm - 1e-9, label
    assert means[0] == pytest.approx(means[1], abs=1e-9)


def test_plates_of_a_printer_are_its_prints(tile: Path, tmp_path: Path) -> None:
    """Pixels as wide as the samples, layers of 60 µm, of which neither base nor label is a whole number."""
    own = {"print.pixel_um": 312.5, "print.layer_um": 60.0}
    few = request(tile)
    made = make(few.model_copy(update={"settings": few.settings | own}), tmp_path / "set", in_process)
    assert not made.content["failures"]
    found = plates(tmp_path / "set")
    assert found["hills +1"]["jnd"] == pytest.approx(1.0, abs=0.06)
    assert found["hills 0"]["jnd"] == 0.0 == found["hills 0"]["picture_change_percent"]
    for plate in found.values():
        layers = load_height_map(tmp_path / "set" / plate["folder"] / "heights.exr").heights / 0.06
        np.testing.assert_allclose(layers, np.rint(layers), atol=1e-4)
    scene: Any = trimesh.load(tmp_path / "set" / "print" / "hills.3mf")
    for solid in scene.geometry.values():
        assert solid.is_watertight and solid.bounds[0, 2] == pytest.approx(0.0, abs=1e-6)
        # The relief stands a micrometre above whole layers, so that slicers leave none out.
        top = solid.vertices[solid.vertices[:, 2] > LABEL_MM + PrintSettings().base_mm - 1e-6, 2] - RAISED_MM
        np.testing.assert_allclose(top / 0.06, np.rint(top / 0.06), atol=1e-3)
    assert "All of it is of prints, in pixels of 312.5" in (tmp_path / "set" / "index.html").read_text()


def test_what_is_done_is_not_computed_again(
    copy: Path, stimuli: StimulusSet, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun: list[str] = []
    computed = row_job._run

    def noted(job: row_job.RowJob) -> object:
        begun.append(job.folder.name)
        return computed(job)

    monkeypatch.setattr(row_job, "_run", noted)
    lost = plates(copy)["hills +1"]["folder"].split("/")[1]
    shutil.rmtree(copy / "rows" / lost)
    made = make(stimuli, copy, in_process)
    assert begun == [lost] and not made.missing
    assert list(plates(copy)) == LABELS


def test_redrawing_computes_nothing_and_takes_other_plates(copy: Path, stimuli: StimulusSet) -> None:
    shutil.rmtree(copy / "rows" / plates(copy)["hills area 1.1"]["folder"].split("/")[1])
    smaller = stimuli.model_copy(
        update={"print": PrintSettings(plate_mm=20.0, bed_mm=(50.0, 25.0), label="none")}
    )
    made = make(smaller, copy, None)
    assert made.missing == 1
    files = sorted(path.name for path in (copy / "print").iterdir())
    assert files == ["hills-1.3mf", "hills-2.3mf"]
    assert list(plates(copy)) == [label for label in LABELS if label != "hills area 1.1"]
    solid: Any = trimesh.load(copy / "print" / "hills-1.3mf", force="mesh")
    assert solid.bounds[0, 2] == pytest.approx(0.0, abs=1e-6)


def test_the_page_shows_every_plate(whole: Path) -> None:
    page = (whole / "index.html").read_text()
    for label in LABELS:
        assert f'alt="{label}"' in page
    assert page.count("data:image/jpeg") == len(LABELS) and "http" not in page.replace("http-equiv", "")


@pytest.mark.parametrize(
    ("changed", "told"),
    [
        ({"jnd": (1.0,)}, "at least two levels"),
        ({"jnd": (0.0, 1.0, 1.0)}, "jnd: 1 is given twice"),
        ({"same_roughness": True}, "same_roughness: is for levels of contact area"),
        ({"settings": {"print.printer": "mask-51"}}, "settings: print.printer: mask-51 is none of mask-22, "),
        ({"settings": {"print.layer_um": 50}}, "settings: print.pixel_um: missing; a printer needs"),
        (
            {"settings": {"print.printer": "mask-50"}, "with_scaled": True},
            "with_scaled: scaling makes no whole layers",
        ),
        ({"settings": {"touch.jnd": 3}}, "settings: touch.jnd: is no setting of a set"),
        ({"contact_area_scale": (1.0,)}, "contact_area_scale: 1 is no level"),
        ({"print": {"plate_mm": 8.0}}, "plate_mm: 8 mm is less than the 10 mm under a finger"),
        ({"print": {"bed_mm": (20.0, 90.0)}}, "a plate of 25 mm does not fit on a bed of 20 x 90 mm"),
        ({"print": {"label": "engraved", "base_mm": 0.3}}, "too thin for labels"),
        ({"sources": ["a.png", "b.png"]}, "one picture for each texture"),
    ],
)
def test_sets_that_make_no_sense_are_refused(tile: Path, changed: dict[str, object], told: str) -> None:
    with pytest.raises(ValueError, match=told):
        request(tile, **changed)


@pytest.mark.parametrize(
    ("printer", "label", "advised"),
    [
        *((name, "raised", True) for name in ("mask-50", "dlp-35", "laser-85", "filament")),
        *((name, "raised", False) for name in (None, "polyjet-16")),
        *(("mask-50", label, False) for label in ("engraved", "none")),
    ],
)
def test_a_printer_without_supports_of_its_own_engraves_better(
    tile: Path, printer: str | None, label: str, advised: bool
) -> None:
    settings = {} if printer is None else {"print.printer": printer}
    advice = request(tile, settings=settings, print={"label": label}).label_advice
    assert (advice is not None) is advised
    if advice is not None:
        assert "raised labels hold the backs 0.4 mm off the bed" in advice and "--label engraved" in advice


def test_plates_without_a_tile_are_optimised_as_a_whole(tmp_path: Path) -> None:
    path = tmp_path / "slope.exr"
    save_heights_exr(path, np.linspace(0.0, 1.0, 80)[None, :] * np.ones((80, 1)), 26.0)
    with pytest.raises(InputError, match="sides do not fit along x"):
        request(path).check_textures()
    stimuli = request(path, whole=True)
    stimuli.check_textures()
    repeats = {row.settings.repeats for row in expand(write_study_file(stimuli, [], tmp_path)).rows.values()}
    assert repeats == {False}
    with pytest.raises(InputError, match="whole: is smaller than a plate of 30 mm"):
        request(path, whole=True, print={"plate_mm": 30.0}).check_textures()


def test_the_folder_of_another_set_is_refused(copy: Path, tile: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"holds a stimulus set with other jnd, .*; choose another -o"):
        make(request(tile, jnd=(0.0, 2.0)), copy, None)
    (tmp_path / "notes").mkdir()
    (tmp_path / "notes" / "a.txt").touch()
    with pytest.raises(InputError, match="holds files that are no stimulus set's"):
        make(request(tile), tmp_path / "notes", None)


@pytest.mark.skipif(chromium() is None, reason="no Chromium here")
def test_one_plate_at_a_time_is_under_a_lamp_that_moves(whole: Path) -> None:
    """On the page of the set, and in the rows of the page of its study."""
    alive = "[...document.querySelectorAll('.plate-spot')].map((spot) => Boolean(spot.plateView))"
    opened = "document.querySelectorAll('.plate-spot canvas').length"
    with Browser(webgl=True) as browser:
        seen = browser.open(whole / "index.html", 1280)
        for number in (0, 1):
            browser.evaluate(f"document.querySelectorAll('.plate-open')[{number}].click()")
            browser.evaluate(waiting(f"document.querySelectorAll('.plate-spot')[{number}].plateView"))
            assert [place for place, on in enumerate(browser.evaluate(alive)) if on] == [number]
        browser.evaluate("document.querySelectorAll('.plate-open')[1].click()")
        assert not any(browser.evaluate(alive)) and browser.evaluate(opened) == 0
        assert seen.asked == [] and browser.complaints() == []
        browser.open(whole / "study.html", 1280)
        for number in (0, 1):
            browser.evaluate(f"document.querySelectorAll('table.rows tr[data-key] button')[{number}].click()")
            browser.evaluate(waiting("document.querySelector('.opened .plate-figure')?.plateView"))
            assert browser.evaluate("document.querySelectorAll('.opened .plate-figure').length") == 1
        assert (
            browser.evaluate("document.querySelector('.opened .plate-figure').plateView.plates.length") == 2
        )
        assert browser.complaints() == []


def waiting(condition: str) -> str:
    """A script that waits until a condition holds."""
    return f"(async () => {{ while (!({condition})) await new Promise((done) => setTimeout(done, 20)); }})()"


@pytest.mark.slow
@pytest.mark.sentinel
def test_a_smooth_texture_has_no_levels_and_no_jnd(tmp_path: Path) -> None:
    wave = 0.5 + 0.5 * np.sin(4.0 * np.pi * np.arange(32) / 32)
    save_heights_exr(tmp_path / "tiny.exr", 2.5e-4 * np.outer(wave, wave), 10.0)
    made = make(request(tmp_path / "tiny.exr", contact_area_scale=(0.99,)), tmp_path / "set", in_process)
    (refused,) = [line for line in made.numbers.failures if "smooth: V" in line]
    assert "touch.jnd: smooth" in refused and "is below 0.004, the least that people have judged" in refused
    assert made.numbers.plates and all(plate.jnd is None for plate in made.numbers.plates)
    assert made.numbers.textures[0].levels is None
    assert all(pair.second_rougher_percent is None for pair in made.numbers.textures[0].pairs)
    table, smooth = list(made.lines())[:2]
    assert isinstance(table, TextTable)
    assert all("smooth" in row for row in table.rows) and str(smooth).startswith("smooth: V 0.000")
    assert "JND" not in Path(made.page).read_text().split("<h2>Tiny</h2>")[1].split("All pairs")[0]


MANY = (
    *("bark", "brick", "dots", "grass", "gravel", "knit"),
    *("leather", "pebbles", "scratches", "terrain", "waves", "weave"),
)
"""Bundled tiles, whose names together are longer than a title."""


def test_the_study_of_many_textures_has_a_title_that_fits(tmp_path: Path) -> None:
    textures = [find_texture(f"{name}-tile") for name in MANY]
    request = Palette.checked({**plate_fields(textures, {}), "apart": 1.0})
    title = f"Palette: {', '.join(request.names)}"
    values = [{"label": name, "texture": str(file)} for name, file in zip(MANY, textures, strict=True)]
    study = study_of(request, title, [{"name": "fills", "axes": {"fill": values}}], tmp_path)
    assert len(title) > LONGEST_NAME >= len(study.title) and study.title.startswith("Palette: bark, brick")
