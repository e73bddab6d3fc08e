"""Pictures by Mitsuba as a function of torch tensors: their gradients, and what these must leave alone."""

from collections.abc import Callable

import numpy as np
import pytest
import torch
from scipy.ndimage import gaussian_filter
from torch import Tensor

from tests.recorded import Truths
from tests.visual.differences import ADJOINTS, by_gradients, slopes_of_pictures
from tests.visual.scenes import PLASTIC, SIDE, Array, sky, sun
from visual.scene import Scene


@pytest.fixture
def scene(scene_of: Callable[..., Scene]) -> Scene:
    return scene_of(sun(35), sun(40, 200), sky())


def leaf(heights: Array, dtype: torch.dtype = torch.float64) -> Tensor:
    return torch.tensor(heights, dtype=dtype, requires_grad=True)


def gradient(scene: Scene, weights: Array, seed: int = 0, shadow_edges: bool = True) -> Array:
    """Gradient (rows, cols) of the weighted sum of every condition's pictures."""
    heights = leaf(scene.heights)
    pictures = scene.render(heights, seed=seed, shadow_edges=shadow_edges)
    (pictures * torch.as_tensor(weights)).sum().backward()
    assert heights.grad is not None
    return heights.grad.numpy()


def assert_same(one: Array, other: Array) -> None:
    """Gradients agree but for the order in which threads add up their parts."""
    np.testing.assert_allclose(one, other, rtol=0.0, atol=1e-5 * np.abs(one).max())


def cosine(one: Array, other: Array) -> float:
    return float((one * other).sum() / np.linalg.norm(one) / np.linalg.norm(other))


@pytest.mark.slow
@pytest.mark.parametrize(
    "lights", [(sun(35), sun(40, 200)), (sun(35), sun(40, 200), sky())], ids=["suns", "suns and sky"]
)
def test_the_gradient_is_that_of_the_explicit_jacobian(
    scene_of: Callable[..., Scene], lights: tuple[str, ...]
) -> None:
    scene, seeds = scene_of(*lights, material=PLASTIC), range(3)
    weights = np.stack([ADJOINTS[0], ADJOINTS[1]])
    by_mitsuba = np.mean([gradient(scene, weights, seed) for seed in seeds], axis=0)
    explicit = np.zeros(SIDE * SIDE)
    for seed in seeds:
        jacobians = scene.views(seed=seed)[0].evaluate(scene.heights).jacobians
        explicit += sum(j.T @ w.ravel() for j, w in zip(jacobians, weights, strict=True))
    smooth = (gaussian_filter(g.reshape(SIDE, SIDE), 2.0) for g in (by_mitsuba, explicit))
    assert cosine(*smooth) > 0.97


def test_without_edges_the_gradient_is_that_of_the_jacobian_without(scene_of: Callable[..., Scene]) -> None:
    scene = scene_of(sun(25))
    by_mitsuba, with_edges = (gradient(scene, ADJOINTS[0][None], shadow_edges=e) for e in (False, True))
    jacobian = scene.views()[0].evaluate(scene.heights, edges=False).jacobians[0]
    explicit = (jacobian.T @ ADJOINTS[0].ravel()).reshape(SIDE, SIDE)
    assert cosine(by_mitsuba, explicit) > 0.99
    assert cosine(by_mitsuba, with_edges) < 0.9


# One gradient scatters by 5 % under a sun at 35 degrees and by 40 % under ambient light, whose shadow edges
# it follows in eight directions; what must be small is the error of the mean.
@pytest.mark.slow
@pytest.mark.parametrize(
    ("light", "seeds", "step_mm", "draws", "allowed", "noise"),
    [(sun(35), 3, 0.02, 12, 0.03, 0.01), (sky(), 2, 0.06, 64, 0.1, 0.03)],
    ids=["sun", "sky"],
)
def test_the_gradient_is_that_of_the_pictures(
    scene_of: Callable[..., Scene],
    truths: Truths,
    light: str,
    seeds: int,
    step_mm: float,
    draws: int,
    allowed: float,
    noise: float,
) -> None:
    scene = scene_of(light)
    truth = slopes_of_pictures(truths, scene, step_mm, seeds, samples=1024)
    assert truth.relative_error < noise
    slopes = by_gradients(lambda weights, seed: gradient(scene, weights[None], seed), draws)
    assert truth.error(slopes.mean) < allowed


