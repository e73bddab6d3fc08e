"""Families of procedural textures, by name: each turns random numbers into heights."""

from collections.abc import Callable, Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from surrogate.families.cells import cracked, crumpled, leather, tiles
from surrogate.families.cloth import fibres, knit, weave
from surrogate.families.fields import gaussian, ripples, turing
from surrogate.families.grain import bark, brushed, scratches, wood
from surrogate.families.ground import blocks, terraces, terrain
from surrogate.families.lattices import chequer_plate, crossed, dots, grating, scales
from surrogate.families.points import bumps, gravel, hammered, pebbles, pores
from surrogate.families.texture_grid import Grid

Family = Callable[[np.random.Generator, Grid], NDArray[np.float64]]
"""A function from a generator and a grid to heights (samples, samples) that fill [0, 1].

What is drawn depends on the generator alone; parameters are in mm, whatever the number of samples. On a
periodic grid, the families of `PERIODIC` go on as themselves across the borders.
"""

FAMILIES: Mapping[str, Family] = MappingProxyType(
    {
        family.__name__: family
        for family in (
            bark,
            blocks,
            brushed,
            bumps,
            chequer_plate,
            cracked,
            crossed,
            crumpled,
            dots,
            fibres,
            gaussian,
            grating,
            gravel,
            hammered,
            knit,
            leather,
            pebbles,
            pores,
            ripples,
            scales,
            scratches,
            terraces,
            terrain,
            tiles,
            turing,
            weave,
            wood,
            # Append new families here: the order decides what every corpus draws.
        )
    }
)
"""Families by name, in an order that must never change."""
PERIODIC = frozenset(FAMILIES) - {"fibres", "scratches", "tiles", "wood"}
"""Families that can be drawn as tiles.

They are sums of periodic waves, or cells around points that repeat, or lattices whose cells give way until
whole ones fit into the period. Long strands, bricks with a tilt each and rings around a knot have no such
form.
"""
FIRST_FAMILIES = 27
"""Number of families, from the first, that one random number chooses from; each later one has its own."""
