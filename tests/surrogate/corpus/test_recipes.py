"""A corpus is drawn texture by texture: each depends on its place alone, its split on its source alone."""

from collections import Counter
from itertools import islice

import numpy as np
import pytest

from relief.ground.errors import InputError
from relief.ground.limits import HEIGHT_LIMIT_MM
from surrogate.corpus.optimised import checksum
from surrogate.corpus.photographs import bundled
from surrogate.corpus.recipes import (
    LOWEST_RELIEF_MM,
    STEP_MM,
    Recipe,
    heights,
    recipe,
    recipes,
)
from surrogate.corpus.splits import SHARES, SPLITS, split_of
from surrogate.families import FAMILIES, FIRST_FAMILIES

SEED = 5
PICTURES = bundled()
SOURCES_OF_SEED_0 = [
    *("dots/5187f5e7ece1412f", "dots/71e2f5f142d60b12"),
    *("crossed/0a58712e7d5f0e95", "ripples/728e777e407de9cf"),
]


def of_source(source: str, draw: int = 3, **changes: object) -> Recipe:
    return Recipe(index=0, source=source, draw=draw, relief_mm=1.0, **changes)  # type: ignore[arg-type]


def test_a_texture_does_not_depend_on_how_many_are_asked_for() -> None:
    few, many = list(recipes(SEED, 5, PICTURES)), list(recipes(SEED, 50, PICTURES))
    assert few == many[:5]
    assert recipe(SEED, 40, PICTURES) == many[40]


def test_a_corpus_is_streamed() -> None:
    assert len(list(islice(recipes(SEED, 10**12, PICTURES), 3))) == 3


def test_another_seed_draws_another_corpus() -> None:
    one, other = ({texture.source for texture in recipes(seed, 50)} for seed in (0, 1))
    assert not one & other


def test_the_order_of_the_pictures_does_not_matter() -> None:
    assert list(recipes(SEED, 50, PICTURES)) == list(recipes(SEED, 50, PICTURES[::-1]))


def test_procedural_textures_do_not_depend_on_the_pictures() -> None:
    with_pictures, without = list(recipes(SEED, 60, PICTURES)), list(recipes(SEED, 60))
    same = [one == other for one, other in zip(with_pictures, without, strict=True)]
    assert same == [texture.family is not None for texture in with_pictures]


def test_the_same_recipe_gives_the_same_bits_in_any_order() -> None:
    textures = list(recipes(SEED, 12, PICTURES))
    forwards = [checksum(heights(texture)) for texture in textures]
    backwards = [checksum(heights(texture)) for texture in reversed(textures)]
    assert forwards == backwards[::-1]
    assert len(set(forwards)) == len(forwards)


def test_heights_are_float32_from_0_to_the_relief() -> None:
    for texture in recipes(SEED, 40, PICTURES):
        found = heights(texture)
        assert found.shape == (128, 128) and found.dtype == np.float32 and found.flags.c_contiguous
        assert found.min() == 0.0
        assert found.max() == pytest.approx(texture.relief_mm, abs=STEP_MM)
        assert LOWEST_RELIEF_MM - STEP_MM <= found.max() <= HEIGHT_LIMIT_MM
        np.testing.assert_array_equal(found / STEP_MM, np.rint(found / STEP_MM))


def test_reliefs_are_spread_evenly_over_their_logarithm() -> None:
    reliefs = [texture.relief_mm for texture in recipes(SEED, 2000)]
    thirds = np.geomspace(LOWEST_RELIEF_MM, HEIGHT_LIMIT_MM, 4)
    np.testing.assert_allclose(np.histogram(reliefs, thirds)[0] / 2000, 1 / 3, atol=0.04)


def test_every_family_and_every_picture_is_drawn() -> None:
    textures = list(recipes(SEED, 3000, PICTURES))
    assert {texture.family for texture in textures} == {*FAMILIES, None}
    assert {picture.name for picture in PICTURES} < {texture.source for texture in textures}