@pytest.mark.slow
def test_the_same_seed_gives_the_same_pictures_and_gradients(scene: Scene) -> None:
    first, again, other = (scene.render(seed=seed) for seed in (7, 7, 8))
    assert torch.equal(first, again)
    assert not torch.equal(first, other)
    assert_same(*(gradient(scene, ADJOINTS[0], seed=7) for _ in range(2)))


@pytest.mark.slow
def test_any_seed_will_do(scene: Scene) -> None:
    seed = 2**31
    assert torch.isfinite(scene.render(seed=seed)).all()
    assert np.isfinite(gradient(scene, ADJOINTS[0], seed=seed)).all()


@pytest.mark.slow
def test_heights_changed_in_place_after_the_picture_leave_its_gradient_alone(scene: Scene) -> None:
    expected = gradient(scene, ADJOINTS[0])
    heights = leaf(scene.heights)
    loss = (scene.render(heights) * torch.as_tensor(ADJOINTS[0])).sum()
    with torch.no_grad():
        heights.mul_(0.2)
    loss.backward()
    assert heights.grad is not None
    assert_same(heights.grad.numpy(), expected)


@pytest.mark.slow
def test_pictures_of_other_heights_in_between_leave_it_alone_too(scene: Scene) -> None:
    expected = gradient(scene, ADJOINTS[0])
    heights = leaf(scene.heights)
    loss = (scene.render(heights) * torch.as_tensor(ADJOINTS[0])).sum()
    scene.render(scene.heights[::-1].copy())
    loss.backward()
    assert heights.grad is not None
    assert_same(heights.grad.numpy(), expected)


@pytest.mark.slow
def test_a_gradient_leaves_no_trace_in_the_kept_scene(scene: Scene) -> None:
    before = scene.render()
    gradient(scene, ADJOINTS[0])
    assert torch.equal(scene.render(), before)
    assert not scene.render().requires_grad


@pytest.mark.slow
def test_pictures_and_gradients_have_the_type_of_the_heights(scene: Scene) -> None:
    gradients = []
    for dtype in (torch.float32, torch.float64):
        heights = leaf(scene.heights, dtype)
        pictures = scene.render(heights)
        assert pictures.dtype == dtype
        (pictures * torch.as_tensor(ADJOINTS[0])).sum().backward()
        assert heights.grad is not None
        assert heights.grad.dtype == dtype
        gradients.append(heights.grad.double())
    torch.testing.assert_close(*gradients, rtol=1e-4, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("lights", [(sun(35),), (sun(35), sky()), (sky(),)], ids=["sun", "both", "sky"])
def test_a_flat_plate_has_a_gradient_without_shadow_edges(
    scene_of: Callable[..., Scene], lights: tuple[str, ...]
) -> None:
    scene = scene_of(*lights, heights=np.full((SIDE, SIDE), 0.5))
    gradients = [gradient(scene, ADJOINTS[0], shadow_edges=edges) for edges in (True, False)]
    assert np.isfinite(gradients[0]).all()
    assert_same(*gradients)


@pytest.mark.slow
def test_a_gradient_flows_on_through_what_made_the_heights(scene: Scene) -> None:
    factor = torch.tensor(1.0, dtype=torch.float64, requires_grad=True)
    pictures = scene.render(factor * torch.as_tensor(scene.heights))
    (pictures * torch.as_tensor(ADJOINTS[0])).sum().backward()
    assert factor.grad is not None
    assert float(factor.grad) == pytest.approx(float((gradient(scene, ADJOINTS[0]) * scene.heights).sum()))
