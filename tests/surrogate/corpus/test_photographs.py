"""Pictures as heights: those of scikit-image, and those of a folder."""

import hashlib
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import ArrayLike, NDArray

from benchmarks.bundled.textures import FOLDER as EXAMPLES
from relief.ground.errors import InputError
from surrogate.corpus.photographs import bundled, by_name, crop, folder, source_of_file
from surrogate.corpus.recipes import Recipe, heights
from surrogate.corpus.splits import ASSIGNED, split_of

RAMP = np.linspace(0, 5, 64)[:, None] + np.linspace(0, 2, 80)[None, :]


def read(path: Path) -> NDArray[np.float64]:
    return np.load(path)


def put(path: Path, heights: ArrayLike = RAMP) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as file:
        np.save(file, heights)
    return path


def names(path: Path, *files: str) -> set[str]:
    return {source_of_file(path / file) for file in files}


def test_the_pictures_come_with_the_package_and_are_read_without_its_downloads(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("skimage.data._fetchers._fetch", None)
    for picture in bundled():
        values = picture.read()
        assert values.ndim == 2 and min(values.shape) > 100
        assert 0 <= values.min() < values.max() <= 1
        assert not values.flags.writeable


def test_every_picture_has_an_assigned_split_and_every_split_pictures() -> None:
    assert {picture.name for picture in bundled()} < ASSIGNED.keys()
    assert {picture.split for picture in bundled()} == {"train", "validation", "test"}


def test_the_example_textures_are_in_the_split_of_the_pictures_that_they_are_cut_from() -> None:
    for name in ("brick", "grass", "gravel"):
        assert (
            split_of(source_of_file(EXAMPLES / f"{name}.png")) == split_of(f"scikit-image/{name}") == "test"
        )


def test_the_example_textures_are_never_trained_on() -> None:
    files = sorted(EXAMPLES.glob("*.png"))
    assert len(files) == 24
    assert {split_of(source_of_file(file)) for file in files} == {"test"}


def test_a_crop_fills_the_range_and_shows_something() -> None:
    for picture in bundled():
        cut = crop(np.random.default_rng(2), picture.read(), 64)
        assert cut.shape == (64, 64)
        assert cut.min() == 0 and cut.max() == 1
        assert cut.std() > 0.02


def test_a_crop_stays_inside_a_picture_of_any_shape() -> None:
    narrow = np.tile(np.linspace(0, 1, 33), (400, 1))
    for seed in range(20):
        assert np.isfinite(crop(np.random.default_rng(seed), narrow, 32)).all()


def test_a_crop_of_a_ramp_is_a_ramp() -> None:
    cut = crop(np.random.default_rng(1), np.tile(np.linspace(0, 1, 200), (200, 1)), 64)
    inner = cut[16:48, 16:48]
    np.testing.assert_allclose(np.diff(inner, 2, axis=0), 0, atol=1e-6)
    np.testing.assert_allclose(np.diff(inner, 2, axis=1), 0, atol=1e-6)


def test_of_a_material_only_the_displacement_is_taken(tmp_path: Path) -> None:
    for number, name in enumerate(
        (
            "Bricks025_2K-PNG_Displacement.png",
            "Bricks025_2K-PNG_Color.png",
            "Bricks025.png",
            "Bricks025_2K-PNG_NormalGL.png",
            "Bricks025_2K-PNG_Roughness.png",
            "sand/brown_sand_disp_4k.exr",
            "sand/brown_sand_nor_gl_4k.exr",
            "sand/brown_sand_rough_4k.exr",
            "sand/brown_sand_diff_4k.png",
            "rough.png",
            "notes.txt",
        )
    ):
        put(tmp_path / name, RAMP + number)
    assert {source.name for source in folder(tmp_path, read)} == names(
        tmp_path, "Bricks025_2K-PNG_Displacement.png", "sand/brown_sand_disp_4k.exr", "rough.png"
    )


def test_of_one_displacement_in_several_sizes_the_largest_is_taken(tmp_path: Path) -> None:
    put(tmp_path / "a/Bricks025_1K-PNG_Displacement.png")
    put(tmp_path / "b/Bricks025_4K-PNG_Displacement.png", np.kron(RAMP, np.ones((4, 4))))
    found = folder(tmp_path, read)
    assert {source.name for source in found} == names(tmp_path, "b/Bricks025_4K-PNG_Displacement.png")


def test_displacements_named_alike_in_their_own_folders_are_told_apart(tmp_path: Path) -> None:
    put(tmp_path / "oak/height.png")
    put(tmp_path / "pine/height.png", RAMP**2)
    assert len(folder(tmp_path, read)) == 2


def test_a_copy_is_the_same_source_whatever_it_is_called(tmp_path: Path) -> None:
    put(tmp_path / "one.npy")
    put(tmp_path / "two.npy")
    (found,) = folder(tmp_path, read)
    assert found.name == "file/" + hashlib.sha256((tmp_path / "one.npy").read_bytes()).hexdigest()


def test_a_users_picture_of_any_unit_becomes_a_texture(tmp_path: Path) -> None:
    put(tmp_path / "hills.npy", 300 + 1000 * RAMP)
    sources = folder(tmp_path, read)
    texture = Recipe(index=0, source=sources[0].name, draw=1, relief_mm=2.0)
    found = heights(texture, by_name(sources))
    assert found.min() == 0 and found.max() == 2.0


@pytest.mark.parametrize(
    ("values", "complaint"),
    [
        (np.full((64, 64), 2.0), "is flat"),
        (np.full((64, 64), np.nan), "4096 heights are not finite"),
        (np.zeros((4, 64)), "at least 32 x 32"),
        (np.zeros((64, 64, 3)), "at least 32 x 32"),
    ],
)
def test_heights_of_no_use_are_refused_by_name(
    tmp_path: Path, values: NDArray[np.float64], complaint: str
) -> None:
    put(tmp_path / "bad.npy", values)
    (source,) = folder(tmp_path, read)
    with pytest.raises(InputError, match=f"bad.npy: .*{complaint}") as caught:
        source.read()
    assert "\n" not in str(caught.value)


def test_a_folder_without_height_maps_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no height map"):
        folder(tmp_path, read)
    with pytest.raises(InputError, match="no such folder"):
        folder(tmp_path / "nowhere", read)