def test_families_are_appended_and_the_first_keep_their_places() -> None:
    assert list(FAMILIES)[:FIRST_FAMILIES] == [
        *("bark", "blocks", "brushed", "bumps", "chequer_plate", "cracked", "crossed", "crumpled", "dots"),
        *("fibres", "gaussian", "grating", "gravel", "hammered", "knit", "leather", "pebbles", "pores"),
        *("ripples", "scales", "scratches", "terraces", "terrain", "tiles", "turing", "weave", "wood"),
    ]
    assert [texture.source for texture in recipes(0, 4)] == SOURCES_OF_SEED_0


def test_a_new_family_takes_its_share_and_leaves_the_other_textures_alone(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    before = list(recipes(SEED, 3000, PICTURES))
    newer = {"felt": FAMILIES["fibres"], "foam": FAMILIES["pores"]}
    monkeypatch.setattr("surrogate.corpus.recipes.FAMILIES", {**FAMILIES, **newer})
    after = list(recipes(SEED, 3000, PICTURES))
    changed = [new for old, new in zip(before, after, strict=True) if old != new]
    assert {texture.family for texture in changed} == set(newer)
    families = Counter(texture.family for texture in after if texture.family)
    for name in (*newer, "bark", "wood"):
        assert families[name] / families.total() == pytest.approx(1 / (len(FAMILIES) + 2), rel=0.35)


def test_splits_are_disjoint_by_source_and_have_their_shares() -> None:
    textures = list(recipes(SEED, 4000, PICTURES))
    sources = {split: {t.source for t in textures if t.split == split} for split in SPLITS}
    assert not sources["train"] & sources["validation"]
    assert not sources["test"] & (sources["train"] | sources["validation"])
    for pictures in (True, False):
        found = Counter(t.split for t in textures if (t.family is None) == pictures)
        for split in SPLITS:
            assert found[split] / found.total() == pytest.approx(SHARES[split], abs=0.03)


def test_no_crop_of_a_training_picture_is_in_the_test_set() -> None:
    crops = [texture for texture in recipes(SEED, 4000, PICTURES) if texture.family is None]
    seen = {split: {texture.source for texture in crops if texture.split == split} for split in SPLITS}
    assert seen["test"] == {f"scikit-image/{name}" for name in ("brick", "grass", "gravel")}
    assert all(seen.values())
    assert not seen["train"] & seen["test"]


def test_a_corpus_without_test_pictures_leaves_their_share_to_the_others() -> None:
    some = [picture for picture in PICTURES if picture.split != "test"]
    crops = [texture for texture in recipes(SEED, 300, some) if texture.family is None]
    assert {texture.split for texture in crops} == {"train", "validation"}


def test_upside_down_swaps_hills_and_hollows() -> None:
    source = "bumps/0000000000000003"
    usual, upset = heights(of_source(source)), heights(of_source(source, upside_down=True))
    np.testing.assert_allclose(usual + upset, 1.0, atol=2 * STEP_MM)


def test_the_eight_symmetries_are_eight_and_keep_the_heights() -> None:
    turned = [heights(of_source("wood/0000000000000003", symmetry=symmetry)) for symmetry in range(8)]
    assert len({checksum(found) for found in turned}) == 8
    for found in turned:
        np.testing.assert_array_equal(np.sort(found, axis=None), np.sort(turned[0], axis=None))


def test_noise_is_as_strong_as_the_recipe_says() -> None:
    source = "scales/0000000000000003"
    plain, noisy = heights(of_source(source)), heights(of_source(source, white_noise=0.02))
    scale = np.polyfit(plain.ravel(), noisy.ravel(), 1)[0]
    residual = noisy / scale - plain
    assert residual.std() == pytest.approx(0.02, rel=0.05)


def test_an_unknown_picture_is_named() -> None:
    with pytest.raises(InputError, match="scikit-image/nowhere: source"):
        heights(of_source("scikit-image/nowhere"))


def test_a_split_depends_on_nothing_but_the_name() -> None:
    assert split_of("wood/0000000000000001") == split_of("wood/" + "0" * 15 + "1")
    shares = Counter(split_of(f"file/{number}") for number in range(5000))
    for split in SPLITS:
        assert shares[split] / 5000 == pytest.approx(SHARES[split], abs=0.015)
