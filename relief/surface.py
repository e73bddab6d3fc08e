"""The surface of a relief: how large it is, how finely it is sampled, and along which axes it repeats."""

from dataclasses import dataclass

from relief.ground.formats import Repeats as Repeats


def axes(repeats: Repeats | None) -> tuple[bool, bool]:
    """Whether a relief repeats along y (rows) and along x (columns)."""
    return repeats in (True, "y"), repeats in (True, "x")


def repeats_along(ends: tuple[bool, bool]) -> Repeats:
    """The statement of the axes (y, x) on which a relief repeats; the inverse of `axes`."""
    return next(stated for stated in (True, "x", "y", False) if axes(stated) == ends)


@dataclass(frozen=True)
class Surface:
    """Size and sampling of a relief; its samples are square.

    Attributes:
        shape: rows and columns of the samples; row 0 lies at +y, column 0 at -x.
        width_mm: extent along x, mm.
        repeats: whether the relief is periodic along y (rows) and along x (columns). A periodic surface is a
            tile.
    """

    shape: tuple[int, int]
    width_mm: float
    repeats: tuple[bool, bool] = (False, False)

    @property
    def pitch_mm(self) -> float:
        """Distance between neighbouring samples, mm."""
        return self.width_mm / self.shape[1]

    @property
    def height_mm(self) -> float:
        """Extent along y, mm; exactly the width if the surface is square."""
        return self.width_mm * (self.shape[0] / self.shape[1])

    @property
    def size_mm(self) -> tuple[float, float]:
        """Extents along y and x, mm, in the order of `shape`."""
        return self.height_mm, self.width_mm
