"""Maps over a surface: read from hostile files, brought to the samples, averaged under a finger."""

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from relief.ground.errors import InputError
from relief.maps import load_map, means_under
from relief.places import places
from relief.surface import Surface

STRIP = Surface((20, 120), 60.0)


def test_a_picture_is_grey_and_an_array_is_numbers(tmp_path: Path) -> None:
    bits = np.linspace(0, 65535, 6).astype(np.uint16)[None]
    Image.fromarray(bits).save(tmp_path / "map.png")
    np.save(tmp_path / "map.npy", bits.astype(float))
    values, grey = load_map(tmp_path / "map.png", STRIP)
    assert grey and values.shape == STRIP.shape
    assert np.array_equal(values, np.broadcast_to(np.repeat(bits[0] / 65535, 20), STRIP.shape))
    values, grey = load_map(tmp_path / "map.npy", STRIP)
    assert not grey and values[3, 119] == 65535.0


def test_a_finer_map_gives_its_nearest_values(tmp_path: Path) -> None:
    fine = np.arange(60 * 360, dtype=float).reshape(60, 360)
    np.save(tmp_path / "map.npy", fine)
    assert np.array_equal(load_map(tmp_path / "map.npy", STRIP)[0], fine[1::3, 1::3])


@pytest.mark.parametrize("shape", [(20, 121), (2, 12), (1, 6), (17, 100)])
def test_the_shorter_side_of_a_map_may_be_rounded(tmp_path: Path, shape: tuple[int, int]) -> None:
    np.save(tmp_path / "map.npy", np.ones(shape))
    assert load_map(tmp_path / "map.npy", STRIP)[0].shape == STRIP.shape


@pytest.mark.parametrize("shape", [(120, 20), (20, 20), (1, 1), (21, 120), (2, 6)])
def test_other_proportions_are_refused_with_both_shapes(tmp_path: Path, shape: tuple[int, int]) -> None:
    np.save(tmp_path / "map.npy", np.ones(shape))
    with pytest.raises(InputError, match=rf"map.npy: {shape[1]} x {shape[0]} samples .* in 120 x 20 samples"):
        load_map(tmp_path / "map.npy", STRIP)


def test_hostile_maps_are_refused_in_one_line(tmp_path: Path) -> None:
    Image.fromarray(np.arange(20 * 120 * 3, dtype=np.uint8).reshape(20, 120, 3)).save(tmp_path / "colour.png")
    np.save(tmp_path / "nan.npy", np.full(STRIP.shape, np.nan))
    np.save(tmp_path / "objects.npy", np.array([[None]]))
    (tmp_path / "cut.png").write_bytes((tmp_path / "colour.png").read_bytes()[:60])
    for name, fault in (
        ("colour.png", "is coloured"),
        ("nan.npy", "2400 values are not finite"),
        ("objects.npy", "damaged or not an NPY array"),
        ("cut.png", "damaged or not a picture"),
        ("absent.png", "no such file"),
    ):
        with pytest.raises(InputError, match=fault) as caught:
            load_map(tmp_path / name, STRIP)
        assert str(caught.value).startswith(str(tmp_path / name))
        assert "retouch prepare" not in str(caught.value)


def test_means_under_fingers_go_around_a_tile() -> None:
    tile = Surface((16, 32), 20.0, (False, True))
    values = np.zeros(tile.shape)
    values[:, :4] = 1.0
    lattice = places(tile)
    means = means_under(values, tile, lattice)
    assert means[lattice[:, 1] == 0] == pytest.approx(0.25)
    assert means[lattice[:, 1] == 28] == pytest.approx(0.25)
    assert means[lattice[:, 1] == 8] == pytest.approx(0.0)
