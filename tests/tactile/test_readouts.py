"""Read-outs of a press: on a flat plate 0, of thin waves their rms, the same of a shifted relief."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch
from torch import Tensor

import tactile
from tactile.pressing import rise_mm
from tactile.readouts import READ_OUTS, band_squares
from tactile.skin import Skin
from tactile.touch import Touch

FLAT = Skin()
ROUND = Skin(0.03, force_n=1.0, thickness_mm=4.0, layers=((0.5, 0.3),), shape="round", radius_mm=8.0)
OVAL = replace(ROUND, across_mm=12.0)
N = 128


def side_mm(skin: Skin) -> float:
    return skin.patch_mm or 10.0


def along(skin: Skin, n: int = N) -> Tensor:
    """(n,) mm from a side of the patch."""
    return (torch.arange(n, dtype=torch.float64) + 0.5) * side_mm(skin) / n


def hills(skin: Skin, n: int = N) -> Tensor:
    """(n, n) mm, without symmetry, with hollows that the skin spans."""
    x = along(skin, n)
    waves = torch.sin(3.1 * x)[:, None] * torch.cos(2.3 * x + 1.0) + 0.5 * torch.sin(
        4.7 * x[:, None] + 1.9 * x
    )
    return 0.15 * (waves + 1.5)


def read(heights: Tensor, skin: Skin) -> dict[str, float]:
    """Read-outs by name of a relief (n, n) mm over the whole patch."""
    touch = tactile.press(heights, side_mm(skin), skin)
    return {name: float(one.value(touch, heights)) for name, one in READ_OUTS.items()}


def touch_of(strain: Tensor, pressure: Tensor, receptors: Tensor | None = None) -> Touch:
    none = torch.zeros(())
    return Touch(strain, torch.zeros_like(strain), pressure, none, none, 10.0, none, receptors)


@pytest.mark.parametrize("skin", [FLAT, ROUND, OVAL], ids=["flat", "round", "oval"])
def test_a_flat_plate_reads_nothing(skin: Skin) -> None:
    felt = read(torch.full((N, N), 0.7, dtype=torch.float64), skin)
    assert felt == pytest.approx(dict.fromkeys(READ_OUTS, 0.0), abs=1e-3)
    assert abs(felt["strain_deviation"]) < 1e-5


@pytest.mark.parametrize("skin", [FLAT, ROUND], ids=["flat", "round"])
def test_a_relief_may_be_shifted_in_height_and_turned(skin: Skin) -> None:
    heights = hills(skin)
    first = read(heights, skin)
    assert min(map(abs, first.values())) > 1e-4
    assert read(heights + 0.4, skin) == pytest.approx(first, rel=1e-4, abs=1e-7)
    assert read(heights.rot90(), skin) == pytest.approx(first, rel=1e-4, abs=1e-7)


@pytest.mark.parametrize("skin", [FLAT, ROUND], ids=["flat", "round"])
@pytest.mark.parametrize(("wavelength", "band", "other"), [(0.45, "fine", "coarse"), (1.7, "coarse", "fine")])
def test_a_thin_wave_has_its_rms_in_its_band(skin: Skin, wavelength: float, band: str, other: str) -> None:
    high = 0.004
    wave = 0.5 * high * torch.sin(2.0 * math.pi * along(skin) / wavelength).expand(N, N)
    felt = read(wave, skin)
    rms_um = 1e3 * high / math.sqrt(8.0)
    assert felt[f"surface_{band}_um"] == pytest.approx(rms_um, rel=0.01)
    assert felt[f"surface_{other}_um"] < 0.01 * rms_um
    assert felt["contact_spectrum"] < 1e-3
    twice = read(2.0 * wave, skin)
    assert twice["surface_coarse_um"] == pytest.approx(2.0 * felt["surface_coarse_um"], rel=0.02, abs=1e-3)
    assert twice["strain_deviation"] == pytest.approx(2.0 * felt["strain_deviation"], rel=0.05)


@pytest.mark.parametrize("skin", [FLAT, ROUND], ids=["flat", "round"])
def test_relief_and_gap_are_the_surface_that_the_operator_displaces(skin: Skin) -> None:
    heights = hills(skin)
    touch = tactile.press(heights, side_mm(skin), skin)
    operator = tactile.touch_model(skin, N, side_mm(skin)).operator
    surface = operator.displacement(touch.pressure / skin.young_modulus_mpa)
    if skin.curvatures is not None:
        surface = surface + rise_mm(skin.curvatures, heights, side_mm(skin))
    over = touch.gap + heights - surface
    assert float(over.max() - over.min()) < 1e-5


@pytest.mark.parametrize("skin", [FLAT, ROUND], ids=["flat", "round"])
def test_twice_the_samples_read_the_same(skin: Skin) -> None:
    coarse, fine = read(hills(skin), skin), read(hills(skin, 2 * N), skin)
    # Finer samples find more gaps in the contact.
    assert fine.pop("contact_spectrum") == pytest.approx(coarse.pop("contact_spectrum"), rel=0.08)
    assert fine == pytest.approx(coarse, rel=0.01, abs=1e-4)


def test_patches_of_a_batch_read_as_alone_even_beyond_the_rim_of_a_plate() -> None:
    whole, cut = hills(ROUND), hills(ROUND)
    cut[:, :40] = -math.inf
    batch = torch.stack((whole, cut))
    touch = tactile.press(batch, side_mm(ROUND), ROUND)
    for name, one in READ_OUTS.items():
        values = one.value(touch, batch).tolist()
        alone = [read(each, ROUND)[name] for each in (whole, cut)]
        assert values == pytest.approx(alone, rel=1e-3) and all(map(math.isfinite, values))


def test_strain_counts_at_the_receptors_that_count() -> None:
    generator = torch.Generator().manual_seed(0)
    strain = torch.randn(3, 32, 32, dtype=torch.float64, generator=generator)
    receptors = (torch.rand(3, 32, 32, generator=generator) > 0.4).double()
    touch = touch_of(strain, strain, receptors)
    for name, of in (("strain_mean", lambda part: -part.mean()), ("strain_deviation", np.std)):
        counted = [of(each[there > 0.0].numpy()) for each, there in zip(strain, receptors, strict=True)]
        np.testing.assert_allclose(READ_OUTS[name].value(touch, strain), counted, rtol=1e-12)


def test_stripes_of_contact_read_the_rms_of_their_fundamental() -> None:
    at = torch.arange(N)
    for axis, width in ((0, 16), (1, 16), (0, 8)):
        stripes = (at // width % 2).double().expand(N, N)
        touch = touch_of(stripes, stripes.T if axis else stripes)
        felt = float(READ_OUTS["contact_spectrum"].value(touch, stripes))
        # Overtones are shorter than the band.
        assert felt == pytest.approx(math.sqrt(2.0) / math.pi, rel=1e-2)
    narrow = (at // 4 % 2).double().expand(N, N)
    assert float(READ_OUTS["contact_spectrum"].value(touch_of(narrow, narrow), narrow)) < 1e-3


def test_bands_share_the_power_of_noise() -> None:
    noise = torch.randn(64, N, N, dtype=torch.float64, generator=torch.Generator().manual_seed(1))
    parts = band_squares(noise, 10.0, [(0.05, 0.5), (0.5, 20.0)])
    assert parts.shape == (64, 2)
    assert float(parts.sum(-1).mean()) == pytest.approx(1.0, rel=0.01)


def test_names_and_sources_are_stated() -> None:
    assert len(READ_OUTS) <= 6 and all(one.source and one.name == name for name, one in READ_OUTS.items())
