"""The finger: soft skin on a bone, flat or round, pressed on a rigid texture (paper section 4.2)."""

import math
from dataclasses import dataclass, fields, replace
from typing import Any, Literal, get_args

from relief.ground.errors import InputError

MAX_POISSON_RATIO = 0.499
"""Largest Poisson's ratio: the hexahedra of `tactile.structured` are measured up to here, and lock at 0.5."""
LARGEST_THICKNESS_MM = 20.0
"""Largest thickness, mm, eight times the usual one. The meshes have layers of at most 0.3 mm, so that memory
grows with the thickness: with 64 nodes a side 6.25 mm take a minute and 2.6 GB."""
MOST_LAYERS = 8
"""Most layers above the base."""
THINNEST_LAYER_MM = 0.02
"""Least thickness of a layer, mm, that of the stratum corneum."""
MODULUS_RATIO = 1000.0
"""Largest ratio, either way, of a layer's modulus to the base's: up to here the elements are measured."""

LEAST_CURVED_MM, LARGEST_CURVED_MM = 3.0, 1e4
"""Least and largest radius of a curved object under the finger, mm: a rod as thin as a pencil, and flat."""

LEAST_RADIUS_MM, LARGEST_RADIUS_MM = 3.0, 100.0
"""Least and largest radius of a round finger, mm: less than a child's fingertip, and nearly flat."""

ROUND_PATCH_MM, BESIDE_MM, PATCH_STEP_MM, WIDEST_PATCH_MM = 16.0, 3.0, 4.0, 32.0
"""Least side of the patch that a round finger is pressed on, what is added to the width of a contact for it,
the step of sides, and the largest, mm. With 0.5 mm of 0.35 over 0.03 MPa and 8 mm of radius, V of three
textures on 16 mm is 0.3 % below that on 24 mm at 0.6 N, and 1.7 % at 2 N."""

Shape = Literal["flat", "round"]
"""Flat and square, as the paper's; or a pad that is round along and across the finger."""
SHAPES: tuple[str, ...] = get_args(Shape)

Layers = tuple[tuple[float, float], ...]
"""Layers of the skin from the surface down: thickness in mm and Young's modulus in MPa of each."""


