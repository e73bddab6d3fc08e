"""A round finger: its contact, the receptors that count, nothing beyond a rim, gradients, refusals."""

import dataclasses
import math
from typing import Any

import numpy as np
import pytest
import torch

import tactile
from relief.ground.errors import InputError
from relief.patches import Patches
from relief.places import places
from relief.relief import Relief
from relief.surface import Surface
from tactile import model
from tactile.measures import measure_touch
from tactile.skin import Skin

ROUND = Skin(0.03, force_n=1.0, thickness_mm=4.0, layers=((0.5, 0.3),), shape="round", radius_mm=8.0)
N = 64


def waves(n: int = N, size_mm: float = 10.0, high_mm: float = 0.2) -> np.ndarray:
    x = (np.arange(n) + 0.5) * size_mm / n
    return high_mm * (1.0 + np.sin(2.0 * np.pi * x / 2.5)[:, None] * np.cos(2.0 * np.pi * x / 2.0))


@pytest.mark.parametrize("across", [None, 28.0])
def test_a_small_contact_is_that_of_hertz(across: float | None) -> None:
    # The contact's radius is a ninth of the thickness, and an eighth of the patch's side.
    skin = Skin(
        1.0,
        0.3,
        force_n=0.78,
        thickness_mm=20.0,
        depth_mm=0.5,
        shape="round",
        radius_mm=20.0,
        across_mm=across,
    )
    touch = tactile.press(torch.zeros(256, 256, dtype=torch.float64), 16.0, skin)
    modulus, radius = 1.0 / (1.0 - 0.3**2), math.sqrt(20.0 * (across or 20.0))
    # Of an ellipse of such radii the area is that of the circle of their mean radius within 1 %.
    contact = (0.75 * skin.force_n * radius / modulus) ** (1.0 / 3.0)
    area = float(touch.contact_fraction) * touch.size_mm**2
    assert area == pytest.approx(math.pi * contact**2, rel=0.03)
    peak = 1.5 * skin.force_n / (math.pi * contact**2)
    assert float(touch.pressure.max()) == pytest.approx(peak, rel=0.03)
    rows, columns = (int((touch.pressure > 0.0).any(axis).sum()) for axis in (1, 0))
    assert (rows < columns) if across else (rows == columns)


def test_a_finger_on_a_ball_is_a_rounder_one_on_a_plate() -> None:
    heights = torch.as_tensor(waves())
    # 1/8 + 1/24 = 1/6.
    on_ball = tactile.press(heights, 16.0, dataclasses.replace(ROUND, curved_x_mm=24.0, curved_y_mm=24.0))
    rounder = tactile.press(heights, 16.0, dataclasses.replace(ROUND, radius_mm=6.0))
    torch.testing.assert_close(on_ball.strain, rounder.strain, rtol=1e-6, atol=1e-9)
    torch.testing.assert_close(on_ball.contact_fraction, rounder.contact_fraction)


def test_a_smooth_object_is_touched_by_its_shape_and_is_not_rough() -> None:
    plate, smooth = Skin(force_n=2.0), torch.zeros(N, N, dtype=torch.float64)
    for finger in (plate, ROUND):
        side = finger.patch_mm or 10.0
        along_x = tactile.press(smooth, side, dataclasses.replace(finger, curved_x_mm=12.0))
        rows, columns = (int((along_x.pressure > 0.0).any(axis).sum()) for axis in (1, 0))
        assert columns < rows
        assert float(along_x.strain.abs().max()) < 1e-5
        hollow = tactile.press(smooth, side, dataclasses.replace(finger, curved_x_mm=-40.0))
        bulging = tactile.press(smooth, side, dataclasses.replace(finger, curved_x_mm=40.0))
        assert float(hollow.contact_fraction) > float(bulging.contact_fraction)


