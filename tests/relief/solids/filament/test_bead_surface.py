import numpy as np
import pytest

import tactile
from optimize.verification.solids.mesh_feel import pressed
from relief.solids.filament.bead_surface import SAMPLES, BeadSurface
from relief.solids.filament.beads import Beads, Role
from relief.solids.meshes.mesh_places import frame_along
from tactile.jnd import SMOOTH_BELOW
from tests.relief.solids.filament.sliced import beads_of


def wall(layer_mm: float, jitter_mm: float, phase: float) -> Beads:
    """A side 14 mm wide and high that faces -y, its points moved across it as fuzzy skin is."""
    random = np.random.default_rng(1)
    lines = []
    for number in range(-int(7 / layer_mm), int(7 / layer_mm)):
        x = np.arange(-7.0, 7.0, 0.5) + random.uniform(-0.15, 0.15, 28)
        y = random.uniform(-jitter_mm, jitter_mm, 28)
        lines.append(np.stack([x, y, np.full(28, (number + phase) * layer_mm)], axis=1))
    start, end = (np.concatenate([line[part] for line in lines]) for part in (slice(-1), slice(1, None)))
    return beads_of(start, end, height=layer_mm)


def roughness(beads: Beads, samples: int) -> float:
    frame = frame_along(np.zeros(3), np.array([0.0, -1.0, 0.0]))
    heights = BeadSurface(beads, samples).crop(frame).heights
    return float(pressed(heights[None], tactile.Skin(), "layer")[0]["roughness"][0])


@pytest.mark.slow
@pytest.mark.parametrize(("layer_mm", "jitter_mm"), [(0.08, 0.0), (0.08, 0.05), (0.2, 0.0), (0.2, 0.15)])
def test_roughness_depends_neither_on_samples_nor_on_the_phase_of_layers(
    layer_mm: float, jitter_mm: float
) -> None:
    dense = roughness(wall(layer_mm, jitter_mm, 0.0), 2 * SAMPLES)
    for phase in (0.0, 0.4):
        found = roughness(wall(layer_mm, jitter_mm, phase), SAMPLES)
        assert found == pytest.approx(dense, abs=0.0005 if dense < SMOOTH_BELOW else 0.02 * dense)


def test_only_beads_of_the_part_are_met() -> None:
    low = beads_of(
        [[-9.0, y, 0.2] for y in np.arange(-8, 8, 0.3)], [[9.0, y, 0.2] for y in np.arange(-8, 8, 0.3)]
    )
    high = beads_of([[-9.0, 0.0, 1.0]], [[9.0, 0.0, 1.0]], role=Role.SUPPORT)
    both = Beads(**{name: np.concatenate([getattr(low, name), getattr(high, name)]) for name in vars(low)})
    crop = BeadSurface(both).crop(frame_along(np.array([0.0, 0.0, 0.2]), np.array([0.0, 0.0, 1.0])))
    assert crop.heights.shape == (SAMPLES, SAMPLES)
    assert not crop.on_edge
    assert crop.level_mm == pytest.approx(-3.0)
    assert crop.heights.min() > 2.8


def test_a_place_beyond_the_part_is_on_an_edge() -> None:
    surface = BeadSurface(beads_of([[-9.0, 0.0, 0.2]], [[9.0, 0.0, 0.2]]))
    for y in (0.0, 20.0):
        assert surface.crop(frame_along(np.array([0.0, y, 0.2]), np.array([0.0, 0.0, 1.0]))).on_edge


def test_a_round_finger_gets_a_wider_patch() -> None:
    crop = BeadSurface(wall(0.2, 0.0, 0.0), side_mm=12.0).crop(
        frame_along(np.zeros(3), np.array([0.0, -1.0, 0.0]))
    )
    assert crop.side_mm == 12.0
    assert crop.heights.shape[0] >= 12.0 * SAMPLES / 10.0
