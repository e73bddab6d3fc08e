"""Unilateral (Signorini) contact of the skin with a rigid relief, without friction, at a prescribed force.

Pressures p >= 0 with a prescribed mean are sought such that the gap g = C p - h - approach is >= 0 and
p g = 0: they minimise 1/2 p'Cp - h'p over all admissible pressures. The solver is a constrained conjugate
gradient on pressures (Polonsky and Keer, Wear 231, 1999), preconditioned by the layer's inverse symbol on the
pressures of no force. Reliefs are solved in batches, and every item stops when it has converged.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NamedTuple, Protocol

import torch
from torch import Tensor

from relief.ground.progress import stage, this_stage

MAX_STEPS = 1000
"""Conjugate gradient steps after which a contact counts as not converged; reliefs of 3 mm take about 50."""


@dataclass(frozen=True, kw_only=True)
class Stop:
    """Rule that ends a solution, by the bound or by the residual.

    Attributes:
        bound: a contact has converged when its `ContactState.bound` is at most this; 0 where the residual
            decides.
        residual: a contact has converged when the residual of gap and complementarity, over the mean
            displacement, is at most this; 0 where the bound decides.

    Raises:
        ValueError: both numbers are given, or none.
    """

    bound: float = 0.0
    residual: float = 0.0

    def __post_init__(self) -> None:
        if (self.bound > 0.0) == (self.residual > 0.0):
            raise ValueError("either a bound or a residual ends a contact")


LARGEST_BOUND = 1e-5
"""Largest bound of the energy's error, over the elastic energy, of a contact in double precision. V is then
within 0.003 % of that of a tight solution on 100 reliefs 10 µm to 3 mm high (docs/evidence/touch.md).
Rounding alone would reach this bound where displacements are 1e-11 of the relief's height."""

TIGHT = Stop(residual=2e-10)
"""Rule for references: the bound is then about 1e-9."""

STOPS = {torch.float32: Stop(residual=2e-5), torch.float64: Stop(bound=LARGEST_BOUND)}
"""Rule by precision, where none is given. Steps of a descent are in single precision, where residuals fall to
about 1e-6. At 2e-5 the bound is usually 2e-5 to 3e-4."""

ROUNDING = 4.0
"""Residual that counts as rounding, in units of the precision times the height of the relief. With stiff skin
the allowed residual can lie below."""

GRADIENT_TOLERANCE = {torch.float32: 1e-4, torch.float64: 1e-9}
"""Relative residual of the adjoint system, by precision; a gradient's relative error is about as large."""


class Compliance(Protocol):
    """Elastic body as contact needs it: the compliance C, the elastic energy and an approximate inverse."""

    def displacement(self, pressure: Tensor) -> Tensor:
        """Normal displacement C p (..., n, n), mm, of pressures (..., n, n) in units of Young's modulus.

        Linear, symmetric and positive definite; every item of a batch by itself.
        """

    def precondition(self, residual: Tensor) -> Tensor:
        """Pressures (..., n, n) that nearly cause a displacement (..., n, n), an approximate inverse of C.

        Linear, symmetric and positive definite. Its accuracy decides the number of steps, not the solution.
        """

    def energy(self, pressure: Tensor) -> Tensor:
        """(..., 1, 1) elastic energy 1/2 p'Cp of pressures (..., n, n), summed over the samples.

        Bodies that have it for less than a displacement say so.
        """
        return 0.5 * (pressure * self.displacement(pressure)).sum((-2, -1), keepdim=True)


@dataclass(frozen=True)
class ContactState:
    """Solution of a batch of contacts.

    Attributes:
        pressure: (..., n, n), in units of Young's modulus.
        gap: (..., n, n) mm, >= 0 within tolerance, 0 where pressure is positive.
        approach: (...) mm: descent of the skin's rigid half since first touch with the plane z = 0.
        steps: number of conjugate gradient steps of the slowest item.
        converged: (...) whether each item met the rule that ends a solution.
        bound: (...) upper bound of the energy's error over the elastic energy. The error is what
            1/2 p'Cp - h'p lies above its least value; its bound is the Frank-Wolfe gap, the work that the
            pressures would release if all of the force acted where the gap is least.
    """

    pressure: Tensor
    gap: Tensor
    approach: Tensor
    steps: int
    converged: Tensor
    bound: Tensor


class ContactError(RuntimeError):
    """The contact did not converge."""


