"""A surface that passes through itself between the vertices of its base is brought onto the base."""

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.meshes.intersections import crossing_faces, self_intersections
from relief.solids.wrapping.displacing import displaced
from relief.solids.wrapping.file_surface import FileSurface, Settings
from relief.solids.wrapping.surfaces import BaseSurface, FineSurface
from tests.relief.solids.test_wrapping import box

SETTINGS = Settings(keep_bottom=False)


def dented(deep_mm: float) -> FineSurface:
    """A box, 1 mm thick, whose surface dips in the middle of an edge on its top."""
    base = BaseSurface(FileSurface(box(12.0, 9.0, 1.0), None, {}, SETTINGS))
    faces, vertices = base.body.faces, base.body.vertices
    ends = np.stack([faces, np.roll(faces, -1, axis=1)], axis=-1)
    middles = vertices[ends].mean(axis=2)
    far = np.linalg.norm(middles - (0.0, 0.0, 0.5), axis=-1)
    base.mesh.bulges[far < far.min() + 1e-9, 2] = -4.0 * deep_mm
    everywhere = np.ones(len(faces), bool)
    return FineSurface(base, *base.rest.divided(base.body, 0.3, everywhere), everywhere)


def result_of(surface: FineSurface) -> tuple[Body, np.ndarray]:
    none, whole = np.zeros(len(surface.fine.body.vertices)), np.ones(len(surface.base.body.vertices))
    return displaced(surface, none, whole, lambda body: body)


def test_a_surface_that_passes_through_itself_is_brought_onto_the_base() -> None:
    surface = dented(1.3)
    assert self_intersections(surface.fine.body) > 0
    body, factor = result_of(surface)
    assert not len(crossing_faces(body, shallow=True))
    assert np.abs(body.vertices[:, 2]).max() < 0.5 + 1e-9
    assert 0.0 < (factor < 1.0).mean() < 0.5


def test_a_surface_that_does_not_stays() -> None:
    surface = dented(0.5)
    body, factor = result_of(surface)
    assert (body.vertices == surface.fine.body.vertices).all() and (factor == 1.0).all()
    assert np.abs(body.vertices[:, 2]).min() < 0.1


def test_a_base_that_passes_through_itself_is_refused() -> None:
    surface = dented(0.0)
    surface._flat.body.vertices[np.argmax(surface._flat.body.vertices[:, 2]), 2] = -2.0
    surface.fine = surface._raised(surface._flat)
    with pytest.raises(InputError, match=r"relief: \d+ triangles pass through others around"):
        result_of(surface)
