"""Pictures on disk: exact for numbers, sRGB for eyes, and always inside their folder."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from optimize.run_directory.pictures import file_names, write_pictures
from relief.ground.srgb import srgb

HOSTILE = [
    *("../../escape", "/etc/passwd", "..", ".", "", "a/b", "a\\b", ".hidden", "-rf", "two\nlines", "nul\0"),
    *("light 10", "Süd", "<script>", "$HOME", "n" * 400, "ü" * 400),
]


def pictures(count: int) -> np.ndarray:
    return np.random.default_rng(0).uniform(0.0, 1.2, (count, 8, 12))


def exr(path: Path) -> np.ndarray:
    with OpenEXR.File(str(path), separate_channels=True) as file:
        return np.array(file.parts[0].channels["Y"].pixels)


def test_hostile_names_stay_inside_the_folder(tmp_path: Path) -> None:
    folder = tmp_path / "run" / "renders"
    written = write_pictures(folder, HOSTILE, pictures(len(HOSTILE)), 1.0, "after")
    files = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert {path.parent for path in files} == {folder}
    assert sorted(files) == sorted(
        path.with_name(path.name + suffix) for path in written for suffix in (".exr", ".png")
    )


@pytest.mark.parametrize(
    "conditions",
    [HOSTILE, ["sun", "sun", "sun"], ["sun", "sun-3", "sun"], ["a b", "a-b-3", "a/b"], ["Sun", "sun"]],
)
def test_every_condition_has_a_name_of_its_own(conditions: Sequence[str]) -> None:
    """On file systems that do not tell capitals apart, too."""
    names = file_names(conditions)
    assert len({name.casefold() for name in names}) == len(conditions)
    assert not any(name.startswith((".", "-")) for name in names)


def test_harmless_names_stay() -> None:
    assert file_names(["light-10", "light-130", "ambient"]) == ["light-10", "light-130", "ambient"]


def test_an_exr_reads_back_bit_for_bit(tmp_path: Path) -> None:
    radiance = pictures(2)
    written = write_pictures(tmp_path, ["one", "other"], radiance, 1.0)
    assert [path.name for path in written] == ["one", "other"]
    for path, picture in zip(written, radiance, strict=True):
        samples = exr(path.with_suffix(".exr"))
        assert samples.dtype == np.float32
        np.testing.assert_array_equal(samples, picture.astype(np.float32))


def test_a_png_shows_white_as_white(tmp_path: Path) -> None:
    radiance = pictures(1)
    (path,) = write_pictures(tmp_path, ["one"], radiance, 0.6)
    with Image.open(path.with_suffix(".png")) as image:
        assert (image.mode, image.size) == ("L", (12, 8))
        shown = np.asarray(image)
    np.testing.assert_array_equal(shown, np.rint(255.0 * srgb(radiance[0], 0.6)))
    assert np.all(shown[radiance[0] >= 0.6] == 255)


def test_pictures_of_another_stage_come_beside_the_first(tmp_path: Path) -> None:
    for stage in ("before", "after"):
        write_pictures(tmp_path, ["sun"], pictures(1), 1.0, stage)
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        *("sun-after.exr", "sun-after.png", "sun-before.exr", "sun-before.png")
    ]


def test_a_failure_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="zip"):
        write_pictures(tmp_path / "renders", ["sun", "moon"], pictures(1), 1.0)
    assert not list(tmp_path.iterdir())
