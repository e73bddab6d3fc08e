"""Batches know their noise: on made-up pictures whose truth is known, and on rendered ones."""

import os
import subprocess
import sys
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from tests.visual.scenes import SIDE, Array, hills, sky, sun
from visual.picture_noise import BATCHES, Batches, batched, jackknife_error
from visual.scene import Scene


def made_up(sigma: float, batches: int = BATCHES, seed: int = 0) -> Batches:
    """Pictures of radiance 1 (first condition) and 2, each batch with independent Gaussian noise."""
    noise = np.random.default_rng(seed).normal(0.0, sigma, (batches, 2, 64, 64))
    return Batches(np.array([1.0, 2.0])[:, None, None] + noise, 16 * batches)


# The mean and its error


@pytest.mark.parametrize("batches", [4, 8])
def test_the_standard_error_is_that_of_the_mean(batches: int) -> None:
    pictures = made_up(0.3, batches)
    expected = 0.3 / np.sqrt(batches)
    assert np.sqrt(np.square(pictures.standard_error).mean()) == pytest.approx(expected, rel=0.02)
    assert pictures.mean.std(axis=(1, 2)) == pytest.approx(expected, rel=0.03)
    np.testing.assert_allclose(pictures.relative_error(), [expected, expected / 2.0], rtol=0.03)


def test_a_black_picture_has_no_relative_error() -> None:
    assert (Batches(np.zeros((4, 2, 3, 3)), 4).relative_error() == 0.0).all()


def test_one_condition_is_a_part_of_all() -> None:
    pictures = made_up(0.1)
    np.testing.assert_array_equal(pictures.condition(1).mean[0], pictures.mean[1])
    assert pictures.condition(1).relative_error()[0] == pictures.relative_error()[1]


# Jackknife


def test_the_jackknife_of_a_mean_is_its_standard_error() -> None:
    values = np.random.default_rng(2).normal(size=6)
    expected = values.std(ddof=1) / np.sqrt(6)
    assert jackknife_error(lambda v: float(v.mean()), values) == pytest.approx(expected)


def test_the_jackknife_of_a_ratio_keeps_pairs_together() -> None:
    """Numerator and denominator of one batch err together, so that their ratio does not."""
    below = np.random.default_rng(3).uniform(1.0, 2.0, 8)
    assert jackknife_error(lambda a, b: float(a.mean() / b.mean()), 3.0 * below, below) < 1e-12


# Rendered


@pytest.mark.slow
def test_batches_are_renders_of_their_share_of_the_samples(
    scene_of: Callable[..., Scene], monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[dict[str, Any]] = []
    render = Scene.render

    def counted(scene: Scene, *arguments: Any, **options: Any) -> Any:
        asked.append(options)
        return render(scene, *arguments, **options)

    scene = scene_of(sun(35), sky())
    monkeypatch.setattr(Scene, "render", counted)
    pictures = batched(scene, samples=64, seed=7, resolution=16)
    assert pictures.pictures.shape == (4, 1, 16, 16) and pictures.samples == 64
    assert [options["samples"] for options in asked] == [16] * 4
    assert len({options["seed"] for options in asked}) == 4
    again = batched(scene, samples=64, seed=7, resolution=16)
    np.testing.assert_array_equal(again.pictures, pictures.pictures)
    assert (batched(scene, samples=64, seed=8, resolution=16).pictures != pictures.pictures).any()


def test_no_batch_is_without_a_sample(scene_of: Callable[..., Scene]) -> None:
    assert batched(scene_of(sun(35)), samples=1).samples == BATCHES


@pytest.fixture
def converged(scene_of: Callable[..., Scene]) -> tuple[Scene, Array]:
    """A scene, and its picture with so many samples that its noise does not count."""
    scene = scene_of(sun(35), sky())
    return scene, np.mean([scene.render(samples=4096, seed=s).numpy() for s in range(2)], axis=0)


@pytest.mark.slow
def test_the_standard_error_is_how_far_the_picture_lies_from_the_truth(
    converged: tuple[Scene, Array],
) -> None:
    """Root mean square over the picture: its 1024 pixels have noise of their own, each known to 40 %."""
    scene, truth = converged
    for seed in range(3):
        pictures = batched(scene, samples=64, seed=seed)
        off = np.sqrt(np.square(pictures.mean - truth).mean())
        told = np.sqrt(np.square(pictures.standard_error).mean())
        assert off > 1e-3 * truth.mean()
        assert told == pytest.approx(off, rel=0.15)


def test_a_flat_plate_under_a_parallel_light_has_no_noise(scene_of: Callable[..., Scene]) -> None:
    flat = batched(scene_of(sun(35), heights=np.zeros_like(hills())), samples=16)
    assert flat.pictures.shape[2:] == (SIDE, SIDE)
    assert flat.relative_error().max() < 1e-6


def test_importing_it_loads_no_mitsuba() -> None:
    code = (
        "import sys, visual.picture_noise; sys.exit(bool({'mitsuba', 'drjit', 'torch'} & set(sys.modules)))"
    )
    subprocess.run([sys.executable, "-c", code], check=True, env=dict(os.environ))
