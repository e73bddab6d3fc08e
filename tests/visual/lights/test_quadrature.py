"""A kind of light is one row of a table: nothing else in the program knows of kinds by their names."""

import ast
from collections.abc import Callable
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import visual
from relief.ground.errors import InputError
from tests.visual.scenes import hills, sky, sun, write_scene
from visual.explain import explain_scene
from visual.lights import quadrature
from visual.lights.kind import Draw, Light, LightKind
from visual.lights.parallel import ParallelLights
from visual.lights.quadrature import KINDS
from visual.scene import Scene
from visual.scene_file.bounds import plugins

SPOT = """<emitter type="spot" id="lamp"><float name="intensity" value="4e6"/>
    <transform name="to_world"><lookat origin="0, 600, 800" target="0, 0, 0" up="0, 0, 1"/></transform>
</emitter>"""


def from_afar(light: Light, count: int, size_mm: float) -> Draw:
    """The light at the place of a lamp far away."""
    place = light.to_world[:3, 3]
    distance = float(np.linalg.norm(place))
    lamp = ParallelLights(place[None] / distance, np.array(light.strength)[None] / distance**2)
    return lambda generator: lamp


def test_the_table_holds_every_kind_of_light_that_a_scene_may_have() -> None:
    assert set(plugins("Emitter")) == set(KINDS)


def test_no_other_module_knows_a_kind_of_light_by_its_name() -> None:
    folder, own = Path(str(visual.__file__)).parent, Path(str(quadrature.__file__))
    for path in set(folder.rglob("*.py")) - {own}:
        tree = ast.parse(path.read_text(encoding="utf-8"))
        strings = {node.value for node in ast.walk(tree) if isinstance(node, ast.Constant)}
        assert not strings & KINDS.keys(), path


def test_a_new_kind_of_light_is_one_row(
    mi: ModuleType, scene_of: Callable[..., Scene], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.delitem(KINDS, "spot")
    with pytest.raises(InputError, match='emitter plugin "spot" is not allowed'):
        scene_of(SPOT)
    monkeypatch.setitem(KINDS, "spot", LightKind(lambda light: "spotlight", "intensity", from_afar))
    lines = dict(explain_scene(write_scene(tmp_path, hills(), [SPOT, sky()])))
    assert lines["lamp"] == "spotlight"
    assert "none for lamp" in lines["random rays"] and "gradients for lamp" in lines["shadow edges"]
    assert "optimize can" in lines["gradients"]
    scene = scene_of(SPOT)
    (view,) = scene.views()
    pictures = view.evaluate(scene.heights, jacobian=False).pictures
    sunlit = scene_of(sun(np.degrees(np.arcsin(0.8)), 90.0, irradiance=4.0))
    truth = sunlit.render(samples=256).numpy()
    assert np.abs(pictures - truth).mean() < 0.02 * truth.mean()
    assert float(scene.render(samples=256).mean()) == pytest.approx(truth.mean(), rel=0.02)
    assert scene.white == pytest.approx(0.8 * sunlit.white)
    refused = LightKind(lambda light: "lamp", "intensity", from_afar, lambda light, size_mm: "is too bright")
    monkeypatch.setitem(KINDS, "spot", refused)
    with pytest.raises(InputError, match="spot: is too bright"):
        scene_of(SPOT).views()