def solve_contact(
    body: Compliance,
    heights: Tensor,
    mean_pressure: float,
    start: Tensor | None = None,
    stop: Stop | None = None,
) -> ContactState:
    """Pressures and gaps of a batch of reliefs.

    Args:
        body: the skin.
        heights: (..., n, n) mm.
        mean_pressure: in units of Young's modulus.
        start: (..., n, n) pressures to start from, such as the last relief's in a descent; None: those of
            `bonded_pressure` that push.
        stop: rule that ends the solution; None for that of the precision.

    Raises:
        ContactError: an item did not converge in `MAX_STEPS` steps.
    """
    state = approach_contact(body, heights, mean_pressure, start, MAX_STEPS, stop)
    if not bool(state.converged.all()):
        lost = int((~state.converged).sum())
        raise ContactError(
            f"contact not converged in {MAX_STEPS} steps for {lost} of {state.converged.numel()} reliefs"
        )
    return state


SAME_LOAD = 8.0
"""Largest difference of two loads that counts as rounding, in units of the precision."""


STALLED_STEPS, STALLED_FALL = 8, 0.9
"""Number of steps without a fall of the residual to this share of its last low, after which single precision
leads no further. On a periodic half-space with 128 samples a side it leads to 4e-6 of the mean displacement,
and with 1024 to 1e-4."""
ROUNDED_BOUND = 1e-3
"""Largest bound of a contact that has converged because single precision leads no further: V is then within
0.02 %."""
FAR_MM = 1e6
"""Gap, mm, larger than any relief's: added to pixels in contact, it leaves the least gap of the others."""


@stage("pressing", total=1.0)
def approach_contact(
    body: Compliance,
    heights: Tensor,
    mean_pressure: float,
    start: Tensor | None,
    max_steps: int,
    stop: Stop | None = None,
) -> ContactState:
    """`solve_contact`, with the state after `max_steps` steps for items that have not converged by then."""
    shape = heights.shape
    stop = STOPS[heights.dtype] if stop is None else stop
    now = _start(body, heights.detach().reshape(-1, *shape[-2:]), mean_pressure, start)
    pressure, gaps = torch.empty_like(now.h), torch.empty_like(now.h)
    approaches, bounds = now.h.new_empty(len(now.h)), now.h.new_empty(len(now.h))
    converged = torch.zeros(len(now.h), dtype=torch.bool, device=now.h.device)
    for steps in range(max_steps + 1):
        p, displacement = now.p, body.displacement(now.p)
        # Masks are 1 or 0 in the precision of the heights: torch takes ten times as long over Booleans.
        contact = p.sign()
        gap = displacement - now.h
        approach = _dot(gap, contact) / _sum(contact)
        gap -= approach
        if stop.bound:
            off = _bound(p, gap, displacement) / stop.bound
        else:
            allowed = stop.residual * _mean(displacement)
            off = _residual(p, contact, gap) / allowed
        cut_short = steps / (max_steps + 1) if max_steps < MAX_STEPS else 0.0
        this_stage().residual_at(off.max(), cut_short)
        finished = off <= 1.0
        if p.dtype == torch.float64 and stop.residual:
            finished |= off * allowed <= now.rounding
        if p.dtype == torch.float32 and bool((stalled := _stalled(now, off)).any()):
            finished |= stalled & (_bound(p, gap, displacement) <= ROUNDED_BOUND)
            if stop.residual:
                finished |= stalled & (off * allowed <= now.rounding)
        leaving = torch.ones_like(finished) if steps == max_steps else finished
        if bool(leaving.any()):
            left, where = leaving.view(-1), now.number[leaving.view(-1)]
            pressure[where], gaps[where] = p[left], gap[left]
            approaches[where] = (approach - now.top)[leaving]
            bounds[where] = _bound(p, gap, displacement)[leaving].clamp_min(0.0)
            converged[where] = finished[leaving]
            if bool(left.all()):
                break
            now, gap, contact = _Items(*(field[~left] for field in now)), gap[~left], contact[~left]
        now = _stepped(body, now, gap, contact, mean_pressure)

    batch = shape[:-2]
    results = (field.view(batch) for field in (approaches, converged, bounds))
    return ContactState(pressure.view(shape), gaps.view(shape), next(results), steps, *results)


