"""Plates: a tile repeated over a surface that is larger than the tile."""

from dataclasses import dataclass

import numpy as np

from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.lengths import RANGES
from relief.ground.limits import LARGEST_SIDE
from relief.seam import misfit


@dataclass(frozen=True)
class RepeatedTile:
    """A tile repeated from its first row and column on.

    Attributes:
        heights: (samples, samples), in the unit of the tile.
        size_mm: Side, mm: whole samples of the tile.
        tile_mm: Side of the tile, mm.
        tile_samples: Samples a side of the tile.
    """

    heights: Array
    size_mm: float
    tile_mm: float
    tile_samples: int

    def __str__(self) -> str:
        samples = len(self.heights)
        return (
            f"{samples} x {samples} samples over {self.size_mm:.6g} mm: the tile of {self.tile_mm:.6g} mm "
            f"{samples / self.tile_samples:.3g} times along each side"
        )


def repeated(tile: Array, tile_mm: float, plate_mm: float) -> RepeatedTile:
    """Repeat a tile over a plate.

    Args:
        tile: (side, side) heights.
        tile_mm: Side of the tile, mm.
        plate_mm: Side of the plate, mm, at least that of the tile; rounded to whole samples.

    Raises:
        InputError: The sides of the tile do not fit, or the plate is smaller than the tile or too large; the
            line begins with the field ``plate_mm``.
    """
    if (sentence := misfit(tile)) is not None:
        refused = f"plate_mm: {sentence}; make it periodic with "
        raise InputError(f"{refused}tile='auto'", f"{refused}--tile")
    side = len(tile)
    largest = min(RANGES["size_mm"][1], tile_mm * LARGEST_SIDE / side)
    if not tile_mm <= plate_mm <= largest:
        raise InputError(
            f"plate_mm: {plate_mm:g} is not a number from {tile_mm:g}, the side of the tile, to {largest:g}"
        )
    samples = round(plate_mm / tile_mm * side)
    place = np.arange(samples) % side
    return RepeatedTile(tile[np.ix_(place, place)], samples * tile_mm / side, tile_mm, side)
