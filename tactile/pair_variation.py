"""Roughness V: mean absolute pairwise strain difference between receptors (paper equation 2)."""

import cmath
import math
from collections.abc import Callable
from functools import lru_cache
from types import EllipsisType
from typing import Any, Literal

import torch
from torch import Tensor

from relief.ground.errors import InputError
from relief.ground.progress import stage
from tactile.touch import Touch, map_and_size

PAIR_DISTANCE_MM = 2.2
"""Mean distance d of a pair of receptors, mm (paper section 4.2)."""

PAIR_SPREAD_MM = 0.8
"""Half-width r of the range of distances, mm (paper section 4.2)."""

WIDEST_MM = PAIR_DISTANCE_MM + PAIR_SPREAD_MM
"""Largest distance of a pair of receptors, mm."""

QUADRATURE_LENGTHS, QUADRATURE_ANGLES = 4, 16
"""Numbers of lengths and angles of the polar quadrature: V within 0.65 % of the full sum, cosine of the
gradients 0.9986, a 28th of the work."""

FINEST_PER_MM = 12.8
"""Most samples a mm where every pixel offset is summed: 128 over 10 mm, with 1816 offsets."""

FINE_LENGTHS, FINE_ANGLES = 24, 19
"""Numbers of lengths, and of angles in each eighth of a turn, on finer grids: 1824 offsets in place of as
many as 115,972. V differs from the sum over all of these by less than 0.08 %, from 192 samples over 10 mm."""

STRIDE_MM = 0.32
"""Largest distance between the positions whose pairs the thinned sum takes, mm; each offset takes other
positions in turn. Strain at the depth of receptors is smooth over such lengths: on 128 samples over 10 mm,
where every fourth sample along each axis is taken, V of twelve reliefs is within 0.017 % of the full sum, its
gradient within 0.4 % in the median and 1.1 % at most."""

MOST_BY_PAIRS = 160**2
"""Most samples of a single field whose thinned sum is taken pair by pair: indices of the pairs take 31 MiB
at 128 x 128 samples over 10 mm, and grow as the samples do."""

NO_PAIRS = "heights: under the finger no two receptors that count are 1.4 to 3 mm apart"
"""Error of a contact location where a round finger has too little of a plate below."""

Quadrature = Literal["full", "thinned", "polar"]
"""Sum over every pixel offset, bounded in number; over these at fewer positions; over few offsets."""

Offsets = tuple[tuple[int, int, float], ...]
"""Samples down and right, and weight, of every offset."""


def roughness(
    strain: Touch | Tensor,
    size_mm: float | None = None,
    quadrature: Quadrature = "full",
    receptors: Tensor | None = None,
) -> Tensor:
    """V = mean over positions p and offsets o of |s(p) - s(p + o)| (paper equation 2).

    Offsets have length in [d - r, d + r] = [1.4, 3.0] mm and direction in [0, pi), uniform in (length,
    angle), that is weight 1/length per unit of area. Pairs with an end outside the patch are left out. (The
    paper's printed formula has cos twice, and a prefactor that does not normalise; the mean agrees with the
    paper's sampler of 8000 pairs.)

    Args:
        strain: of a touch, or (..., n, n), dimensionless.
        size_mm: side of the patch; None: the touch's own, or 10.
        quadrature: "full", for every number reported, sums over every pixel offset, and over 1824 of them
            on grids of more than `FINEST_PER_MM`. "thinned", for descents, takes the same offsets, each at
            positions up to `STRIDE_MM` apart. "polar" sums over 4 lengths x 16 angles.
        receptors: (n, n) or as the strain, 1 at samples whose receptors count, else 0: pairs count of which
            both ends do. None: those of the touch, which of a flat finger are all.

    Returns:
        (...) roughness, with gradient.

    Raises:
        InputError: the patch is too small for the widest pairs, or too coarse for any; no pair counts; an
            unknown quadrature.
    """
    if receptors is None and isinstance(strain, Touch):
        receptors = strain.receptors
    strain, size_mm = map_and_size(strain, "strain", size_mm)
    n = strain.shape[-1]
    offsets = _offsets(n, size_mm, quadrature)
    stride = max(1, int(STRIDE_MM * n / size_mm)) if quadrature == "thinned" else 1
    if receptors is not None:
        strain, receptors = _cropped(strain, receptors)
    elif (
        strain.numel() == n * n <= MOST_BY_PAIRS
        and stride > 1
        and not strain.requires_grad
        and strain.device.type == "cpu"
    ):
        return _of_pairs(strain, *_pairs(n, size_mm, stride))
    with stage("measuring roughness", len(offsets)) as advance:
        result: Tensor = _PairVariation.apply(strain, receptors, offsets, stride, advance)
        return result