@dataclass(frozen=True)
class Skin:
    """Parameters of a finger: its skin, its shape and its force.

    The paper states geometry and force, but neither modulus nor Poisson's ratio. E = 0.5 MPa and nu = 0.48
    are a calibrated choice: with free sides, natural reliefs then lie in the paper's range of roughness (0.03
    to 0.12). Displacements depend on force/E only, so one set of operators serves every modulus and force.

    Attributes:
        young_modulus_mpa: Young's modulus of the soft half, N/mm²; with layers, that of the base below them.
        poisson_ratio: Poisson's ratio of the soft half, in [0, 0.499].
        force_n: total normal force, N.
        thickness_mm: thickness of the soft half, at most 20; it is bonded to the rigid half (bone).
        depth_mm: depth of the receptors below the skin's surface, where strain is read; on a boundary between
            layers it is the lower layer's strain.
        layers: at most 8 layers above the base, from the surface down: thickness in mm, at least 0.02, and
            Young's modulus in MPa, between a thousandth and a thousand times the base's. The base takes what
            they leave of `thickness_mm`. Poisson's ratio is the same everywhere.
        shape: "flat", a square block with free sides; or "round", a pad of even thickness on a bone, whose
            surface rises as a paraboloid of two radii.
        radius_mm: radius along the finger, which lies along the rows' axis, y; 3 to 100. Of round ones only.
        across_mm: radius across it, along x; None: as along.
        curved_x_mm: radius of the object that carries the texture, along x: positive where it bulges towards
            the finger, as a ball does, negative where it is hollow; None where it is straight.
        curved_y_mm: the same along y.

    Raises:
        InputError: a value is not finite or out of range.
    """

    young_modulus_mpa: float = 0.5
    poisson_ratio: float = 0.48
    force_n: float = 10.0
    thickness_mm: float = 2.5
    depth_mm: float = 0.75
    layers: Layers = ()
    shape: Shape = "flat"
    radius_mm: float | None = None
    across_mm: float | None = None
    curved_x_mm: float | None = None
    curved_y_mm: float | None = None

    def __post_init__(self) -> None:
        for name, value in self.numbers().items():
            if not math.isfinite(value):
                raise InputError(f"skin.{name}: {value} is not a finite number")
        for name in ("young_modulus_mpa", "force_n", "thickness_mm", "depth_mm"):
            if getattr(self, name) <= 0.0:
                raise InputError(f"skin.{name}: {getattr(self, name)} must be positive")
        if not 0.0 <= self.poisson_ratio <= MAX_POISSON_RATIO:
            raise InputError(f"skin.poisson_ratio: {self.poisson_ratio} is outside [0, {MAX_POISSON_RATIO}]")
        if self.thickness_mm > LARGEST_THICKNESS_MM:
            raise InputError(f"skin.thickness_mm: {self.thickness_mm} is more than {LARGEST_THICKNESS_MM:g}")
        if self.depth_mm >= self.thickness_mm:
            raise InputError(
                f"skin.depth_mm: {self.depth_mm} is not less than thickness_mm {self.thickness_mm}"
            )
        self._check_layers()
        self._check_shape()

    def _check_layers(self) -> None:
        try:
            pairs = tuple((float(thickness), float(modulus)) for thickness, modulus in self.layers)
        except (TypeError, ValueError):
            raise InputError(
                f"skin.layers: {self.layers!r} is not a list of pairs of thickness_mm and young_modulus_mpa"
            ) from None
        # A list, as files have it, would not be hashable.
        object.__setattr__(self, "layers", pairs)
        if len(pairs) > MOST_LAYERS:
            raise InputError(f"skin.layers: {len(pairs)} layers are more than {MOST_LAYERS}")
        for number, (thickness, modulus) in enumerate(pairs, 1):
            # Written so that NaN is refused.
            if not thickness >= THINNEST_LAYER_MM:
                raise InputError(
                    f"skin.layers: layer {number}: thickness {thickness} mm is not at least "
                    f"{THINNEST_LAYER_MM:g}"
                )
            least, most = self.young_modulus_mpa / MODULUS_RATIO, self.young_modulus_mpa * MODULUS_RATIO
            # Room for the rounding of moduli in units of the base's (`at_unit_modulus`).
            if not (1.0 - 1e-12) * least <= modulus <= (1.0 + 1e-12) * most:
                raise InputError(
                    f"skin.layers: layer {number}: modulus {modulus} MPa is outside [{least:g}, {most:g}], a "
                    f"thousandth to a thousand times young_modulus_mpa"
                )
        together = sum(thickness for thickness, _ in pairs)
        if pairs and not together <= self.thickness_mm - THINNEST_LAYER_MM:
            raise InputError(
                f"skin.layers: {together:g} mm together leave less than {THINNEST_LAYER_MM:g} mm of "
                f"thickness_mm {self.thickness_mm:g} for the base"
            )

    def _check_shape(self) -> None:
        if self.shape not in SHAPES:
            raise InputError(f'skin.shape: "{self.shape}" is not one of {", ".join(SHAPES)}')
        if self.shape == "round" and self.radius_mm is None:
            raise InputError("skin.radius_mm: a round finger needs its radius, mm")
        for name in ("radius_mm", "across_mm"):
            radius = getattr(self, name)
            if radius is None:
                continue
            if self.shape == "flat":
                raise InputError(f'skin.{name}: only a finger of shape = "round" has a radius')
            if not LEAST_RADIUS_MM <= radius <= LARGEST_RADIUS_MM:
                raise InputError(
                    f"skin.{name}: {radius:g} is outside [{LEAST_RADIUS_MM:g}, {LARGEST_RADIUS_MM:g}]"
                )
        self._check_object()
        if self.patch_mm is not None and self.patch_mm > WIDEST_PATCH_MM:
            raise InputError(
                f"skin.force_n: {self.force_n:g} N may flatten a finger of this radius and modulus to more "
                f"than {WIDEST_PATCH_MM - BESIDE_MM:g} mm"
            )

    def _check_object(self) -> None:
        fingers = self.radii_mm or (math.inf, math.inf)
        for name, finger in zip(("curved_y_mm", "curved_x_mm"), fingers, strict=True):
            radius = getattr(self, name)
            if radius is None:
                continue
            if not LEAST_CURVED_MM <= abs(radius) <= LARGEST_CURVED_MM:
                raise InputError(
                    f"skin.{name}: {radius:g} is neither in [{LEAST_CURVED_MM:g}, {LARGEST_CURVED_MM:g}] nor "
                    "minus that, for a hollow"
                )
            if finger < math.inf and -finger <= radius < 0.0:
                raise InputError(f"skin.{name}: no room for the finger in a hollow of {-radius:g} mm")

    @property
    def curvatures(self) -> tuple[float, float] | None:
        """Curvature of the finger and of the object together, along y and x, 1/mm; None where both are flat.

        In the theory of small strains a finger on a curved object presses as a rounder one on a plate.
        """
        if self.radius_mm is None and self.curved_x_mm is None and self.curved_y_mm is None:
            return None
        along, across = (math.inf, math.inf) if self.radii_mm is None else self.radii_mm
        return (
            1.0 / along + 1.0 / (self.curved_y_mm or math.inf),
            1.0 / across + 1.0 / (self.curved_x_mm or math.inf),
        )

    @property
    def radii_mm(self) -> tuple[float, float] | None:
        """Radii along and across a round finger, mm; None of a flat one."""
        if self.radius_mm is None:
            return None
        return self.radius_mm, self.radius_mm if self.across_mm is None else self.across_mm

    @property
    def patch_mm(self) -> float | None:
        """Least side of the patch that a round finger is pressed on, mm; None of a flat one.

        The contact is at most as wide as Hertz's of the base alone, which layers and the bone only stiffen.
        """
        if self.radii_mm is None or self.curvatures is None:
            return None
        # A hollow fits the finger, which is then touched more widely; on a ball the patch is wide enough.
        radius = max(*self.radii_mm, 1.0 / min(self.curvatures))
        modulus = self.young_modulus_mpa / (1.0 - self.poisson_ratio**2)
        half = (0.75 * self.force_n * radius / modulus) ** (1.0 / 3.0)
        # Few sides serve many forces, as elements are kept for each.
        needed = max(ROUND_PATCH_MM, 2.0 * half + BESIDE_MM)
        return PATCH_STEP_MM * math.ceil(needed / PATCH_STEP_MM - 1e-9)

    def numbers(self) -> dict[str, float]:
        """The parameters that are numbers, by name: all but the layers and the shape's name."""
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        return {
            name: value
            for name, value in values.items()
            if name not in ("layers", "shape") and value is not None
        }

    def described(self) -> dict[str, Any]:
        """The parameters by name, as in files; layers and shape only where they differ from the defaults."""
        layers = {"layers": [list(layer) for layer in self.layers]} if self.layers else {}
        return self.numbers() | layers | ({"shape": self.shape} if self.shape != "flat" else {})

    def __repr__(self) -> str:
        return f"Skin({', '.join(f'{name}={value!r}' for name, value in self.described().items())})"

    @property
    def stack(self) -> Layers:
        """The layers, their moduli in units of `young_modulus_mpa`."""
        return tuple((thickness, modulus / self.young_modulus_mpa) for thickness, modulus in self.layers)

    @property
    def structure(self) -> dict[str, float | str]:
        """Keys of operators stored on disk: all that they depend on, which is no load, modulus or shape."""
        return {
            "nu": self.poisson_ratio,
            "thickness": self.thickness_mm,
            "depth": self.depth_mm,
            "layers": repr(self.stack),
        }

    def at_unit_modulus(self) -> "Skin":
        """The skin that has the same operators: the one of unit modulus and force."""
        flat = replace(self, shape="flat", radius_mm=None, across_mm=None, curved_x_mm=None, curved_y_mm=None)
        return replace(flat, young_modulus_mpa=1.0, force_n=1.0, layers=self.stack)

    def mean_pressure_mpa(self, size_mm: float) -> float:
        """Mean pressure in N/mm² on a square patch of side `size_mm`."""
        return self.force_n / size_mm**2


def lame(young_modulus: float, poisson_ratio: float) -> tuple[float, float]:
    """Lamé's constants (lambda, mu) in the unit of the modulus."""
    mu = young_modulus / (2.0 * (1.0 + poisson_ratio))
    lam = young_modulus * poisson_ratio / ((1.0 + poisson_ratio) * (1.0 - 2.0 * poisson_ratio))
    return lam, mu
