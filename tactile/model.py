"""Touch: strain, gap and pressure of the skin pressed on a relief, by the model of one's choice."""

import math
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Literal, get_args

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from relief.ground.errors import InputError
from relief.ground.limits import PATCH_SIDE_MM
from relief.ground.progress import say, stage
from relief.ground.threads import one_torch_thread
from relief.patches import Patches
from relief.places import patch_shape
from relief.surface import Surface
from tactile.contact import TIGHT, SingleFirst, Solver, solve_contact
from tactile.elements.finite_elements import FiniteElementOperator, finite_element_operator
from tactile.elements.round_pad import RoundPadOperator, round_pad_operator
from tactile.layer.elastic_layer import ElasticLayerOperator, elastic_layer_operator
from tactile.layer.truncated import GRADIENT_TOLERANCE, quick_solver
from tactile.pair_variation import WIDEST_MM
from tactile.pressing import Press, SkinOperator
from tactile.skin import Skin
from tactile.touch import Touch, share_in_contact
from tactile.touch_limits import FEM_MESH, MAX_MESH, MAX_SAMPLES, MIN_MESH, MIN_SAMPLES

ModelName = Literal["layer", "quick", "net", "fem"]
MODELS: tuple[str, ...] = get_args(ModelName)
"""Models of touch: elastic layer; the layer after a truncated solve; a net in it; finite elements."""
_Operator = FiniteElementOperator | RoundPadOperator | ElasticLayerOperator

NARROWEST_MM = 4.0
"""Least width of a round finger's contact with a flat plate, mm, that holds pairs of all distances."""
LEAST_BESIDE_MM = 2.0
"""Least distance of a round finger's contact from the sides of the patch, mm."""
LARGE_STRAIN = 0.4
"""Least strain under a flat plate at which a user is warned that the theory is of small strains. The measured
finger at 1 N has a strain of 0.36."""
MIN_LOAD, MAX_LOAD = 1e-6, 100.0
"""Least and greatest mean pressure in units of Young's modulus: 500 times the usual load squeezes the skin by
many times its thickness, and far beyond, rounding doubles V in single precision without any other sign."""


@dataclass(frozen=True)
class TouchModel:
    """Model of touch: the operator of one skin, grid and precision, with the flat plate's strain.

    Attributes:
        skin: parameters of the skin.
        operator: displacements and strains of the skin, at unit modulus.
        flat_strain: (n, n) principal strain under a flat plate, or on the curved object without a relief, to
            be subtracted.
        solve: solver of the contact.
        gradient_tolerance: relative residual of the gradient's linear solve; None for the default of the
            precision.
        receptors: (n, n) 1 where a round finger touches a flat plate, else 0; None of a flat one.
    """

    skin: Skin
    operator: SkinOperator
    flat_strain: Tensor
    solve: Solver = solve_contact
    gradient_tolerance: float | None = None
    receptors: Tensor | None = None

    def __repr__(self) -> str:
        return f"TouchModel({self.skin}, {self.operator})"

    def press(self, heights: Tensor, start: Tensor | None = None) -> Touch:
        """Press the skin on a batch of reliefs.

        Args:
            heights: (..., n, n) mm, in the operator's precision; minus infinity where nothing is below a
                round finger, as beyond the rim of a plate.
            start: pressures (MPa) to start from, such as the last relief's in a descent.

        Raises:
            ContactError: the contact did not converge.
        """
        modulus = self.skin.young_modulus_mpa
        finger = Press.of(self.skin, self.operator, self.solve, self.gradient_tolerance)
        pressure, gap, approach, bound = finger.contact(heights, None if start is None else start / modulus)
        strain = finger.felt(pressure) - self.flat_strain
        return Touch(
            strain,
            gap,
            pressure * modulus,
            approach,
            share_in_contact(pressure),
            self.operator.size_mm,
            bound,
            self._receptors_over(heights.detach()),
        )

    def _receptors_over(self, heights: Tensor) -> Tensor | None:
        """The receptors that count over heights (..., n, n), of which all may share one map (n, n)."""
        there = torch.isfinite(heights)
        if self.receptors is None or bool(there.all()):
            return self.receptors
        return self.receptors * there