def test_roughness_is_the_mean_over_pairs_whose_ends_both_count() -> None:
    generator = torch.Generator().manual_seed(0)
    strain = torch.rand(2, 24, 24, generator=generator, dtype=torch.float64)
    counted = (torch.rand(2, 24, 24, generator=generator) > 0.4).double()
    counted[:, :3] = 0.0
    size, expected = 10.0, []
    for s, m in zip(strain.numpy(), counted.numpy(), strict=True):
        rows, cols = np.nonzero(m)
        at, value = np.stack([rows, cols], 1), s[rows, cols]
        length = np.linalg.norm(at[:, None] - at, axis=2) * size / 24
        near = np.triu((length >= 1.4) & (length <= 3.0), 1)
        weight = np.where(near, 1.0 / np.maximum(length, 1e-9), 0.0)
        expected.append((weight * np.abs(value[:, None] - value)).sum() / weight.sum())
    found = tactile.roughness(strain, size, receptors=counted)
    np.testing.assert_allclose(found.numpy(), expected, rtol=1e-12)
    one = tactile.roughness(strain[0], size, receptors=counted[0])
    assert float(one) == pytest.approx(expected[0], rel=1e-12)
    everywhere = tactile.roughness(strain, size, receptors=torch.ones(24, 24))
    np.testing.assert_allclose(everywhere, tactile.roughness(strain, size), rtol=1e-12)


@pytest.mark.usefixtures("tight_contact")
def test_gradients_go_through_shape_layers_and_the_pairs_that_count() -> None:
    rng = np.random.default_rng(1)
    # Uneven, so that no two strains are the same: V has a kink there.
    heights = torch.as_tensor(waves(48) + 0.02 * rng.random((48, 48)))
    direction = torch.as_tensor(rng.normal(size=(48, 48)) * 1e-3)
    inside = heights.clone().requires_grad_()
    value = tactile.roughness(tactile.press(inside, 10.0, ROUND))
    value.backward()
    assert inside.grad is not None
    slope, first = float((inside.grad * direction).sum()), float(value.detach())

    def remainder(step: float) -> float:
        moved = tactile.roughness(tactile.press(heights + step * direction, 10.0, ROUND))
        return abs(float(moved) - first - step * slope)

    # Smooth but where a contact or the sign of a pair changes: of second order nearly.
    coarse, fine = remainder(0.1), remainder(0.01)
    assert fine < 0.03 * coarse
    assert fine < 0.01 * abs(0.01 * slope)


def test_patches_of_a_round_finger_reach_beyond_the_rim_and_have_their_adjoint() -> None:
    rng = np.random.default_rng(0)
    for surface in (Surface((64, 64), 10.0), Surface((40, 48), 12.0, (False, True)), Surface((70, 50), 8.0)):
        patches = Patches(surface, places(surface), 60, 16.0)
        heights = rng.normal(size=surface.shape)
        cut = patches.of(heights)
        assert patches.size_mm >= 16.0 and cut.shape[1] == cut.shape[2] <= 60
        there = np.isfinite(cut)
        assert not there.all() and there.any((1, 2)).all()
        fields = np.where(there, rng.normal(size=cut.shape), 7.0)
        each = np.where(there, cut, 0.0)
        expected = (each * fields).sum((1, 2))
        np.testing.assert_allclose(patches.rows(fields) @ heights.ravel(), expected, rtol=1e-10, atol=1e-10)
        assert np.vdot(patches.back(fields), heights) == pytest.approx(expected.sum(), rel=1e-10)
    tile = Surface((64, 64), 10.0, (True, True))
    assert np.isfinite(Patches(tile, places(tile), None, 16.0).of(np.ones((64, 64)))).all()


def test_a_rim_out_of_reach_changes_nothing_and_pairs_beyond_it_do_not_count() -> None:
    heights = np.full((96, 96), 0.1)
    heights[16:80, 16:80] += waves()
    wide = measure_touch(Relief(heights, 15.0), ROUND, "layer", at=np.array([[16, 16]]))
    # A finger of 1 N touches 8.6 mm: that a plate of 15 mm ends makes no difference.
    endless = measure_touch(Relief(heights, 15.0, (True, True)), ROUND, "layer", at=np.array([[16, 16]]))
    # Contacts stop at a residual, so that machines differ by about 1e-6.
    assert wide.means["roughness"] == pytest.approx(endless.means["roughness"], rel=1e-5)
    narrow = torch.full((96, 96), -math.inf, dtype=torch.float64)
    narrow[:, 32:64] = torch.as_tensor(heights)[:, 32:64]
    touch = tactile.press(narrow, 16.0, ROUND)
    assert touch.receptors is not None and float(touch.receptors.max()) == 1.0
    assert float((touch.receptors * (touch.gap > 1.0)).sum()) == 0.0
    assert math.isfinite(float(tactile.roughness(touch)))


