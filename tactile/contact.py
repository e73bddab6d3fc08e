"""Unilateral (Signorini) contact of the skin with a rigid relief, without friction, at a prescribed force.

Pressures p >= 0 with a prescribed mean are sought such that the gap g = C p - h - approach is >= 0 and
p g = 0: they minimise 1/2 p'Cp - h'p over all admissible pressures. The solver is a constrained conjugate
gradient on pressures (Polonsky and Keer, Wear 231, 1999), preconditioned by the layer's inverse symbol on the
pressures of no force. Reliefs are solved in batches, and every item stops when it has converged.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import torch
from torch import Tensor

from relief.ground.progress import stage, this_stage

MAX_STEPS = 1000
"""Conjugate gradient steps after which a contact counts as not converged; reliefs of 3 mm take about 100."""

TOLERANCE = {torch.float32: 2e-5, torch.float64: 2e-10}
"""Residual of gap and complementarity over the mean displacement; single precision stagnates below 2e-5."""

ROUNDING = 4.0
"""Residual, in units in the last place of the relief's height, that always counts as none: with stiff skin
the tolerance lies below the rounding of the heights."""

GRADIENT_TOLERANCE = {torch.float32: 1e-4, torch.float64: 1e-9}
"""Relative residual of the adjoint system, by precision; a gradient's relative error is about as large."""


class Compliance(Protocol):
    """Elastic body as contact needs it: the compliance C and an approximate inverse."""

    def displacement(self, pressure: Tensor) -> Tensor:
        """Normal displacement C p (..., n, n), mm, of pressures (..., n, n) in units of Young's modulus.

        Linear, symmetric and positive definite; every item of a batch by itself.
        """

    def precondition(self, residual: Tensor) -> Tensor:
        """Pressures (..., n, n) that nearly cause a displacement (..., n, n), an approximate inverse of C.

        Linear, symmetric and positive definite. Its accuracy decides the number of steps, not the solution.
        """


@dataclass(frozen=True)
class ContactState:
    """Solution of a batch of contacts.

    Attributes:
        pressure: (..., n, n), in units of Young's modulus.
        gap: (..., n, n) mm, >= 0 within tolerance, 0 where pressure is positive.
        approach: (...) mm: descent of the skin's rigid half since first touch with the plane z = 0.
        steps: number of conjugate gradient steps of the slowest item.
        converged: (...) whether each item met the tolerance.
    """

    pressure: Tensor
    gap: Tensor
    approach: Tensor
    steps: int
    converged: Tensor


class ContactError(RuntimeError):
    """The contact did not converge."""


def solve_contact(
    body: Compliance,
    heights: Tensor,
    mean_pressure: float,
    start: Tensor | None = None,
    tolerance: float | None = None,
) -> ContactState:
    """Pressures and gaps of a batch of reliefs.

    Args:
        body: the skin.
        heights: (..., n, n) mm.
        mean_pressure: in units of Young's modulus.
        start: (..., n, n) pressures to start from, such as the last relief's in a descent; None: those of
            `bonded_pressure` that push.
        tolerance: residual as a fraction of the mean displacement; None for that of the precision.

    Raises:
        ContactError: an item did not converge in `MAX_STEPS` steps.
    """
    state = approach_contact(body, heights, mean_pressure, start, MAX_STEPS, tolerance)
    if not bool(state.converged.all()):
        lost = int((~state.converged).sum())
        raise ContactError(
            f"contact not converged in {MAX_STEPS} steps for {lost} of {state.converged.numel()} reliefs"
        )
    return state


SAME_LOAD = 8.0
"""Largest difference of two loads that counts as rounding, in units of the precision."""