def _cropped(strain: Tensor, receptors: Tensor) -> tuple[Tensor, Tensor]:
    """Strain and receptors (..., n, n) on the rows and columns where any of the receptors count."""
    counted = receptors.reshape(-1, *receptors.shape[-2:]).amax(0) > 0.0
    if not bool(counted.any()):
        raise InputError(NO_PAIRS)
    rows, columns = (
        slice(int(there[0]), int(there[-1]) + 1)
        for there in (counted.any(axis).nonzero().view(-1) for axis in (1, 0))
    )
    return strain[..., rows, columns], receptors[..., rows, columns].to(strain.dtype)


class _PairVariation(torch.autograd.Function):
    """Value and sign-gradient in one pass over the offsets."""

    @staticmethod
    def forward(
        ctx: Any,
        strain: Tensor,
        receptors: Tensor | None,
        offsets: Offsets,
        stride: int,
        advance: Callable[[], object],
    ) -> Tensor:
        s = strain.detach()
        combs = _combs(s, stride)
        counted = None if receptors is None else _combs(receptors, stride)
        wanted = ctx.needs_input_grad[0]
        gradients = [torch.zeros_like(comb) for comb in combs] if wanted else []
        value = s.new_zeros(s.shape[:-2])
        pairs: float | Tensor = 0.0
        # Arrays that serve every offset: new ones take a third of the time on large grids.
        memory, other_memory = torch.empty_like(combs[0]).view(-1), torch.empty_like(combs[0]).view(-1)
        for number, (down, right, weight) in enumerate(offsets):
            row, column = _first_ends(number, stride)
            (below, other_row), (beside, other_column) = (
                divmod(row + down, stride),
                divmod(column + right, stride),
            )
            one, other = row * stride + column, other_row * stride + other_column
            here, there = _overlap(combs[one].shape, combs[other].shape, below, beside)
            first, second = combs[one][here], combs[other][there]
            difference = torch.sub(first, second, out=memory[: first.numel()].view(first.shape))
            if counted is None:
                pairs += weight * difference.shape[-2] * difference.shape[-1]
            else:
                both = counted[one][here] * counted[other][there]
                difference.mul_(both)
                pairs = pairs + weight * both.sum((-2, -1))
            if wanted:
                sign = torch.sign(difference, out=other_memory[: first.numel()].view(first.shape))
                gradients[one][here].add_(sign, alpha=weight)
                gradients[other][there].sub_(sign, alpha=weight)
            else:
                value.add_(difference.abs_().sum((-2, -1)), alpha=weight)
            advance()
        if isinstance(pairs, Tensor) and not bool((pairs > 0.0).all()):
            raise InputError(NO_PAIRS)
        if wanted:
            each = pairs[..., None, None] if isinstance(pairs, Tensor) else pairs
            gradient = _woven(gradients, s, stride) / each
            ctx.save_for_backward(gradient)
            # V is homogeneous of degree one: its value is the strain times its gradient.
            return (gradient * s).sum((-2, -1))
        return value / pairs

    @staticmethod
    def backward(ctx: Any, *gradients: Tensor) -> tuple[Tensor, None, None, None, None]:
        (gradient,) = ctx.saved_tensors
        return gradient * gradients[0][..., None, None], None, None, None, None


def _of_pairs(strain: Tensor, first: Tensor, second: Tensor, weight: Tensor) -> Tensor:
    """The thinned sum of one field (..., n, n) by its pairs, without gradient.

    The sum offset by offset takes as many operations for one field as for a batch: 0.16 s in place of 0.04 s
    at 128 x 128 samples.
    """
    flat = strain.reshape(-1)
    differences = torch.sub(flat[first], flat[second]).abs_().to(weight.dtype)
    value = torch.dot(differences, weight) / weight.sum()
    return value.to(strain.dtype).reshape(strain.shape[:-2])


@lru_cache(maxsize=2)
def _pairs(n: int, size_mm: float, stride: int) -> tuple[Tensor, Tensor, Tensor]:
    """Pairs of the thinned sum: index of each end in a flat field, and the weights; (p,) each."""
    ends: list[tuple[Tensor, Tensor]] = []
    weights = []
    lines = torch.arange(n)
    for number, (down, right, weight) in enumerate(full_offsets(n, size_mm)):
        row, column = _first_ends(number, stride)
        rows, columns = lines[row : n - down : stride], lines[column::stride]
        columns = columns[(columns + right >= 0) & (columns + right < n)]
        first = (rows[:, None] * n + columns).reshape(-1)
        ends.append((first, first + down * n + right))
        weights.append(torch.full(first.shape, weight, dtype=torch.float64))
    first, second = (torch.cat(each) for each in zip(*ends, strict=True))
    return first, second, torch.cat(weights)


