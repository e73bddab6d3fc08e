"""Sky of the scene `evening`, made by code: python -m benchmarks.bundled.sky writes it again, bit for bit."""

from pathlib import Path

import numpy as np
import OpenEXR
from numpy.typing import NDArray

FILE = Path(__file__).resolve().parents[2] / "mitsuba_scenes" / "skies" / "evening.exr"
ROWS, COLS = 32, 64
"""Size, pixels: each is 5.6 degrees wide, fine enough for the glow of a sun behind haze."""
SUN_AZIMUTH, SUN_ELEVATION, SUN_WIDTH = 205.0, 24.0, 9.0
"""Place and standard deviation of the glow, degrees; azimuth from the map's left edge to the right."""
SUN = (34.0, 20.0, 9.0)
"""Radiance in the middle of the glow: red, green, blue."""
ZENITH, HORIZON, GROUND = (0.10, 0.17, 0.34), (0.95, 0.62, 0.42), (0.07, 0.06, 0.05)
"""Radiance of the sky above, of the sky at the horizon below the glow, and of the ground."""
BAND_HEIGHT = 14.0
"""Elevation, degrees, over which the light of the horizon falls by a factor e."""


def evening() -> NDArray[np.float16]:
    """Radiance (ROWS, COLS, 3) by elevation and azimuth; the top row is the zenith, as in Mitsuba's maps."""
    elevation = np.radians(90.0 - 180.0 * (np.arange(ROWS) + 0.5) / ROWS)[:, None]
    azimuth = np.radians(360.0 * (np.arange(COLS) + 0.5) / COLS)[None, :]
    sun_up, sun_round = np.radians((SUN_ELEVATION, SUN_AZIMUTH))
    cosine = np.sin(elevation) * np.sin(sun_up)
    cosine = cosine + np.cos(elevation) * np.cos(sun_up) * np.cos(azimuth - sun_round)
    away = np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0)))[:, :, None]
    # The band of light at the horizon is brightest below the glow.
    band = np.exp(-np.degrees(np.maximum(elevation, 0.0)) / BAND_HEIGHT)[:, :, None]
    band = band * (0.35 + 0.65 * np.exp(-away / 70.0))
    sky = band * np.array(HORIZON) + (1.0 - band) * np.array(ZENITH)
    sky = np.where(elevation[:, :, None] > 0.0, sky, np.array(GROUND))
    return np.asarray(sky + np.exp(-0.5 * (away / SUN_WIDTH) ** 2) * np.array(SUN), dtype=np.float16)


def write(path: Path) -> None:
    """Write the sky as an EXR of half precision."""
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {"RGB": evening()}).write(str(path))


if __name__ == "__main__":
    write(FILE)
