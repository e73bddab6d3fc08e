"""Published findings of touch: which of them a skin predicts (docs/evidence/touch.md)."""

import pytest

from optimize.settings.skins import load_skin
from retouch.laboratory.published.findings import RIGHT, V, load_findings

FINDINGS = {one.name: one for one in load_findings().finding}
RIGHT_BY = {
    "spacing of the roughest dots": {"firm"},  # 2 to 3 mm (Hollins and Bensmaïa 2007)
    "small dots, low": {"firm"},  # small dots are rougher than large ones (Blake 1997, Tymms 2017)
    "small dots, high": {"firm"},
    "spacing both ways": {"paper", "firm"},  # dots near and far are smoother than between
    "waves": {"paper", "firm"},  # gratings: an inverted U over half periods (Drewing 2016)
    "height of dots": {"paper"},  # higher dots are rougher (Blake 1997)
}
"""Finding: the skins that predict it, of "paper" and "firm"."""


@pytest.mark.slow
@pytest.mark.parametrize("skin", ["paper", "firm"])
def test_skins_predict_the_findings_that_the_page_says(skin: str) -> None:
    found = {name: FINDINGS[name].columns(load_skin(skin), 128)[RIGHT.format(V)] for name in RIGHT_BY}
    assert found == {name: skin in skins for name, skins in RIGHT_BY.items()}
