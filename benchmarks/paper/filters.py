"""Figure 18 and section 5.2.1: what filters of the relief do to feel and look, beside an optimised relief."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib import pyplot
from scipy import fft, ndimage, optimize

import tactile
from benchmarks.bundled.textures import TEXTURES
from benchmarks.paper.textures import change_percent, heights, optimised, result, scene
from benchmarks.shared.chart_style import show, write
from optimize.descent.problem import within_limits
from relief.ground.arrays import Array
from relief.ground.limits import PATCH_SIDE_MM
from relief.heightmap import load_heights
from relief.relief import Relief
from tactile.measures import measure_touch
from tactile.quantities import CONTACT_AREA, ROUGHNESS

JND = 4
"""Change of feel in the paper's figure, just-noticeable differences."""
WAVELENGTH_MM, WIDTH_OCTAVES = 2.5, 0.25
"""Middle of the band, and standard deviation of its gain over the logarithm of the wavelength."""
LARGEST_GAIN = 60.0
"""Largest factor on the band."""
SHOWN = ("gravel", "pebbles", "weave")
"""Textures of the picture."""


def figure() -> dict[str, Any]:
    """Roughness raised by 4 JND by a band of frequencies and by Retouch; the three claims."""
    bands, reliefs = {}, {}
    for name in TEXTURES:
        bands[name], reliefs[name] = _band(name)
    _draw({name: reliefs[name] for name in SHOWN})
    reached = [
        row for row in bands.values() if row["band_jnd"] > JND - 0.1 and row["optimised_jnd"] > JND - 0.1
    ]
    return {
        "textures": bands,
        "reached_by_both": len(reached),
        "band_change_percent": float(np.median([row["band_change_percent"] for row in reached])),
        "optimised_change_percent": float(np.median([row["optimised_change_percent"] for row in reached])),
        "claims": claims(),
    }


def band_of(relief: Array) -> Array:
    """The part (rows, cols) of a relief with wavelengths about 2.5 mm, mirrored where the plate ends."""
    waves = fft.dctn(relief, norm="ortho")
    # A cosine transform has half periods over the plate.
    orders = [np.arange(n) / (2.0 * PATCH_SIDE_MM) for n in relief.shape]
    frequency = np.hypot(*np.meshgrid(*orders, indexing="ij"))
    frequency[0, 0] = 1e-9
    gain = np.exp(-0.5 * (np.log2(frequency * WAVELENGTH_MM) / WIDTH_OCTAVES) ** 2)
    return np.asarray(fft.idctn(gain * waves, norm="ortho"))


def _touch(relief: Array) -> dict[str, float]:
    return measure_touch(Relief(relief, PATCH_SIDE_MM), tactile.Skin(), "layer").means


def _roughness(relief: Array) -> float:
    return _touch(relief)[ROUGHNESS.name]


def _band(name: str) -> tuple[dict[str, float], list[Array]]:
    """One texture with its band amplified until it is 4 JND rougher, and optimised; the three reliefs."""
    relief = heights(name)
    own, band = _roughness(relief), band_of(relief)
    goal = tactile.jnd_scaled(own, JND)

    def amplified(gain: float) -> Array:
        return within_limits(relief + (gain - 1.0) * band)

    def excess(gain: float) -> float:
        return math.log(_roughness(amplified(gain)) / goal)

    # The first gain, of a ladder, that is rough enough; the roughest where none is.
    ladder = np.geomspace(1.0, LARGEST_GAIN, 13)
    values = [excess(gain) for gain in ladder]
    enough = next((place for place, value in enumerate(values) if value >= 0.0), None)
    if enough is None:
        gain = float(ladder[int(np.argmax(values))])
    else:
        gain = float(optimize.brentq(excess, ladder[enough - 1], ladder[enough], xtol=1e-3))
    folder = optimised(name, [f"touch.jnd={JND}"], f"{JND}-jnd")
    ours, summary = load_heights(folder / "heights.exr"), result(folder)
    return {
        "roughness": own,
        "gain": gain,
        "band_jnd": tactile.jnd_apart(_roughness(amplified(gain)), own),
        "band_change_percent": change_percent(name, amplified(gain)),
        "band_rms_mm": float((amplified(gain) - relief).std()),
        "optimised_jnd": summary["touch"]["jnd_from_original"],
        "optimised_change_percent": summary["look"]["change_percent"],
        "optimised_rms_mm": float((ours - relief).std()),
    }, [relief, amplified(gain), ours]


def _blurred(relief: Array, blur_mm: float) -> Array:
    pixels = blur_mm * len(relief) / PATCH_SIDE_MM
    return np.asarray(ndimage.gaussian_filter(relief, pixels, mode="reflect"))


def claims() -> dict[str, Any]:
    """The paper's three claims about filters: roughness and contact area before and after."""
    sharp = _lattice(lambda r: np.clip(1.0 - r / 0.8, 0.0, 1.0), 2.5)
    round_ = _lattice(lambda r: np.sqrt(np.clip(1.0 - (r / 1.6) ** 2, 0.0, 1.0)), PATCH_SIDE_MM / 3.0)
    # Posts 1 mm across, 1.5 mm high; between them a floor of waves 2.5 mm long, whose crests no skin reaches.
    post = _lattice(lambda r: (r < 0.5).astype(float), 2.5)
    x = (np.arange(len(post)) + 0.5) * PATCH_SIDE_MM / len(post)
    floor = (post == 0.0) * (1.0 - np.cos(2.0 * np.pi * x / WAVELENGTH_MM))
    return {
        "smoothed sharp peak": _before_after(sharp, _blurred(sharp, 0.2)),
        "smoothed round peak": _before_after(round_, _blurred(round_, 0.2)),
        "amplified waves untouched": _before_after(1.5 * post + 0.02 * floor, 1.5 * post + 0.1 * floor),
    }


def _lattice(profile: Callable[[Array], Array], spacing_mm: float) -> Array:
    """Peaks 1 mm high on a square lattice, by their profile over the distance from the axis, mm."""
    n = 128
    away = np.mod((np.arange(n) + 0.5) * PATCH_SIDE_MM / n, spacing_mm) - 0.5 * spacing_mm
    return np.asarray(profile(np.hypot(*np.meshgrid(away, away))))


def _before_after(before: Array, after: Array) -> dict[str, list[float]]:
    one, other = _touch(before), _touch(after)
    return {name: [one[name], other[name]] for name in (ROUGHNESS.name, CONTACT_AREA.name)}


def _draw(reliefs: dict[str, list[Array]]) -> None:
    heads = ("original", f"2.5 mm waves amplified: +{JND} JND", f"optimised: +{JND} JND")
    figure_, axes = pyplot.subplots(len(reliefs), 3, figsize=(6.6, 2.25 * len(reliefs)))
    for row, (name, each) in zip(axes, reliefs.items(), strict=True):
        pictures = [scene(name).render(relief, samples=64, seed=1).numpy()[0] for relief in each]
        exposure = float(np.percentile(pictures[0], 99.5))
        for axis, picture in zip(row, pictures, strict=True):
            show(axis, picture, exposure)
        row[0].set_ylabel(name)
    for axis, head in zip(axes[0], heads, strict=True):
        axis.set_title(head, fontsize=9)
    figure_.tight_layout()
    write(figure_, "paper-filters.png", dpi=110)