@stage("pressing", total=1.0)
def approach_contact(
    body: Compliance,
    heights: Tensor,
    mean_pressure: float,
    start: Tensor | None,
    max_steps: int,
    tolerance: float | None = None,
) -> ContactState:
    """`solve_contact`, with the state after `max_steps` steps for items that have not converged by then."""
    shape = heights.shape
    h = heights.detach().reshape(-1, *shape[-2:])
    # Heights count from the top of each relief: an offset common to all samples would cost digits of the gap.
    top = h.amax((-2, -1), keepdim=True)
    h = h - top
    rounding = ROUNDING * torch.finfo(h.dtype).eps * h.abs().amax((-2, -1), keepdim=True)
    tol = TOLERANCE[h.dtype] if tolerance is None else tolerance
    tiny = torch.finfo(h.dtype).tiny
    p = bonded_pressure(body, h, mean_pressure) if start is None else start.detach().reshape(h.shape)
    p = p.clamp_min(0.0)
    scale = mean_pressure / _mean(p)
    # Pressures that carry the load stay as they are: a contact that goes on from its own end is the same.
    p = torch.where((scale - 1.0).abs() <= SAME_LOAD * torch.finfo(h.dtype).eps, p, p * scale)

    result_p, result_g, result_a = torch.empty_like(h), torch.empty_like(h), h.new_empty(h.shape[0])
    done = torch.zeros(h.shape[0], dtype=torch.bool)
    items = torch.arange(h.shape[0])
    direction, rho = torch.zeros_like(p), h.new_ones(p.shape[0], 1, 1)
    working = torch.zeros_like(p, dtype=torch.bool)
    displacement = body.displacement(p)
    for steps in range(max_steps + 1):
        contact = p > 0.0
        gap = displacement - h
        approach = _masked_mean(gap, contact)
        gap = gap - approach
        inside = (_sum(gap.square() * p) / _sum(p)).sqrt()
        outside = -torch.where(contact, 0.0, gap).amin((-2, -1), keepdim=True)
        allowed = torch.maximum(tol * _mean(displacement), rounding)
        off = torch.maximum(inside, outside)
        cut_short = steps / (max_steps + 1) if max_steps < MAX_STEPS else 0.0
        this_stage().residual_at((off / allowed).max(), cut_short)
        finished = (off <= allowed).view(-1)
        leaving = torch.ones_like(finished) if steps == max_steps else finished
        if bool(leaving.any()):
            where = items[leaving]
            result_p[where], result_g[where] = p[leaving], gap[leaving]
            result_a[where] = (approach - top)[leaving].view(-1)
            done[where] = finished[leaving]
            stay = ~leaving
            if not bool(stay.any()):
                break
            items, h, p, gap, contact = items[stay], h[stay], p[stay], gap[stay], contact[stay]
            top, rounding, displacement = top[stay], rounding[stay], displacement[stay]
            direction, rho, working = direction[stay], rho[stay], working[stay]
        # The working set has the pixels in contact and those where the skin would pass through the relief;
        # when the set changes, conjugacy is lost and the directions start anew.
        before, working = working, contact | (gap < 0.0)
        same = (before == working).all(-1, keepdim=True).all(-2, keepdim=True)
        mask = working.to(h.dtype)
        z = _preconditioned(body, _without_mean(gap, mask), mask)
        rho_before, rho = rho, _sum(gap * z)
        direction = z + torch.where(same, rho / rho_before, 0.0) * (mask * direction)
        image = body.displacement(direction)
        length = _sum(gap * direction) / _sum(direction * image).clamp_min(tiny)
        moved = p - length * direction
        p = moved.clamp_min(0.0)
        scale = mean_pressure / _mean(p)
        p, displacement = p * scale, (displacement - length * image) * scale
        # The displacement is linear in the pressure except where pulling pressures were cut off.
        cut = (moved < 0.0).any(-1).any(-1)
        if bool(cut.any()):
            displacement[cut] = body.displacement(p[cut])

    batch = shape[:-2]
    return ContactState(
        result_p.view(shape), result_g.view(shape), result_a.view(batch), steps, done.view(batch)
    )


Solver = Callable[[Compliance, Tensor, float, Tensor | None], ContactState]
"""Solver of contact, of body, heights (mm), mean pressure and pressures to start from (units of E)."""

MAX_SINGLE_STEPS = 100
"""Most steps in single precision before those in double precision."""


@dataclass(frozen=True, eq=False)
class SingleFirst:
    """Solver that finds the pixels in contact in single precision, and goes on in that of the heights.

    Two thirds of the steps find out which pixels touch, and the last digits come at a fixed rate after that.
    The result is as exact as that of `solve_contact`, in half of the time.

    Attributes:
        single: the skin in single precision.
    """

    single: Compliance

    def __call__(
        self, body: Compliance, heights: Tensor, mean_pressure: float, start: Tensor | None
    ) -> ContactState:
        """The contact; arguments and errors as of `solve_contact`."""
        relief = heights.detach()
        relief = (relief - relief.amax((-2, -1), keepdim=True)).float()
        begin = None if start is None else start.float()
        near = approach_contact(self.single, relief, mean_pressure, begin, MAX_SINGLE_STEPS)
        return solve_contact(body, heights, mean_pressure, near.pressure.to(heights.dtype))


class _Press(torch.autograd.Function):
    """Pressure and gap as functions of the heights, with gradients by implicit differentiation."""

    @staticmethod
    def forward(
        ctx: Any,
        heights: Tensor,
        body: Compliance,
        mean_pressure: float,
        start: Tensor | None,
        solve: Solver,
        tolerance: float,
    ) -> tuple[Tensor, Tensor, Tensor]:
        state = solve(body, heights, mean_pressure, start)
        ctx.body, ctx.tolerance = body, tolerance
        ctx.save_for_backward(state.pressure > 0.0)
        return state.pressure, state.gap, state.approach

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None, None, None, None, None]:
        to_pressure, to_gap, to_approach = gradients
        (contact,) = ctx.saved_tensors
        # Outside the contact gap = C p - h - approach; inside, the gap is zero whatever the heights.
        to_gap = torch.where(contact, torch.zeros_like(to_gap), to_gap)
        load = to_pressure + ctx.body.displacement(to_gap)
        total = _sum(to_gap) - to_approach[..., None, None]
        adjoint = adjoint_pressure(ctx.body, load, contact, total, ctx.tolerance)
        return adjoint - to_gap, None, None, None, None, None


