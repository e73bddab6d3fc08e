"""The bundled studies hold what their files say."""

import pytest

from mitsuba_scenes.studies import find_study
from optimize.settings.run_file import Run
from relief.ground.limits import PATCH_SIDE_MM
from relief.heightmap import load_height_map
from relief.relief import Relief
from retouch.laboratory.studies.rows import expand
from retouch.laboratory.studies.study_file import load_study
from tactile.measures import measure_touch
from tactile.quantities import CONTACT_AREA, ROUGHNESS


def textures(study: str) -> dict[str, Run]:
    """A run of each texture of a study."""
    (table,) = expand(load_study(find_study(study))).tables
    return {str(row.labels["texture"]): row.settings for row in table.rows}


def value(run: Run, quantity: str) -> float:
    """What the finger of a run gets from its texture."""
    heights = load_height_map(run.texture, relief_mm=run.relief_mm).heights
    return measure_touch(Relief(heights, PATCH_SIDE_MM), run.touch.finger, "layer").means[quantity]


@pytest.mark.slow
def test_the_seven_textures_of_figure_15_are_0_06_to_0_08_rough() -> None:
    runs = textures("figure15")
    assert len(runs) == 7
    for name, run in runs.items():
        assert 0.06 <= value(run, ROUGHNESS.name) <= 0.08, name


@pytest.mark.slow
def test_more_contact_fits_on_every_plate_of_figure_17() -> None:
    runs = textures("figure17")
    assert len(runs) == 12
    for name, run in runs.items():
        assert 1.4 * value(run, CONTACT_AREA.name) < 0.98 * PATCH_SIDE_MM**2, name


@pytest.mark.slow
@pytest.mark.parametrize("study", ["exact-vs-surrogate", "range"])
def test_the_studies_of_all_textures_have_all_twelve(study: str) -> None:
    tables = expand(load_study(find_study(study))).tables
    assert {len(table.axes["texture"]) for table in tables} <= {12, 3}
    assert len(tables[0].axes["texture"]) == 12