def _stepped(body: Compliance, now: "_Items", gap: Tensor, contact: Tensor, mean_pressure: float) -> "_Items":
    """The items after one more step; with their gaps (items, n, n) mm, and 1 where they touch, else 0."""
    tiny = torch.finfo(gap.dtype).tiny
    # The step changes these pixels: those in contact, and those where the skin would pass through the relief.
    working = torch.maximum(contact, torch.lt(gap, 0.0, out=torch.empty_like(gap)))
    residual = _without_mean(gap, working)
    z = body.precondition(residual)
    # The set changes in nearly every step. Directions that stay conjugate to the last one as far as the sets
    # have pixels in common take half of the steps of directions that start anew. The residual has no mean on
    # the set, so that sums of its products need no mask.
    rho = _dot(residual, z)
    share = rho / now.rho.clamp_min(tiny)
    downhill = rho + share * _dot(residual, now.direction)
    kept = downhill > 0.0
    direction = _without_mean(z.add_(now.direction.mul_(torch.where(kept, share, 0.0))), working)
    length = torch.where(kept, downhill, rho) / (2.0 * body.energy(direction)).clamp_min(tiny)
    p = torch.addcmul(now.p, direction, length, value=-1.0).clamp_min_(0.0)
    p *= mean_pressure / _mean(p)
    return now._replace(p=p, direction=direction, rho=rho)


def _stalled(now: "_Items", off: Tensor) -> Tensor:
    """Whether the distances (items, 1, 1) from the rule that ends the solution no longer fall.

    Distances are in units of the allowed number; the items' memory of earlier steps is brought up to date.
    """
    fallen = off < STALLED_FALL * now.least
    now.stalled.add_(1.0).mul_(~fallen)
    now.least.copy_(torch.where(fallen, off, now.least))
    return now.stalled >= STALLED_STEPS


class _Items(NamedTuple):
    """Those items of a batch that have not converged, and where their solution stands.

    Attributes:
        number: (items,) in the batch.
        h: (items, n, n) mm below the top of the relief.
        top: (items, 1, 1) mm.
        rounding: residual that counts as none, mm.
        p: pressures.
        direction: last direction of the pressures.
        rho: inner product of the last residual and the preconditioned one.
        least: distance from the rule that ends the solution, over the allowed number, when it last fell.
        stalled: number of steps since then.
    """

    number: Tensor
    h: Tensor
    top: Tensor
    rounding: Tensor
    p: Tensor
    direction: Tensor
    rho: Tensor
    least: Tensor
    stalled: Tensor


def _start(body: Compliance, heights: Tensor, mean_pressure: float, start: Tensor | None) -> _Items:
    """All items (batch, n, n) mm of a batch, under the pressures to start from."""
    # Heights count from the top of each relief: an offset common to all samples would cost digits of the gap.
    top = heights.amax((-2, -1), keepdim=True)
    h, eps = heights - top, torch.finfo(heights.dtype).eps
    p = bonded_pressure(body, h, mean_pressure) if start is None else start.detach().reshape(h.shape)
    p = p.clamp_min(0.0)
    scale = mean_pressure / _mean(p)
    # Pressures that carry the load stay as they are: a contact that goes on from its own end is the same.
    p = torch.where((scale - 1.0).abs() <= SAME_LOAD * eps, p, p * scale)
    rounding = ROUNDING * eps * h.abs().amax((-2, -1), keepdim=True)
    ones = torch.ones_like(top)
    number = torch.arange(len(h), device=h.device)
    return _Items(number, h, top, rounding, p, torch.zeros_like(p), ones, math.inf * ones, 0.0 * ones)


def _residual(p: Tensor, contact: Tensor, gap: Tensor) -> Tensor:
    """(batch, 1, 1) largest residual of gap and complementarity, mm, by item.

    Args:
        p: (batch, n, n) pressures.
        contact: 1 where there is pressure, else 0.
        gap: of mean zero in contact, mm.
    """
    inside = (_dot(gap.square(), p) / _sum(p)).sqrt()
    outside = -torch.add(gap, contact, alpha=FAR_MM).amin((-2, -1), keepdim=True)
    return torch.maximum(inside, outside)


def _bound(p: Tensor, gap: Tensor, displacement: Tensor) -> Tensor:
    """(batch, 1, 1) bound of the energy's error over the elastic energy, as in `ContactState`.

    Args:
        p: (batch, n, n) pressures of the prescribed force.
        gap: C p - h up to a constant, mm.
        displacement: C p, mm.
    """
    released = _dot(p, gap) - _sum(p) * gap.amin((-2, -1), keepdim=True)
    return released / (0.5 * _dot(p, displacement))