def check_model(skin: Skin, samples: int, size_mm: float, model: ModelName, mesh: int = FEM_MESH) -> None:
    """Check what `touch_model` takes, before anything is built; the same arguments.

    Raises:
        InputError: as `touch_model`, but for a net that is missing.
    """
    if model not in MODELS:
        raise InputError(f'touch.model: "{model}" is not one of {", ".join(MODELS)}')
    if skin.curvatures is not None and model == "net":
        on = "finger" if skin.shape == "round" else "object"
        raise InputError(f'touch.model: the net is trained for a flat {on}; use "layer"')
    if not MIN_SAMPLES <= samples <= MAX_SAMPLES:
        where = f"{samples} samples a side of the {size_mm:g} mm under a finger"
        remedy = "more samples, or a smaller size_mm, are needed"
        if samples > MAX_SAMPLES:
            remedy = "retouch prepare --samples makes a picture coarser"
        raise InputError(f"heights: {where} are outside [{MIN_SAMPLES}, {MAX_SAMPLES}]; {remedy}")
    if not 1.0 <= size_mm <= 100.0:
        raise InputError(f"size_mm: {size_mm} is outside [1, 100]")
    if not MIN_MESH <= mesh <= MAX_MESH or mesh % 2:
        raise InputError(f"mesh: {mesh} is not an even number in [{MIN_MESH}, {MAX_MESH}]")
    mean = skin.mean_pressure_mpa(size_mm) / skin.young_modulus_mpa
    if not MIN_LOAD <= mean <= MAX_LOAD:
        raise InputError(
            f"skin: force_n {skin.force_n:g} N on a side of {size_mm:g} mm with young_modulus_mpa "
            f"{skin.young_modulus_mpa:g} is a pressure of {mean:g} Young's moduli, outside "
            f"[{MIN_LOAD:g}, {MAX_LOAD:g}]"
        )


@lru_cache(maxsize=8)
@stage("preparing the skin")
@one_torch_thread()
def touch_model(
    skin: Skin,
    samples: int,
    size_mm: float,
    dtype: torch.dtype = torch.float64,
    model: ModelName = "layer",
    mesh: int = FEM_MESH,
) -> TouchModel:
    """The model of a skin on an n x n patch, kept in memory; its operators are kept on disk, too.

    Args:
        skin: parameters of the skin.
        samples: n.
        size_mm: side of the patch.
        dtype: precision of heights and results.
        model: one of `MODELS`, as in `press`.
        mesh: nodes a side of the finite elements; without meaning for the other models.

    Raises:
        InputError: an unknown model; `samples`, `size_mm` or `mesh` out of range; no net for them.
    """
    check_model(skin, samples, size_mm, model, mesh)
    solver: Solver | None = None
    if model == "quick":
        single = elastic_layer_operator(skin, samples, size_mm, torch.float32)
        solver = quick_solver(single, layered=bool(skin.layers))
    elif model == "net":
        # Imported here: the other models need no net. A net that does not hold is refused before any operator
        # is built, which may take seconds.
        from tactile.net import net_solver

        solver = net_solver(skin, samples, size_mm)
    operator, flat_strain, receptors = _in_double(
        skin, samples, size_mm, "fem" if model == "fem" else "layer", mesh
    )
    counted = None if receptors is None else receptors.to(dtype)
    converged = TouchModel(skin, operator.to(dtype), flat_strain.to(dtype), receptors=counted)
    if solver is not None:
        return replace(converged, solve=solver, gradient_tolerance=GRADIENT_TOLERANCE)
    if dtype == torch.float64:
        return replace(converged, solve=SingleFirst(operator.to(torch.float32)))
    return converged


@lru_cache(maxsize=8)
def _in_double(
    skin: Skin, samples: int, size_mm: float, model: ModelName, mesh: int
) -> tuple[_Operator, Tensor, Tensor | None]:
    """Operator, strain on the object without relief and receptors that count, for models of any precision."""
    operator: _Operator
    if model == "fem" and skin.shape == "round":
        operator = round_pad_operator(skin, samples, size_mm)
    elif model == "fem":
        operator = finite_element_operator(skin, samples, size_mm, torch.float64, mesh)
    else:
        operator = elastic_layer_operator(skin, samples, size_mm, torch.float64)
    flat = torch.zeros(samples, samples, dtype=torch.float64)
    finger = Press.of(skin, operator)
    pressure = finger.pressure(flat, TIGHT)
    strain = finger.felt(pressure)
    receptors = None if skin.shape == "flat" else _touched(skin, pressure, strain, operator.size_mm)
    return operator, strain, receptors


def _touched(skin: Skin, pressure: Tensor, strain: Tensor, size_mm: float) -> Tensor:
    """(n, n) 1 where a round finger touches a flat plate, else 0.

    Raises:
        InputError: no pair of receptors lies in the contact, or the contact comes near the patch's sides.
    """
    touched = pressure > 0.0
    pitch = size_mm / len(touched)
    wide = max(int(touched.any(axis).sum()) for axis in (0, 1)) * pitch
    about = f"skin.force_n: with {skin.force_n:g} N the finger touches {wide:.1f} mm of a flat plate"
    if wide < NARROWEST_MM:
        raise InputError(f"{about}; pairs of receptors {WIDEST_MM:g} mm apart need {NARROWEST_MM:g} mm")
    if wide > size_mm - 2.0 * LEAST_BESIDE_MM:
        raise InputError(f"{about}, too much for a patch of {size_mm:.3g} mm")
    largest = float(strain.abs().max())
    if largest > LARGE_STRAIN:
        _warn_of_large_strain(skin, wide, largest)
    return touched.to(pressure.dtype)


