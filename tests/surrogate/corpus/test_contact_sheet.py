"""The contact sheet shows every family under one light."""

import io

import numpy as np
from PIL import Image

from benchmarks.bundled.contact_sheet import (
    AMBIENT,
    ELEVATION_DEG,
    contact_sheet,
    corpus,
    examples,
    shaded,
    textures,
)
from surrogate.families import FAMILIES


def test_a_flat_plate_is_as_bright_as_the_light_is_high() -> None:
    expected = AMBIENT + (1 - AMBIENT) * np.sin(np.radians(ELEVATION_DEG))
    np.testing.assert_allclose(shaded(np.zeros((8, 8))), expected)


def test_slopes_toward_the_upper_left_are_the_brightest() -> None:
    down_right = np.add.outer(np.arange(8.0), np.arange(8.0)) * 0.5
    flat = shaded(np.zeros((8, 8)))
    assert (shaded(down_right) > flat).all()
    assert (shaded(-down_right) < flat).all()


def test_the_sheet_has_every_family() -> None:
    assert FAMILIES.keys() < examples().keys()


def test_a_sheet_is_a_picture_of_its_cells() -> None:
    rows = dict(list(corpus().items())[:3])
    with Image.open(io.BytesIO(contact_sheet(rows, across=2))) as image:
        width, height = image.size
    assert width > 2 * 3 * 128 and height > 2 * 128


def test_every_example_texture_has_a_cell_of_its_own() -> None:
    assert [len(row) for row in textures().values()] == [1] * 12