def test_a_deep_plate_is_felt_to_its_reach_and_its_rim_is_no_depth() -> None:
    heights = 1.5 + waves()
    heights[:4, :4] = 0.0
    heights += np.where(np.arange(N) < N // 2, 2.0, 2.2)[:, None]
    for plate in (Relief(heights, 10.0), Relief(heights, 10.0, (True, True))):
        assert measure_touch(plate, ROUND, "layer").means["roughness"] > 0.0


def test_a_plate_without_room_for_pairs_is_refused() -> None:
    with pytest.raises(InputError, match=r"a patch of 2\.0 mm is smaller than pairs"):
        measure_touch(Relief(waves(32), 2.0), ROUND, "layer")
    far = torch.full((64, 64), -math.inf, dtype=torch.float64)
    far[32, 32] = 0.0
    with pytest.raises(InputError, match="no two receptors that count"):
        tactile.roughness(tactile.press(far, 16.0, ROUND))
    with pytest.raises(InputError, match="no two receptors that count"):
        tactile.roughness(torch.rand(64, 64), 10.0, receptors=torch.zeros(64, 64))


def test_a_plate_alone_is_surrounded_by_nothing() -> None:
    heights = waves()
    plate = measure_touch(Relief(heights, 10.0), ROUND, "layer").means
    touch = tactile.press(heights, 10.0, ROUND)
    assert touch.size_mm >= 16.0
    assert float(tactile.roughness(touch)) == pytest.approx(plate["roughness"], rel=1e-9)


@pytest.mark.slow
def test_the_models_agree_on_a_round_finger() -> None:
    heights = torch.as_tensor(waves(128))
    exact = float(tactile.roughness(tactile.press(heights, 10.0, ROUND)))
    assert float(tactile.roughness(tactile.press(heights.float(), 10.0, ROUND))) == pytest.approx(exact, 1e-4)
    quick = float(tactile.roughness(tactile.press(heights, 10.0, ROUND, "quick")))
    assert quick == pytest.approx(exact, rel=0.02)


@pytest.mark.parametrize(
    ("change", "line"),
    [
        ({"radius_mm": None}, "skin.radius_mm: a round finger needs its radius"),
        ({"shape": "flat"}, 'only a finger of shape = "round" has a radius'),
        ({"shape": "egg"}, '"egg" is not one of flat, round'),
        ({"radius_mm": 1.0}, r"skin.radius_mm: 1 is outside \[3, 100\]"),
        ({"radius_mm": -5.0}, r"skin.radius_mm: -5 is outside \[3, 100\]"),
        ({"across_mm": 1e4}, r"skin.across_mm: 10000 is outside \[3, 100\]"),
        ({"across_mm": math.nan}, "skin.across_mm: nan is not a finite number"),
        ({"force_n": 60.0}, "skin.force_n: 60 N may flatten a finger"),
        ({"curved_x_mm": 1.0}, r"skin.curved_x_mm: 1 is neither in \[3, 10000\] nor minus that"),
        ({"curved_y_mm": math.nan}, "skin.curved_y_mm: nan is not a finite number"),
        ({"curved_x_mm": -7.0}, "skin.curved_x_mm: no room for the finger in a hollow of 7 mm"),
        ({"curved_y_mm": -8.1}, "skin.force_n: 1 N may flatten a finger"),
    ],
)
def test_unfit_shapes_are_refused(change: dict[str, Any], line: str) -> None:
    with pytest.raises(InputError, match=line):
        dataclasses.replace(ROUND, **change)


def test_contacts_without_pairs_of_receptors_and_unfit_models_are_refused() -> None:
    heights = torch.zeros(N, N, dtype=torch.float64)
    with pytest.raises(InputError, match=r"skin\.force_n: with 0\.01 N the finger touches"):
        tactile.press(heights, 10.0, dataclasses.replace(ROUND, force_n=0.01))
    with pytest.raises(InputError, match="the net is trained for a flat finger"):
        tactile.press(heights, 10.0, ROUND, "net")
    with pytest.raises(InputError, match="the net is trained for a flat object"):
        tactile.press(heights, 10.0, Skin(curved_x_mm=20.0), "net")
    with pytest.raises(InputError, match="heights: not every value is finite"):
        tactile.press(heights + math.inf, 10.0, ROUND)


def test_large_strain_is_told_once_of_a_finger(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []
    monkeypatch.setattr(model, "say", told.append)
    strained = Skin(0.05, thickness_mm=4.0, force_n=3.5, shape="round", radius_mm=8.0)
    for samples in (40, 44):
        model.touch_model(strained, samples, 20.0)
    assert len(told) == 1
    assert "a finger of 3.5 N touches" in told[0] and "the theory is of small strains" in told[0]
