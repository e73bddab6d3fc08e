"""Reliefs that benchmarks press on: natural ones from photographs, and random ones of many kinds.

Every relief is 128 x 128 samples over 10 x 10 mm, float64, mm, lowest at 0, and the same in every run.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import skimage.data
from scipy.ndimage import gaussian_filter, rotate
from scipy.spatial import cKDTree

from benchmarks.bundled.textures import shrunk, stretched
from relief.ground.arrays import Array

SIDE, SIZE_MM = 128, 10.0
PHOTOGRAPHS = ("gravel", "brick", "grass", "coins", "moon", "page")
CORNERS = ((0, 0), (0, 128), (24, 64))
"""Upper left corners of the crops of 256 x 256 pixels; a smaller photograph (191 x 384) is enlarged first."""


def twelve() -> dict[str, Array]:
    """Twelve textures as a designer might bring them: nine from photographs, three synthetic."""
    natural = {
        f"{name} {number}": crop(name, number, relief_mm)
        for name, relief_mm in (("gravel", 1.2), ("brick", 1.0), ("grass", 1.0))
        for number in range(3)
    }
    random = np.random.default_rng(12)
    synthetic = {
        "weave": scaled(weave(random, 1.6), 0.8),
        "cobbles": scaled(cells(random, 30), 1.0),
        "noise": scaled(noise(random, 0.35), 1.2),
    }
    return natural | synthetic


def many(count: int, seed: int = 0) -> dict[str, Array]:
    """`count` reliefs of every kind, 0.1 to 3 mm high."""
    random = np.random.default_rng(seed)
    kinds: dict[str, Callable[[], Array]] = {
        "photograph": lambda: turned_crop(random),
        "noise": lambda: noise(random, float(random.uniform(0.1, 1.5))),
        "fractal": lambda: fractal(random, float(random.uniform(1.5, 3.5))),
        "grating": lambda: grating(random, float(random.uniform(0.8, 4.0))),
        "weave": lambda: weave(random, float(random.uniform(1.0, 3.0))),
        "cells": lambda: cells(random, int(random.integers(8, 80))),
        "terraces": lambda: np.round(3.0 * scaled(noise(random, 0.8), 1.0)) / 3.0,
        "bumps": lambda: bumps(random, int(random.integers(5, 60))),
    }
    names = list(kinds)
    return {
        f"{names[i % len(names)]} {i // len(names)}": scaled(
            kinds[names[i % len(names)]](), float(np.exp(random.uniform(np.log(0.1), np.log(3.0))))
        )
        for i in range(count)
    }


def scaled(field: Array, relief_mm: float) -> Array:
    """The field shifted and scaled to [0, relief_mm]."""
    return relief_mm * (field - field.min()) / np.ptp(field)


def crop(name: str, number: int, relief_mm: float) -> Array:
    """A crop of a photograph as relief; bricks are dark and high."""
    top, left = CORNERS[number]
    grey = np.asarray(getattr(skimage.data, name)())[top : top + 2 * SIDE, left : left + 2 * SIDE]
    relief = stretched(shrunk(grey))
    return relief_mm * (1.0 - relief if name == "brick" else relief)


def turned_crop(random: np.random.Generator) -> Array:
    """A crop of a photograph, turned by a random angle."""
    grey = np.asarray(getattr(skimage.data, PHOTOGRAPHS[random.integers(len(PHOTOGRAPHS))])(), dtype=float)
    turned = rotate(grey, float(random.uniform(0.0, 360.0)), reshape=False, order=1, mode="reflect")
    wide = 2 * SIDE if min(turned.shape) > 2 * SIDE else min(turned.shape) // 2 * 2
    top, left = (int(random.integers(0, extent - wide + 1)) for extent in turned.shape)
    return _resized(stretched(shrunk(turned[top : top + wide, left : left + wide])))


def noise(random: np.random.Generator, length_mm: float) -> Array:
    """Gaussian noise with a Gaussian correlation."""
    sigma = length_mm * SIDE / SIZE_MM
    return np.asarray(gaussian_filter(random.standard_normal((SIDE, SIDE)), max(sigma, 0.6), mode="wrap"))


def fractal(random: np.random.Generator, slope: float) -> Array:
    """Gaussian noise whose amplitude falls with wavenumber to a power, cut off at four pixels."""
    k = np.hypot(*np.meshgrid(np.fft.fftfreq(SIDE), np.fft.rfftfreq(SIDE), indexing="ij"))
    amplitude = np.where((k > 0.0) & (k < 0.25), np.maximum(k, 1e-9) ** (-0.5 * slope - 0.5), 0.0)
    spectrum = np.fft.rfft2(random.standard_normal((SIDE, SIDE)))
    return np.fft.irfft2(spectrum * amplitude, s=(SIDE, SIDE))


def grating(random: np.random.Generator, period_mm: float) -> Array:
    """Cosine ridges at a random angle and phase."""
    x, y = _centres()
    angle, phase = random.uniform(0.0, 2.0 * np.pi, 2)
    return np.cos(2.0 * np.pi / period_mm * (np.cos(angle) * x + np.sin(angle) * y) + phase)


def weave(random: np.random.Generator, period_mm: float) -> Array:
    """Two families of threads, over and under in turn."""
    x, y = _centres()
    angle = random.uniform(0.0, np.pi / 2.0)
    k = np.pi / period_mm
    u, v = (np.cos(angle) * x + np.sin(angle) * y) * k, (np.cos(angle) * y - np.sin(angle) * x) * k
    over = 0.5 * np.sin(u) * np.sin(v)
    return np.maximum(np.abs(np.cos(u)) + over, np.abs(np.cos(v)) - over)


def cells(random: np.random.Generator, count: int) -> Array:
    """Cobbles: rounded tops, grooves along the borders of Voronoi cells."""
    tree = cKDTree(random.uniform(0.0, SIZE_MM, (count, 2)))
    x, y = _centres()
    distances, _ = tree.query(np.stack((x.ravel(), y.ravel()), axis=1), k=2)
    border = (distances[:, 1] - distances[:, 0]).reshape(SIDE, SIDE)
    return np.asarray(gaussian_filter(np.minimum(border, 0.6), 1.0, mode="nearest"))


def bumps(random: np.random.Generator, count: int) -> Array:
    """Gaussian bumps at random places."""
    x, y = _centres()
    field = np.zeros((SIDE, SIDE))
    for _ in range(count):
        at, sigma = random.uniform(0.0, SIZE_MM, 2), random.uniform(0.2, 0.7)
        field += np.exp(-0.5 * ((x - at[0]) ** 2 + (y - at[1]) ** 2) / sigma**2)
    return field


def _centres() -> tuple[Array, Array]:
    line = (np.arange(SIDE) + 0.5) * SIZE_MM / SIDE
    x, y = np.meshgrid(line, line)
    return x, y


def _resized(field: Array) -> Array:
    from skimage.transform import resize

    return np.asarray(resize(field, (SIDE, SIDE), order=3, mode="reflect", anti_aliasing=False))
