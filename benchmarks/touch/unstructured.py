"""Skins meshed by quadratic tetrahedra: the flat block against the reference, and rounded fingertips."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

import tactile
from benchmarks.touch.pressed_reliefs import SIZE_MM, bumps, grating, noise, scaled, twelve
from benchmarks.touch.relief_pressing import SKIN, compared, measure, resampled, stacked
from tactile.elements.finite_elements import finite_element_operator
from tactile.unstructured.meshing import Sizing, tetrahedralise
from tactile.unstructured.surface import block_surface, fingertip_surface
from tactile.unstructured.tetrahedra import press_tetrahedra, tetrahedral_operator

TETRAHEDRA_SIDE = 40
"""Pixels a side for tetrahedra: as wide as the mesh's facets, as contact creeps on narrower ones."""
FINGERTIP_MM = 5.0
"""Thickness at the apex: a cap of 8 mm radius rises by 4.3 mm to the corners of the block."""
FINGERTIP_RADII_MM = (None, 15.0, 10.0, 8.0)


def tetrahedra() -> list[dict[str, Any]]:
    """Quadratic tetrahedra on an unstructured mesh, contact at 40 x 40, against the reference there.

    Reliefs are smooth, because pressures on tetrahedra are smooth between the pixels, and those of the
    reference have waves as short as the grid's.
    """
    random = np.random.default_rng(0)
    smooth = {
        "grating": scaled(grating(random, 2.0), 0.6),
        "bumps": scaled(bumps(random, 20), 0.8),
        "noise": scaled(noise(random, 0.5), 1.0),
    }
    heights = resampled(stacked(smooth), TETRAHEDRA_SIDE)
    truth = measure(finite_element_operator(SKIN, TETRAHEDRA_SIDE, SIZE_MM, mesh=64), heights)
    began = time.perf_counter()
    mesh = tetrahedralise(block_surface(SIZE_MM, SKIN.thickness_mm), Sizing(0.25, 0.8))
    meshed = time.perf_counter()
    operator = tetrahedral_operator(SKIN, mesh, TETRAHEDRA_SIDE, SIZE_MM)
    built = time.perf_counter()
    measured = measure(operator, heights, repeats=1)
    return [
        {"unknowns": operator.unknowns, "mesh s": meshed - began, "build s": built - meshed}
        | compared(measured, truth)
    ]


def fingertips() -> list[dict[str, Any]]:
    """Gravel under blocks 5 mm thick whose lower face is flat or a spherical cap, by tetrahedra."""
    skin = tactile.Skin(thickness_mm=FINGERTIP_MM)
    heights = resampled(stacked({"gravel": twelve()["gravel 0"]}), TETRAHEDRA_SIDE)[0]
    rows = []
    for radius in FINGERTIP_RADII_MM:
        surface = (
            block_surface(SIZE_MM, FINGERTIP_MM)
            if radius is None
            else fingertip_surface(SIZE_MM, FINGERTIP_MM, radius)
        )
        began = time.perf_counter()
        touch = press_tetrahedra(heights, skin, surface, SIZE_MM, Sizing(0.25, 1.0))
        rows.append(
            {
                "radius mm": "flat" if radius is None else radius,
                "V": float(tactile.roughness(touch.strain, SIZE_MM)),
                "A mm2": float(tactile.contact_area(touch.gap, SIZE_MM)),
                "in contact": float(touch.contact_fraction),
                "approach mm": float(touch.approach),
                "peak pressure MPa": float(touch.pressure.max()),
                "s": time.perf_counter() - began,
            }
        )
    return rows