_WARNED: set[Skin] = set()
"""Fingers whose large strain a user was warned of: several models of one finger warn once."""


def _warn_of_large_strain(skin: Skin, wide_mm: float, strain: float) -> None:
    if skin not in _WARNED:
        _WARNED.add(skin)
        say(
            f"a finger of {skin.force_n:g} N touches {wide_mm:.1f} mm of a flat plate and strains its skin "
            f"by {100.0 * strain:.0f} %; the theory is of small strains"
        )


@one_torch_thread()
def press(
    heights: Tensor | NDArray[np.floating],
    size_mm: float = PATCH_SIDE_MM,
    skin: Skin | None = None,
    model: ModelName = "layer",
    start: Tensor | None = None,
    mesh: int = FEM_MESH,
) -> Touch:
    """Press the skin on a relief.

    Args:
        heights: (..., n, n) mm; float32 or float64, which is also the precision of the result.
        size_mm: side of the heights, at most 10. A round finger needs a patch of `Skin.patch_mm`: nothing
            lies around smaller heights, and the touch is of all of the patch. Whole patches may have minus
            infinity where nothing is below.
        skin: parameters of the skin; None for `Skin()`.
        model: "layer", the elastic layer with free sides; "fem", finite elements (the first press of a skin
            waits until they are built: 4 s with 64 nodes a side, 45 s with 128); "quick", the layer after a
            few steps of the solver; "net", the layer with a trained net in the place of some of the steps,
            for the grid and skin of its training only.
        start: pressures (MPa) to start from; "quick" and "net" ignore them.
        mesh: nodes a side of the finite elements.

    Returns:
        The touch, with gradients by the heights.

    Raises:
        InputError: a patch larger than a finger's; heights are not square, too few, too many or not finite;
            an unknown model; an unfit mesh; a skin or grid that the net was not trained for.
        ContactError: the contact did not converge.
    """
    if isinstance(heights, np.ndarray):
        # torch takes neither flipped, nor read-only, nor foreign-endian arrays.
        heights = np.array(heights, dtype=heights.dtype.newbyteorder("="), order="C")
    field = torch.as_tensor(heights)
    if field.ndim < 2 or field.shape[-1] != field.shape[-2]:
        raise InputError(f"heights: shape {tuple(field.shape)} is not square in its last two dimensions")
    if field.dtype not in (torch.float32, torch.float64):
        raise InputError(f"heights: {field.dtype} is neither float32 nor float64")
    skin = skin or Skin()
    # A whole patch may have samples with nothing below; smaller heights are resampled on it.
    gaps = skin.patch_mm is not None and size_mm >= skin.patch_mm * (1.0 - 1e-9)
    if not bool((torch.isfinite(field) | (torch.isneginf(field) & gaps)).all()):
        raise InputError("heights: not every value is finite")
    if skin.patch_mm is not None:
        field, size_mm = _surrounded(field, float(size_mm), skin.patch_mm)
    samples = field.shape[-1]
    if (
        skin.patch_mm is None
        and size_mm > PATCH_SIDE_MM
        and patch_shape(Surface((samples, samples), float(size_mm)))[0] < samples
    ):
        raise InputError(
            f"size_mm: {size_mm:g} is more than the {PATCH_SIDE_MM:g} mm that a finger presses on; "
            "retouch.evaluate presses on every place of a larger plate"
        )
    skin_model = touch_model(skin, samples, float(size_mm), field.dtype, model, mesh)
    return skin_model.press(field, start)


def _surrounded(heights: Tensor, size_mm: float, side_mm: float) -> tuple[Tensor, float]:
    """Heights (..., n, n) mm in the middle of a patch of `side_mm`, nothing around them, and that side."""
    if math.isclose(size_mm, side_mm, rel_tol=1e-9) or size_mm > side_mm:
        return heights, size_mm
    samples = heights.shape[-1]
    patch = Patches(Surface((samples, samples), size_mm), np.zeros((1, 2), dtype=np.int64), side_mm=side_mm)
    nearest = torch.as_tensor(patch.lines[0][0])
    around = heights[..., nearest[:, None], nearest]
    if patch.spline is not None:
        weights = torch.as_tensor(patch.spline).to(heights.dtype)
        around = weights @ around @ weights.T
    over = torch.as_tensor(patch.over_plate()[0])
    return torch.where(over, around, -math.inf), side_mm