def _first_ends(number: int, stride: int) -> tuple[int, int]:
    """Row and column of the comb on which the first ends of an offset lie.

    Every comb in turn; not each of a group of alike offsets the same ones.
    """
    return divmod((number + number // stride**2) % stride**2, stride)


def _combs(field: Tensor, stride: int) -> list[Tensor]:
    """The samples of a field (..., n, n) at every `stride`-th row and column, from each of the first on."""
    parts = [field[..., row::stride, column::stride] for row in range(stride) for column in range(stride)]
    return [part.contiguous() for part in parts]


def _woven(combs: list[Tensor], like: Tensor, stride: int) -> Tensor:
    """The field of its combs, the inverse of `_combs`; of the same shape as `like`."""
    field = torch.empty_like(like)
    for number, comb in enumerate(combs):
        row, column = divmod(number, stride)
        field[..., row::stride, column::stride] = comb
    return field


def _overlap(
    one: torch.Size, other: torch.Size, down: int, right: int
) -> tuple[tuple[EllipsisType, slice, slice], tuple[EllipsisType, slice, slice]]:
    """Slices of a field and of another, moved up and to the left, where the two overlap."""
    rows = max(0, min(one[-2], other[-2] - down))
    first, last = max(0, -right), min(one[-1], other[-1] - right)
    last = max(first, last)
    return (
        (..., slice(0, rows), slice(first, last)),
        (..., slice(down, down + rows), slice(first + right, last + right)),
    )


def every_offset(n: int, size_mm: float) -> Offsets:
    """Every pixel offset of the half annulus."""
    pitch = size_mm / n
    reach = int((PAIR_DISTANCE_MM + PAIR_SPREAD_MM) / pitch)
    offsets = []
    for down in range(reach + 1):
        for right in range(-reach, reach + 1):
            length = pitch * math.hypot(down, right)
            in_half_plane = down > 0 or right > 0
            in_range = abs(length - PAIR_DISTANCE_MM) <= PAIR_SPREAD_MM
            if in_half_plane and in_range and max(down, abs(right)) < n:
                offsets.append((down, right, 1.0 / length))
    return tuple(offsets)


def polar_offsets(n: int, size_mm: float, lengths: int, angles: int) -> Offsets:
    """Midpoint rule in length and angle, at the nearest pixels."""
    pitch = size_mm / n
    offsets = []
    for i in range(lengths):
        length = PAIR_DISTANCE_MM + PAIR_SPREAD_MM * ((2 * i + 1) / lengths - 1.0)
        for j in range(angles):
            angle = math.pi * (j + 0.5) / angles
            down, right = round(length * math.sin(angle) / pitch), round(length * math.cos(angle) / pitch)
            if 0 < max(down, abs(right)) < n:
                offsets.append((down, right, 1.0))
    return tuple(offsets)


@lru_cache(maxsize=16)
def full_offsets(n: int, size_mm: float) -> Offsets:
    """Every pixel offset of the half annulus, or about as many as `FINEST_PER_MM` have on finer grids."""
    return every_offset(n, size_mm) if n / size_mm <= FINEST_PER_MM else fine_offsets(n, size_mm)


def fine_offsets(n: int, size_mm: float) -> Offsets:
    """Midpoint rule in length and angle, at pixels: the same for the eight symmetries of the square.

    Each offset passes on what its rounding left over, so that rounding errors cancel along the rings.
    """
    offsets = []
    left = 0j
    for i in range(FINE_LENGTHS):
        length = PAIR_DISTANCE_MM + PAIR_SPREAD_MM * ((2 * i + 1) / FINE_LENGTHS - 1.0)
        # To and fro, because the next offset is to be near.
        for j in range(FINE_ANGLES)[:: -1 if i % 2 else 1]:
            exact = cmath.rect(length * n / size_mm, math.pi / 4.0 * (j + 0.5) / FINE_ANGLES) + left
            long, short = round(exact.real), round(exact.imag)
            left = exact - complex(long, short)
            for down, right in ((short, long), (long, short), (long, -short), (short, -long)):
                if max(down, abs(right)) < n:
                    offsets.append((down, right, 1.0))
    return tuple(offsets)


@lru_cache(maxsize=16)
def _polar(n: int, size_mm: float) -> Offsets:
    return polar_offsets(n, size_mm, QUADRATURE_LENGTHS, QUADRATURE_ANGLES)


def _offsets(n: int, size_mm: float, quadrature: Quadrature) -> Offsets:
    if quadrature not in _OFFSETS:
        raise InputError(f'quadrature: "{quadrature}" is not one of {", ".join(map(repr, _OFFSETS))}')
    check_patch(size_mm)
    offsets = _OFFSETS[quadrature](n, size_mm)
    if not offsets:
        raise InputError(
            f"size_mm: of {size_mm} mm no two samples lie as near as receptors, {WIDEST_MM:g} mm"
        )
    return offsets


def check_patch(size_mm: float) -> None:
    """Raise InputError if a patch of this side is too small for pairs of receptors."""
    if size_mm < WIDEST_MM:
        raise InputError(
            f"size_mm: a patch of {size_mm} mm is smaller than pairs of receptors, {WIDEST_MM:g} mm"
        )


_OFFSETS = {"full": full_offsets, "thinned": full_offsets, "polar": _polar}
