"""A fingertip of one's own is put under the bone, refused in one line, and feels beside its round finger."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from manifold3d import Manifold

import retouch
from relief.ground.errors import InputError
from relief.heightmap import save_heights_exr
from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts
from relief.solids.files.mesh import Mesh
from retouch.commands.main import main
from retouch.verbs.fingers import own_finger
from retouch.verbs.fingers.own_finger import OwnFinger
from tactile import Skin
from tactile.unstructured import meshing

SOFT = Skin(young_modulus_mpa=0.05, force_n=1.0)


def cut(solid: Manifold, thickness_mm: float = 4.0) -> Body:
    """What lies up to a thickness above the lowest point."""
    lowest = solid.bounding_box()[2]
    mesh = solid.trim_by_plane((0.0, 0.0, -1.0), -(lowest + thickness_mm)).to_mesh()
    return Body(np.asarray(mesh.vert_properties, float)[:, :3], np.asarray(mesh.tri_verts, np.intp))


def placed(body: Body, skin: Skin = SOFT) -> OwnFinger:
    return own_finger.own_finger(Mesh(body, None, Path("tip.stl")), skin)


def ball() -> Manifold:
    return Manifold.sphere(8.0, 96)


def rod() -> Manifold:
    """Along y."""
    return Manifold.cylinder(20.0, 8.0, circular_segments=96, center=True).rotate((90.0, 0.0, 0.0))


def bored() -> Manifold:
    """A ball with a bore whose ends are in the lower face."""
    return ball() - rod().scale((0.125, 1.0, 0.125)).translate((0.0, 0.0, -5.5))


CAP = cut(ball())


def turned(body: Body, *signs: float) -> Body:
    return Body(body.vertices * signs, body.faces)


@pytest.mark.parametrize(
    ("solid", "scale", "along", "across"),
    [
        (ball, (1.0, 1.0, 1.0), 8.0, 8.0),
        (ball, (1.0, 1.5, 1.0), 18.0, 8.0),
        (rod, (1.0, 1.0, 1.0), 100.0, 8.0),
    ],
)
def test_a_fingertip_lies_in_the_middle_and_has_the_radii_of_its_lower_face(
    solid: Callable[[], Manifold], scale: tuple[float, float, float], along: float, across: float
) -> None:
    finger = placed(cut(solid().scale(scale).translate((30.0, -4.0, 7.0))))
    assert finger.skin.shape == "round" and finger.skin.thickness_mm == pytest.approx(4.0, abs=1e-4)
    assert finger.skin.radii_mm == pytest.approx((along, across), rel=0.04)
    low, high = finger.surface.vertices.min(axis=0), finger.surface.vertices.max(axis=0)
    assert low + high == pytest.approx([0.0, 0.0, 4.0], abs=1e-3) and low[2] == 0.0
    assert 9.0 <= finger.square_mm <= own_finger.WIDEST_MM
    assert "tip.stl: 4.00 mm from the lowest place to the bone" in finger.line


def test_noise_hardly_changes_the_radii() -> None:
    noise = np.random.default_rng(0).normal(0.0, 0.01, CAP.vertices.shape)
    noise[CAP.vertices[:, 2] > CAP.vertices[:, 2].max() - 1e-3] = 0.0
    finger = placed(Body(CAP.vertices + noise, CAP.faces))
    assert finger.skin.radii_mm == pytest.approx((8.0, 8.0), rel=0.1)


def joined(one: Body, other: Body) -> Body:
    faces = np.concatenate((one.faces, other.faces + len(one.vertices)))
    return Body(np.concatenate((one.vertices, other.vertices)), faces)


@pytest.mark.parametrize(
    ("body", "fault"),
    [
        (turned(CAP, 1.0, -1.0, -1.0), "is upside down: its flat face is below"),
        (Body(CAP.vertices[:, [2, 0, 1]], CAP.faces), "has no flat top to bond to the bone"),
        (turned(CAP, 1e-3, 1e-3, 1e-3), "measures 0.0139 x 0.0139 x 0.00400 mm, no fingertip of 6 to 45 mm"),
        (turned(CAP, 9.0, 9.0, 9.0), "or state its unit"),
        (cut(ball(), 1.0), "its lower face covers a square of 5.5 mm"),
        (cut(ball().scale((2.5, 2.5, 2.5)), 20.0), "mm³, more than 6000"),
        (turned(cut(rod().scale((0.6, 0.5, 2.0)), 21.0), 1.5, 1.0, 1.0), "skin.thickness_mm: 21"),
        (cut(bored()), "its lower face lies over itself; close bores"),
        (joined(CAP, turned(CAP, 0.1, 0.1, 0.1)), "has several parts or a closed hollow"),
        (Body(CAP.vertices, CAP.faces[:, ::-1]), "inside out"),
        (Body(CAP.vertices, CAP.faces[1:]), "not closed"),
    ],
)
def test_a_mesh_that_is_no_fingertip_is_refused_in_one_line(body: Body, fault: str) -> None:
    with pytest.raises(InputError) as caught:
        placed(body)
    assert str(caught.value).startswith("tip.stl: ") and fault in str(caught.value)


def test_millions_of_triangles_and_curved_objects_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="presses on flat objects"):
        placed(CAP, replace(SOFT, curved_x_mm=30.0))
    with pytest.raises(InputError, match=r"skin\.depth_mm: 5"):
        placed(CAP, replace(SOFT, thickness_mm=9.0, depth_mm=5.0))
    monkeypatch.setattr(own_finger, "MOST_FACES", 100)
    with pytest.raises(InputError, match="decimate the mesh"):
        placed(turned(CAP, 1.01, 1.0, 1.0))


@pytest.fixture
def files(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A texture, and a fingertip in inches."""
    monkeypatch.chdir(tmp_path)
    at = np.arange(64) / 64 * 2.0 * np.pi * 5.0
    save_heights_exr(Path("egg.exr"), 0.2 * (2.0 + np.sin(at)[:, None] + np.sin(at)))
    save_heights_exr(Path("low.exr"), 0.05 * (2.0 + np.sin(at)[:, None] + np.sin(at)))
    write_parts("tip.stl", [Part("tip", turned(CAP, *(1 / 25.4,) * 3))])


