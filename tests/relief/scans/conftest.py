"""A texture, and scans of its prints."""

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from relief.relief import Relief
from relief.scans.pose import Pose
from relief.scans.scans import Scan
from tests.relief.scans.simulated import Scanner, scanned

POSE = Pose(
    turn=0.4,
    log_scale=float(np.log(0.985)),
    shift_x_mm=0.21,
    shift_y_mm=-0.13,
    variance_mm2=0.07**2,
    height_scale=0.96,
    level_mm=4.0,
    tilt_x=0.03,
    tilt_y=-0.02,
)
"""How the print lies in the scans of these tests."""


def texture(seed: int, samples: float = 2.0) -> Relief:
    """Random hills of 8 x 8 mm, as wide as so many samples of 0.125 mm."""
    rough = gaussian_filter(np.random.default_rng(seed).standard_normal((64, 64)), samples, mode="wrap")
    return Relief((rough - rough.min()) / np.ptp(rough) * 0.8, 8.0, name="texture")


def scan_of(relief: Relief, pose: Pose = POSE, **scanner: float) -> Scan:
    """A scan of a print, with samples of 0.1 mm."""
    return scanned(relief, pose, Scanner(0.1, **scanner), np.random.default_rng(1))  # type: ignore[arg-type]


@pytest.fixture(scope="session")
def design() -> Relief:
    return texture(0)
