"""Elastic half-spaces that `tactile.contact` can press: unbounded and periodic. Unit Young's modulus."""

from dataclasses import dataclass
from functools import lru_cache

import torch
from torch import Tensor

from tactile.contact import Compliance


@dataclass(frozen=True)
class HalfSpace(Compliance):
    """A half-space loaded on an n x n patch only; pressures outside the patch are zero.

    Attributes:
        samples: n.
        size_mm: side of the patch.
        poisson_ratio: nu.
    """

    samples: int
    size_mm: float
    poisson_ratio: float

    def displacement(self, pressure: Tensor) -> Tensor:
        """Normal displacement (mm) under pressures (..., n, n) in units of E, constant over each pixel.

        Love, Phil. Trans. R. Soc. A 228 (1929); Johnson, Contact Mechanics, equation 3.25. The convolution
        is made aperiodic by zeros (Hockney's method).
        """
        n = self.samples
        pitch = self.size_mm / n
        distance = torch.fft.fftfreq(2 * n, 1.0 / (2 * n), dtype=pressure.dtype) * pitch
        x, y = distance[:, None], distance[None, :]
        half = pitch / 2.0
        influence = (
            (1.0 - self.poisson_ratio**2)
            / torch.pi
            * sum(
                sign_x * sign_y * _corner(x + sign_x * half, y + sign_y * half)
                for sign_x in (-1.0, 1.0)
                for sign_y in (-1.0, 1.0)
            )
        )
        spectrum = torch.fft.rfft2(influence) * torch.fft.rfft2(pressure, s=(2 * n, 2 * n))
        return torch.fft.irfft2(spectrum, s=(2 * n, 2 * n))[..., :n, :n]

    def precondition(self, residual: Tensor) -> Tensor:
        """The periodic half-space's inverse: near enough to the unbounded one."""
        return PeriodicHalfSpace(self.samples, self.size_mm, self.poisson_ratio).precondition(residual)


@dataclass(frozen=True)
class PeriodicHalfSpace(Compliance):
    """A half-space whose load repeats with the patch.

    The mean displacement of a periodically loaded half-space is infinite; here the mean mode has the
    compliance of the longest wave, a constant that shifts the approach and nothing else.
    """

    samples: int
    size_mm: float
    poisson_ratio: float

    def displacement(self, pressure: Tensor) -> Tensor:
        """Normal displacement (mm): 2 (1 - nu²) / (E k) per wavenumber k (Johnson, 13.2)."""
        return self._filtered(pressure, self._symbols(pressure.dtype)[0])

    def precondition(self, residual: Tensor) -> Tensor:
        return self._filtered(residual, self._symbols(residual.dtype)[1])

    def energy(self, pressure: Tensor) -> Tensor:
        """By Parseval's theorem."""
        spectrum = torch.fft.rfft2(pressure)
        energy = torch.linalg.vecdot(
            (spectrum * self._symbols(pressure.dtype)[2]).flatten(-2), spectrum.flatten(-2)
        )
        return energy.real[..., None, None]

    def _symbols(self, dtype: torch.dtype) -> tuple[Tensor, Tensor, Tensor]:
        return _symbols(self.samples, self.size_mm, self.poisson_ratio, dtype)

    def _filtered(self, field: Tensor, symbol: Tensor) -> Tensor:
        return torch.fft.irfft2(torch.fft.rfft2(field).mul_(symbol), s=(self.samples, self.samples))


@lru_cache(maxsize=8)
def _symbols(
    n: int, size_mm: float, poisson_ratio: float, dtype: torch.dtype
) -> tuple[Tensor, Tensor, Tensor]:
    """Compliance (n, n // 2 + 1) in mm of the waves of a real Fourier transform, its inverse, and the energy.

    Of the half spectrum, columns count twice in the energy but for the first and, if n is even, the last.
    """
    longest = 2.0 * torch.pi / size_mm
    rows = torch.fft.fftfreq(n, 1.0 / n, dtype=dtype) * longest
    columns = torch.fft.rfftfreq(n, 1.0 / n, dtype=dtype) * longest
    k = torch.hypot(rows[:, None], columns[None, :]).clamp_min(longest)
    symbol = 2.0 * (1.0 - poisson_ratio**2) / k
    counts = torch.full((n // 2 + 1,), 2.0, dtype=dtype)
    counts[0] = 1.0
    if n % 2 == 0:
        counts[-1] = 1.0
    return symbol, 1.0 / symbol, 0.5 * symbol * counts / n**2


def _corner(x: Tensor, y: Tensor) -> Tensor:
    """Integral of 1/r over the rectangle between the origin and (x, y); x and y not zero."""
    return x * torch.asinh(y / x.abs()) + y * torch.asinh(x / y.abs())