@pytest.mark.parametrize(
    ("options", "fault"),
    [
        (["--reach"], "--reach: is for fingers that --skin describes"),
        (["--model", "fem"], "--model: is for fingers"),
        (["--profile", "fine.ini"], "--profile: is for fingers"),
        (["--thickness-mm", "3"], "--thickness-mm: does not go with --finger"),
    ],
)
def test_options_of_other_fingers_do_not_go_with_it(
    files: None, options: list[str], fault: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["evaluate", "egg.exr", "--finger", "tip.stl", "--units", "in", *options]) == 2
    assert capsys.readouterr().err.splitlines()[-1].startswith(f"retouch: {fault}")


def test_the_extra_is_named_where_it_is_missing(
    files: None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(meshing, "find_spec", lambda name: None)
    assert main(["evaluate", "egg.exr", "--finger", "tip.stl", "--units", "in", "--force-n", "1.1"]) == 2
    assert "pip install 'retouch[tetrahedra]'" in capsys.readouterr().err


@pytest.mark.slow
def test_a_sphere_feels_what_its_round_finger_feels(
    files: None, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """On facets of 0.5 mm, where V is less than a tenth and A less than a seventh apart."""
    monkeypatch.setattr(own_finger, "PER_MM", 2)
    words = ["evaluate", "egg.exr", "low.exr", "--finger", "tip.stl", "--units", "in"]
    words += ["--young-modulus-mpa", "0.05", "--force-n"]
    assert main([*words, "1", "--json"]) == 0
    egg, low = json.loads(capsys.readouterr().out)
    for one in (egg, low):
        other = one["round_finger"]
        assert one["model"] == "fem" and one["finger"]["file"] == "tip.stl"
        assert one["roughness"] == pytest.approx(other["roughness"], rel=0.1)
        assert one["contact_area_mm2"] == pytest.approx(other["contact_area_mm2"], rel=0.15)
        assert one["jnd_from_first"] == pytest.approx(other["jnd_from_first"], abs=0.5)
    assert low["roughness"] < egg["roughness"] and egg["jnd_from_first"] == 0.0
    shown = retouch.evaluate("egg.exr", finger="tip.stl", units="in", skin=SOFT)
    assert shown.roughness == pytest.approx(egg["roughness"]) and shown.own is not None
    assert main([*words, "20"]) == 2
    assert "--force-n: 20 N touch" in capsys.readouterr().err
