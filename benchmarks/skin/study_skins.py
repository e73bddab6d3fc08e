"""Skins of the study: the default one, others of one modulus, and a grid of layered ones."""

from __future__ import annotations

from tactile.skin import Skin

FORCE_N = 10.0
BASES_MPA, TOPS_MPA, TOPS_MM = (0.1, 0.2, 0.4), (1.0, 2.0, 3.0, 4.0), (0.4, 0.7, 1.0)
"""Grid of layered skins: modulus of the tissue below, modulus and thickness of the layer above."""


def plain() -> dict[str, Skin]:
    """Skins of one modulus, by force over modulus in mm²."""
    return {
        f"F/E {ratio:g}": Skin(young_modulus_mpa=FORCE_N / ratio) for ratio in (40.0, 20.0, 10.0, 4.0, 2.0)
    }


def layered() -> dict[str, Skin]:
    """The grid of layered skins, by thickness and modulus of the layer and modulus of the base."""
    return {
        f"{mm:g} mm of {top:g} over {base:g} MPa": Skin(young_modulus_mpa=base, layers=((mm, top),))
        for mm in TOPS_MM
        for top in TOPS_MPA
        for base in BASES_MPA
    }