def press(
    body: Compliance,
    heights: Tensor,
    mean_pressure: float,
    start: Tensor | None = None,
    solve: Solver = solve_contact,
    gradient_tolerance: float | None = None,
) -> tuple[Tensor, Tensor, Tensor]:
    """Pressure (units of E), gap and approach (mm), differentiable by the heights.

    The gradient is that of a fixed contact set, which is exact wherever no pixel is just touching. The
    gradient costs one conjugate-gradient solve restricted to the pixels in contact; the solver's own steps
    are not differentiated.

    Args:
        body: the skin.
        heights: (..., n, n) mm.
        mean_pressure: in units of Young's modulus.
        start: (..., n, n) pressures to start from; None: even ones.
        solve: solver of the contact.
        gradient_tolerance: relative residual of the adjoint system; None for that of the precision.

    Returns:
        (..., n, n) pressure, (..., n, n) gap and (...) approach.

    Raises:
        ContactError: the contact, or in the backward pass its adjoint, did not converge.
    """
    tolerance = GRADIENT_TOLERANCE[heights.dtype] if gradient_tolerance is None else gradient_tolerance
    pressure, gap, approach = _Press.apply(heights, body, mean_pressure, start, solve, tolerance)
    return pressure, gap, approach


@stage("gradient of the touch", total=1.0)
def adjoint_pressure(
    body: Compliance, load: Tensor, contact: Tensor, total: Tensor, tolerance: float | None = None
) -> Tensor:
    """Solve C x = load - constant on the pixels in contact, x = 0 elsewhere, sum of x = `total`.

    Args:
        body: the skin, with compliance C.
        load: (..., n, n) mm.
        contact: (..., n, n) bool.
        total: (..., 1, 1), in units of Young's modulus.
        tolerance: relative residual; None for that of the precision.

    Returns:
        x (..., n, n), in units of Young's modulus.

    Raises:
        ContactError: `MAX_STEPS` steps did not suffice.
    """
    tiny = torch.finfo(load.dtype).tiny
    tolerance = GRADIENT_TOLERANCE[load.dtype] if tolerance is None else tolerance
    mask = contact.to(load.dtype)
    x = mask * (total / _sum(mask))
    residual = load - body.displacement(x)
    direction, rho = torch.zeros_like(x), torch.ones_like(total)
    size = torch.zeros_like(total)
    for step in range(MAX_STEPS):
        # Directions sum to zero, so a constant in the residual changes no step; left in, the constant grows
        # until its rounding errors outweigh the residual.
        residual = _without_mean(residual, mask)
        error = _sum(residual.square()).sqrt()
        size = error if step == 0 else size
        unfinished = (error > tolerance * size).to(load.dtype)
        this_stage().residual_at((error / size).max() / tolerance)
        if not bool(unfinished.any()):
            return x
        z = _preconditioned(body, residual, mask)
        rho_before, rho = rho, _sum(residual * z)
        direction = z + (rho / rho_before.clamp_min(tiny)) * direction
        image = body.displacement(direction)
        length = unfinished * rho / _sum(direction * image).clamp_min(tiny)
        x = x + length * direction
        residual = residual - length * image
    raise ContactError(f"gradient of contact not converged in {MAX_STEPS} steps")


def bonded_pressure(body: Compliance, heights: Tensor, mean_pressure: float) -> Tensor:
    """(..., n, n) pressures of skin bonded to the relief (..., n, n) mm, by the approximate inverse of C.

    Where they push, they are nearer to the contact's than even pressures: a solution takes one to three steps
    less of twenty.
    """
    pressure = body.precondition(heights - _mean(heights))
    return pressure + (mean_pressure - _mean(pressure))


def _preconditioned(body: Compliance, residual: Tensor, mask: Tensor) -> Tensor:
    """Preconditioned residual on the pixels of a mask, where both are to have no sum.

    The force cannot change, so the system is that of pressures without a sum, and the orthogonal projection
    onto these on both sides keeps the preconditioner symmetric and positive definite.
    """
    return _without_mean(body.precondition(residual), mask)


def _without_mean(field: Tensor, mask: Tensor) -> Tensor:
    """A field on the pixels of a mask (1 or 0), less its mean there; 0 elsewhere."""
    return mask * (field - _sum(field * mask) / _sum(mask))


def _sum(field: Tensor) -> Tensor:
    return field.sum((-2, -1), keepdim=True)


def _mean(field: Tensor) -> Tensor:
    return field.mean((-2, -1), keepdim=True)


def _masked_mean(field: Tensor, mask: Tensor) -> Tensor:
    weight = mask.to(field.dtype)
    return _sum(field * weight) / _sum(weight)
