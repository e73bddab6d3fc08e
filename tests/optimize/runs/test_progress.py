"""Lines of a run say what they are: an estimate of a step is called one."""

import numpy as np
import pytest

from optimize.descent.driver import Iterate
from optimize.descent.targets import Targets
from optimize.runs.progress import terminal


def test_the_pictures_of_a_step_are_called_an_estimate(capsys: pytest.CaptureFixture[str]) -> None:
    iterate = Iterate(
        3, np.zeros((2, 2)), {"roughness": 0.07, "contact_area_mm2": 31.0}, 0.5, 2.6512, 5.0, {}
    )
    with terminal() as show:
        show.descent(Targets.of(0.01, roughness=0.07), 9)
        show.step(iterate, 1.5)
    printed = capsys.readouterr()
    assert printed.out == ""
    assert "step   3" in printed.err and "  pictures about 2.7 %  1.5 s" in printed.err
