"""Families as tiles: they go on across their borders, at any size; textures on plates stay what they were."""

import numpy as np
import pytest

from relief.seam import LARGEST_SEAM, seams
from surrogate.corpus.recipes import STEP_MM, Recipe, heights
from surrogate.families import FAMILIES, PERIODIC
from surrogate.families.basics import border_distance, coordinates, lattice, nearest, scattered
from surrogate.families.texture_grid import Grid

SIZE = 48
AS_EVER = {
    "bark": (0.344091, 0.191620),
    "blocks": (0.419621, 0.786835),
    "brushed": (0.555437, 0.761993),
    "bumps": (0.110366, 0.001129),
    "chequer_plate": (0.179450, 0.959854),
    "cracked": (0.529372, 0.000000),
    "crossed": (0.352322, 0.322617),
    "crumpled": (0.516137, 0.297318),
    "dots": (0.292209, 0.000000),
    "fibres": (0.745766, 0.842346),
    "gaussian": (0.525533, 0.448059),
    "grating": (0.708121, 0.818787),
    "gravel": (0.464013, 0.627228),
    "hammered": (0.344221, 0.227829),
    "knit": (0.567311, 0.567337),
    "leather": (0.558920, 0.849106),
    "pebbles": (0.397815, 0.953491),
    "pores": (0.844515, 0.998489),
    "ripples": (0.427271, 0.017014),
    "scales": (0.453113, 0.063110),
    "scratches": (0.873583, 0.905884),
    "terraces": (0.470597, 0.260284),
    "terrain": (0.423328, 0.270828),
    "tiles": (0.263512, 0.103897),
    "turing": (0.469958, 0.022247),
    "weave": (0.769116, 0.775604),
    "wood": (0.582065, 0.431137),
}
"""Mean height and the height of one sample, mm, of a texture of every family, 1 mm high on 10 mm."""


def generator(seed: int) -> np.random.Generator:
    return np.random.Generator(np.random.PCG64(np.random.SeedSequence(seed)))


def recipe(name: str, draw: int = 3) -> Recipe:
    return Recipe(index=0, source=f"{name}/{draw:016x}", draw=draw, relief_mm=1.0)


@pytest.mark.parametrize("name", FAMILIES)
def test_textures_on_plates_stay_what_they_were(name: str) -> None:
    field = heights(recipe(name), samples=SIZE)
    np.testing.assert_allclose((field.mean(dtype=np.float64), field[20, 31]), AS_EVER[name], atol=2 * STEP_MM)


@pytest.mark.parametrize("name", sorted(PERIODIC - {"blocks"}))
def test_a_tile_has_no_larger_step_across_its_border_than_inside(name: str) -> None:
    """Blocks are left out, as their border is an edge of blocks by construction."""
    for seed in range(4):
        tile = FAMILIES[name](generator(seed), Grid(SIZE, 7.0, periodic=True))
        assert tile.shape == (SIZE, SIZE) and (tile.min(), tile.max()) == (0.0, 1.0)
        assert max(seams(tile)) < LARGEST_SEAM


@pytest.mark.parametrize("name", FAMILIES)
def test_any_texture_can_be_a_tile_of_any_size(name: str) -> None:
    tile = heights(recipe(name), samples=64, side_mm=14.0, periodic=True)
    assert tile.shape == (64, 64) and (tile.min(), tile.max()) == (0.0, 1.0)
    assert max(seams(tile)) < LARGEST_SEAM


def test_a_photograph_is_joined_to_a_tile() -> None:
    source = Recipe(index=0, source="scikit-image/gravel", draw=1, relief_mm=1.0)
    plate, tile = (max(seams(heights(source, samples=64, periodic=periodic))) for periodic in (False, True))
    assert tile < 1.0 < plate


def test_a_larger_plate_holds_more_of_the_same() -> None:
    small, large = (heights(recipe("pebbles"), samples=n, side_mm=n / 6.4) for n in (64, 256))
    slopes = [np.hypot(*np.gradient(field)).mean() for field in (small, large)]
    assert slopes[1] == pytest.approx(slopes[0], rel=0.25)
    assert large.mean() == pytest.approx(small.mean(), abs=0.1)


def test_a_lattice_advances_by_whole_multiples_over_the_period() -> None:
    grid = Grid(20, 10.0, periodic=True)
    for angle in (0.0, 0.4, 1.5, 2.6):
        for wide, tall in ((0.9, 1.3), (2.2, 7.0), (30.0, 40.0)):
            u, v = lattice(grid, angle, wide, tall, (2, 3))
            for cells, multiple in ((u / wide, 2), (v / tall, 3)):
                for axis in (0, 1):
                    advance = 20 * np.diff(cells, axis=axis) / multiple
                    np.testing.assert_allclose(advance, np.rint(advance[0, 0]), atol=1e-9)
                assert np.ptp(cells) > 1.0


def test_points_of_a_tile_are_nearest_across_its_borders() -> None:
    grid = Grid(16, 8.0, periodic=True)
    points = scattered(generator(1), grid, 1.7, 0.5)
    assert np.abs(points).max() <= 4.0
    x, y = coordinates(grid)
    near = nearest(points, x, y, 4, grid.period())
    apart = np.abs(x[..., None] - points[:, 0]), np.abs(y[..., None] - points[:, 1])
    every = np.sort(np.hypot(*(np.minimum(d, 8.0 - d) for d in apart)), axis=-1)
    np.testing.assert_allclose(near.distance, every[..., :4])
    distance, cell = border_distance(points[:1], x, y, grid.period())
    assert not cell.any()
    assert distance.max() == pytest.approx(4.0, abs=0.4)
