"""Far from its sides, a wide and thin block of finite elements is an elastic layer.

The bare elements are, in the limit of fine meshes; the operator takes off what they miss and is at once.
"""

from collections.abc import Callable

import pytest
import torch

from benchmarks.touch.bare_elements import bare_elements
from tactile.elements.finite_elements import finite_element_operator
from tactile.layer.cosine_layer import CosineLayer
from tactile.layer.elastic_layer import elastic_layer_operator
from tactile.skin import Skin
from tests.tactile.reliefs import SIZE, centres

THIN = Skin(poisson_ratio=0.3, thickness_mm=1.0, depth_mm=0.3)


def differences(samples: int, elements: Callable[[Skin, int, float], CosineLayer]) -> torch.Tensor:
    """(7,) largest differences of displacement and strains in the middle, over the layer's largest value."""
    x = centres(samples) - 0.5 * SIZE
    row, column = (torch.exp(-0.5 * ((x - middle) / 1.2) ** 2) for middle in (0.6, -0.4))
    pressure = torch.outer(row, column)
    middle = slice(samples // 4, 3 * samples // 4)
    fields = []
    for operator in (
        elements(THIN, samples, SIZE),
        elastic_layer_operator(THIN, samples, SIZE, free_sides=False),
    ):
        displacement, strain = operator.displacement(pressure), operator.strain(pressure)
        fields.append((displacement[None, middle, middle], strain[:, middle, middle]))
    errors = []
    for block, layer in zip(*fields, strict=True):
        errors.append((block - layer).abs().amax((-2, -1)) / layer.abs().max())
    return torch.cat(errors)


@pytest.fixture(scope="module")
def bare() -> dict[int, torch.Tensor]:
    return {samples: differences(samples, bare_elements) for samples in (16, 32)}


def test_a_local_pressure_moves_bare_elements_about_as_the_layer_says(bare: dict[int, torch.Tensor]) -> None:
    assert float(bare[32].max()) < 0.025


def test_what_bare_elements_miss_falls_quadratically_with_the_pitch(bare: dict[int, torch.Tensor]) -> None:
    assert float(torch.log2(bare[16].max() / bare[32].max())) > 1.7


@pytest.mark.parametrize("samples", [16, 32])
def test_the_operator_moves_as_the_layer_says_on_any_mesh(samples: int) -> None:
    """Sides eight thicknesses apart are still felt a little: by 0.17 %."""
    assert float(differences(samples, finite_element_operator).max()) < 0.0025