Solver = Callable[[Compliance, Tensor, float, Tensor | None], ContactState]
"""Solver of contact, of body, heights (mm), mean pressure and pressures to start from (units of E)."""

SINGLE_FIRST = Stop(bound=LARGEST_BOUND)
"""Rule that ends the steps in single precision before those in double precision, whatever ends the latter."""
MAX_SINGLE_STEPS = 100
"""Most of these steps."""


@dataclass(frozen=True, eq=False)
class SingleFirst:
    """Solver that steps in single precision as far as that leads, and goes on in that of the heights.

    The result meets the same rule as that of `solve_contact`, in half of the time: mostly double precision
    finds that no step is left.

    Attributes:
        single: the skin in single precision.
        stop: rule that ends the solution; None for that of the heights' precision.
    """

    single: Compliance
    stop: Stop | None = None

    def __call__(
        self, body: Compliance, heights: Tensor, mean_pressure: float, start: Tensor | None
    ) -> ContactState:
        """The contact; arguments and errors as of `solve_contact`."""
        relief = heights.detach()
        relief = (relief - relief.amax((-2, -1), keepdim=True)).float()
        begin = None if start is None else start.float()
        near = approach_contact(self.single, relief, mean_pressure, begin, MAX_SINGLE_STEPS, SINGLE_FIRST)
        return solve_contact(body, heights, mean_pressure, near.pressure.to(heights.dtype), self.stop)


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
        tolerance: float | None,
    ) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        state = solve(body, heights, mean_pressure, start)
        ctx.body, ctx.tolerance = body, tolerance
        ctx.save_for_backward(state.pressure > 0.0)
        ctx.mark_non_differentiable(state.bound)
        return state.pressure, state.gap, state.approach, state.bound

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None, None, None, None, None]:
        to_pressure, to_gap, to_approach, _ = gradients
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
) -> tuple[Tensor, Tensor, Tensor, Tensor]:
    """Pressure (units of E), gap and approach (mm), differentiable by the heights, and their error's bound.

    The gradient is that of a fixed contact set, which is exact wherever no pixel is just touching. The
    gradient costs one conjugate-gradient solve restricted to the pixels in contact; the solver's own steps
    are not differentiated.

    Args:
        body: the skin.
        heights: (..., n, n) mm.
        mean_pressure: in units of Young's modulus.
        start: (..., n, n) pressures to start from; None: those of `bonded_pressure` that push.
        solve: solver of the contact.
        gradient_tolerance: relative residual of the adjoint system; None for that of the precision.

    Returns:
        (..., n, n) pressure, (..., n, n) gap, (...) approach, and (...) bound as in `ContactState`.

    Raises:
        ContactError: the contact, or in the backward pass its adjoint, did not converge.
    """
    felt: tuple[Tensor, Tensor, Tensor, Tensor] = _Press.apply(
        heights, body, mean_pressure, start, solve, gradient_tolerance
    )
    return felt


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
        z = body.precondition(residual)
        rho_before, rho = rho, _dot(residual, z)
        direction = _without_mean(z + rho / rho_before.clamp_min(tiny) * direction, mask)
        image = body.displacement(direction)
        length = unfinished * rho / _dot(direction, image).clamp_min(tiny)
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


def _without_mean(field: Tensor, mask: Tensor) -> Tensor:
    """A field on the pixels of a mask (1 or 0), less its mean there; 0 elsewhere.

    The force cannot change, so directions have no sum; this orthogonal projection of residuals and directions
    keeps the preconditioner symmetric and positive definite.
    """
    masked = field * mask
    return masked.addcmul_(mask, _sum(masked) / _sum(mask), value=-1.0)


def _dot(one: Tensor, other: Tensor) -> Tensor:
    """(..., 1, 1) sum of the products of two fields (..., n, n)."""
    if len(one) == 1 and one.dim() == 3:
        return torch.dot(one.reshape(-1), other.reshape(-1)).view(1, 1, 1)
    return _sum(one * other)


def _sum(field: Tensor) -> Tensor:
    return field.sum((-2, -1), keepdim=True)


def _mean(field: Tensor) -> Tensor:
    return field.mean((-2, -1), keepdim=True)
