"""Plates are felt as their height maps, whatever way they lie; bodies with a shape of their own are none."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh
from manifold3d import Manifold
from scipy.spatial.transform import Rotation

from mitsuba_scenes import find_texture
from optimize.verification.solids.mesh_feel import PLATE, feel_of
from optimize.verification.solids.plates import plates_of
from relief.heightmap import load_heights
from relief.places import centres_mm, places
from relief.relief import Relief
from relief.solids.body import Body
from relief.solids.export.back_labels import labelled
from relief.solids.export.plate_export import export_plate, plate_mesh
from relief.solids.files.mesh import Mesh, read_mesh
from relief.solids.meshes.shells import body_of, manifold_of
from relief.solids.objects.table import OBJECTS
from retouch.verbs.evaluation import Evaluation
from tactile import jnd_apart
from tactile.measures import TouchMeasures, measure_touch
from tactile.skin import Skin
from tests.relief.solids.meshes.bodies import cube, joined

SIZE_MM, SIDE = 16.0, 128


def made(manifold: Manifold) -> Body:
    return body_of(manifold)[0]


def texture(side: int = SIDE) -> np.ndarray:
    """(side, side) heights of leather, whose long waves look like a shape, a sample for each 0.125 mm, mm."""
    return np.tile(load_heights(find_texture("leather-tile")), (3, 3))[:side, :side]


@pytest.fixture(scope="module")
def plate() -> Body:
    return plate_mesh(texture(), SIZE_MM)


@pytest.fixture(scope="module")
def flat() -> TouchMeasures:
    """What is felt of the height map."""
    return measure_touch(Relief(texture(), SIZE_MM), Skin(), "layer")


def turned(body: Body, axes: str, *degrees: float) -> Body:
    turn = Rotation.from_euler(axes, np.squeeze(degrees), degrees=True).as_matrix()
    return Body(body.vertices @ turn.T + (3.0, -40.0, 7.0), body.faces)


WAYS: dict[str, Callable[[Body], Body]] = {
    "as written": lambda body: body,
    "on its side": lambda body: turned(body, "x", 90.0),
    "face down": lambda body: turned(body, "y", 180.0),
    "turned on the bed": lambda body: turned(body, "z", 30.0),
    "in the air": lambda body: turned(body, "xyz", 20.0, 50.0, 70.0),
    "raised label": lambda body: labelled(body, ["A1"], 0.4),
    "engraved label": lambda body: labelled(body, ["A1"], -0.4),
    "a thick block": lambda body: Body(
        body.vertices - (body.vertices[:, 2:] < -1.0) * (0, 0, 20.0), body.faces
    ),
}


@pytest.mark.parametrize("way", WAYS)
def test_a_plate_is_felt_as_its_height_map(way: str, plate: Body, flat: TouchMeasures) -> None:
    felt = feel_of(Mesh(WAYS[way](plate), None, Path("plate.stl")), Skin())
    assert felt.curvature == PLATE and felt.edges == 0
    # Face down, the places come in another order.
    values, expected = (np.sort(each.values["roughness"]) for each in (felt, flat))
    assert values == pytest.approx(expected, rel=1e-4)
    assert felt.contact_fraction == pytest.approx(flat.contact_fraction, rel=1e-3)


def test_waves_as_long_as_the_plate_are_texture() -> None:
    """Terrain over 25 mm, which felt 0.7 JND smoother as an object, at 20 of 49 places."""
    heights = 1.5 * load_heights(find_texture("terrain-tile"))
    assert plates_of(plate_mesh(heights, 25.0), "terrain")


@pytest.mark.parametrize("suffix", [".stl", ".3mf", ".obj"])
def test_a_file_gives_the_height_map_back_at_its_places(suffix: str, tmp_path: Path) -> None:
    heights = texture()[:96]
    mesh = read_mesh(export_plate(tmp_path / f"plate{suffix}", heights, SIZE_MM))
    (found,) = plates_of(mesh.body, "plate")
    assert np.ptp(found.relief.heights - heights) < 1e-5 and not found.bare.any()
    evaluation = Evaluation(mesh, feel_of(mesh, Skin()), "layer", Skin(), "own")
    surface = Relief(heights, SIZE_MM).surface
    down, right = centres_mm(surface, places(surface)).T
    expected = np.stack([right - 8.0, 6.0 - down], axis=1)
    assert evaluation.places.centres_mm[:, :2] == pytest.approx(expected, abs=1e-4)
    (line,) = evaluation.lines()
    assert ": a plate: felt as its height map, at 8 contact locations. Its back is flat" in line


def test_flat_pixels_of_a_printer_are_samples(tmp_path: Path) -> None:
    heights = texture()[::2, ::2]
    mesh = read_mesh(export_plate(tmp_path / "plate.stl", heights, SIZE_MM, stepped=True))
    (found,) = plates_of(mesh.body, "plate")
    assert found.relief.heights.shape == heights.shape
    assert np.ptp(found.relief.heights - heights) < 1e-5


def test_a_decimated_plate_is_within_a_twentieth_of_a_jnd(plate: Body, flat: TouchMeasures) -> None:
    coarse = made(manifold_of(plate, np.zeros(len(plate.faces), np.int64)).simplify(0.01))
    assert len(coarse.faces) < 0.9 * len(plate.faces)
    felt = feel_of(Mesh(coarse, None, Path("plate.stl")), Skin())
    assert abs(jnd_apart(felt.means["roughness"], flat.means["roughness"])) < 0.05
    assert len(felt.crops) == len(flat.values["roughness"])


def test_places_over_the_outline_and_holes_are_left_out(plate: Body) -> None:
    whole = manifold_of(plate)
    hole = Manifold.cylinder(20.0, 1.0, 1.0, 32, True).translate((6.5, 6.5, 0.0))
    felt = feel_of(Mesh(made(whole - hole), None, Path("plate.stl")), Skin())
    assert felt.curvature == PLATE and felt.edges > 0 and len(felt.crops) + felt.edges == 16
    at = np.array([crop.frame.at for crop in felt.crops])
    assert (np.abs(at[:, :2] - 6.5).max(axis=1) > 4.0).all()
    assert plates_of(made(whole ^ Manifold.cylinder(20.0, 8.0, 8.0, 64, True)), "round")[0].bare[0, 0]


def test_several_plates_in_a_file_are_felt_one_by_one(plate: Body, flat: TouchMeasures) -> None:
    other = Body(plate.vertices + np.array([20.3, 1.0, 0.0]), plate.faces)
    felt = feel_of(Mesh(joined(plate, other), None, Path("plates.stl")), Skin())
    assert felt.values["roughness"] == pytest.approx(np.tile(flat.values["roughness"], 2), rel=1e-4)


def test_a_frame_around_a_plate_makes_no_dish_of_it() -> None:
    frame = np.pad(np.zeros((160, 160)), 16, constant_values=1.5)
    assert plates_of(plate_mesh(0.5 * texture(192) * (frame == 0.0) + frame, 24.0), "framed")


def dome(sag_mm: float, relief: float, side: int = 200) -> Body:
    """A plate of 25 mm whose middle is higher than its corners."""
    y, x = np.mgrid[-1 : 1 : side * 1j, -1 : 1 : side * 1j]
    return plate_mesh(relief * texture(side) + sag_mm * (1.0 - (x * x + y * y) / 2.0), 25.0)


def cup() -> Body:
    """A mug without a handle, which stands on its flat bottom."""
    outer, inner = (Manifold.cylinder(80.0, radius, radius, 64) for radius in (35.0, 32.0))
    return made(outer - inner.translate((0.0, 0.0, 3.0)))


def with_boss() -> Body:
    plate = Manifold.cube((40.0, 40.0, 4.0), True)
    return made(plate + Manifold.cylinder(8.0, 8.0, 8.0, 64))


def of_trimesh(body: trimesh.Trimesh) -> Body:
    return Body(np.array(body.vertices), np.array(body.faces))


def back_to_back() -> Body:
    """A plate with the relief on both sides, none of which is a back."""
    one = plate_mesh(texture(), SIZE_MM)
    return made(manifold_of(one) + manifold_of(one).rotate((180.0, 0.0, 0.0)).translate((0.0, 0.0, -3.5)))


def wedge() -> Body:
    return plate_mesh(np.tile(np.linspace(0.0, 2.0, 64), (64, 1)), 20.0)


def uneven(body: Body) -> Body:
    """The body with vertices at uneven distances, as no height map has them; its outline stays."""
    vertices = body.vertices.copy()
    low, high = vertices[:, :2].min(axis=0), vertices[:, :2].max(axis=0)
    share = (vertices[:, :2] - low) / (high - low)
    vertices[:, :2] += 0.1 * np.sin(2.0 * np.pi * share)
    return Body(vertices, body.faces)


SHAPES: dict[str, Callable[[], Body]] = {
    "curved": lambda: uneven(OBJECTS["curved"].make()),
    "slider": OBJECTS["slider"].make,
    "a ball": lambda: of_trimesh(trimesh.creation.icosphere(3, 15.0)),
    "a mug": cup,
    "an upright grip": lambda: of_trimesh(trimesh.creation.cylinder(15.0, 30.0)),
    "a dome with texture": lambda: uneven(dome(3.0, 0.8)),
    "a low dome with texture": lambda: uneven(dome(1.5, 0.5)),
    "a bare dome": lambda: uneven(dome(1.0, 0.0)),
    "a wedge": lambda: uneven(wedge()),
    "both sides textured": back_to_back,
}


@pytest.mark.parametrize("name", SHAPES)
def test_a_body_with_a_shape_of_its_own_is_no_plate(name: str) -> None:
    assert plates_of(SHAPES[name](), name) == []


@pytest.mark.parametrize("make", [lambda: dome(3.0, 0.8), lambda: dome(1.0, 0.0), wedge])
def test_what_was_exported_as_a_height_map_is_a_plate_of_any_shape(make: Callable[[], Body]) -> None:
    assert len(plates_of(make(), "exported")) == 1


@pytest.mark.slow
def test_fingers_reach_the_floor_beside_a_boss() -> None:
    """As a height map its floor would be out of reach."""
    felt = feel_of(Mesh(with_boss(), None, Path("boss.stl")), Skin(), most=2)
    assert felt.curvature != PLATE


def test_a_box_is_a_plate_without_relief() -> None:
    felt = feel_of(Mesh(cube(16.0), None, Path("box.stl")), Skin())
    assert felt.curvature == PLATE and felt.means["roughness"] < 1e-6
