"""Which fingers fit the mechanical measurements: draws of a prior, weighted by their likelihood.

Depths in grooves and under a sphere are solved on a tensor of Chebyshev nodes over radius, thicknesses, the
ratio of the moduli and force over modulus, and interpolated between them in logarithms. Force over modulus is
one axis for every modulus, because displacements depend on nothing else of both.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import qmc

from benchmarks.skin.quarter import groove_depths, sphere_depths, sphere_forces
from benchmarks.skin.sources import (
    FIRST_FORCE_N,
    GROOVE_FORCE_N,
    GROOVES,
    MECHANICAL,
    SPHERE,
    SPHERE_DIAMETERS_MM,
    Mechanical,
)
from relief.ground.arrays import Array
from tactile.skin import Skin

PRIOR: Mapping[str, tuple[float, float]] = {
    "radius_mm": (6.0, 11.0),
    "thickness_mm": (3.0, 5.0),
    "layer_mm": (0.25, 1.5),
    "ratio": (1.0, 60.0),
    "base_mpa": (0.006, 0.12),
}
"""Ranges of the prior, even in the logarithm: radius of the pad, its thickness, thickness of the upper layer,
the layer's modulus over the base's, and the base's modulus."""
NODES = {"radius_mm": 3, "thickness_mm": 3, "layer_mm": 5, "ratio": 6}
"""Chebyshev nodes along each axis of the solved fingers."""
LOADS = 5
"""Nodes of force over modulus for the grooves."""
SPHERE_LOADS = 12
"""Nodes of force over modulus for a sphere, whose curve goes over four decades."""
DIAMETERS = 3
"""Nodes of the sphere's diameter."""
GREATEST_N = 1.0
"""Greatest force on the sphere, N."""
DRAWS_LOG2 = 18
"""Draws of the prior, as a power of two (Sobol)."""
NAMES = tuple(PRIOR)
STIFFENING = (0.0, 0.6)
"""Range of the power of force by which both moduli grow, where that is asked; `base_mpa` is that at 0.1 N."""
STIFFENING_N = 0.1
"""Force at which the moduli of a stiffening finger are those of its draw, N: about that of the sphere."""
GREATEST_BASE, LEAST_BASE = PRIOR["base_mpa"][1], PRIOR["base_mpa"][0]


def finger(values: Mapping[str, float]) -> Skin:
    """The skin of a radius, thicknesses, moduli's ratio and base modulus, at 1 N and the paper's depth."""
    layers = ((values["layer_mm"], values["ratio"] * values["base_mpa"]),) if values["ratio"] != 1.0 else ()
    return Skin(
        young_modulus_mpa=values["base_mpa"],
        force_n=1.0,
        thickness_mm=values["thickness_mm"],
        layers=layers,
        shape="round",
        radius_mm=values["radius_mm"],
    )


@dataclass(frozen=True)
class Axis:
    """Chebyshev nodes over a range in logarithms, with barycentric interpolation between them."""

    low: float
    high: float
    count: int

    @property
    def nodes(self) -> Array:
        """(count) values at the nodes."""
        turn = np.cos(np.pi * (2 * np.arange(self.count) + 1) / (2 * self.count))
        return np.asarray(np.exp(0.5 * (np.log(self.low * self.high) + turn * np.log(self.high / self.low))))

    def weights(self, values: Array) -> Array:
        """(len(values), count): weights of the nodes for each value."""
        nodes = np.log(self.nodes)
        signs = (-1.0) ** np.arange(self.count) * np.sin(
            np.pi * (2 * np.arange(self.count) + 1) / (2 * self.count)
        )
        away = np.log(values)[:, None] - nodes
        away[np.abs(away) < 1e-12] = 1e-12
        weights = signs / away
        return np.asarray(weights / weights.sum(axis=1, keepdims=True))


FINGERS = tuple(Axis(*PRIOR[name], count) for name, count in NODES.items())
GROOVE_LOADS = Axis(GROOVE_FORCE_N / GREATEST_BASE, GROOVE_FORCE_N / LEAST_BASE, LOADS)
SPHERE_RANGE = Axis(FIRST_FORCE_N / GREATEST_BASE, GREATEST_N / LEAST_BASE, SPHERE_LOADS)
SPHERES = Axis(*SPHERE_DIAMETERS_MM, DIAMETERS)


def node_key(values: Sequence[float]) -> str:
    """Name of a solved finger among the results."""
    return " ".join(f"{value:.6g}" for value in values)


def solved(values: Sequence[float]) -> Array:
    """Depths of one finger of unit modulus, mm: grooves (loads, widths), then spheres (diameters, loads)."""
    skin = finger(dict(zip(NAMES, (*values, 1.0), strict=True)))
    # Nodes of an axis fall; loads rise, as each contact starts from the last.
    loads, sphere = (tuple(np.sort(axis.nodes)) for axis in (GROOVE_LOADS, SPHERE_RANGE))
    grooves = groove_depths(skin, GROOVES.at, loads)[::-1]
    spheres = [sphere_depths(skin, diameter, sphere)[::-1] for diameter in SPHERES.nodes]
    return np.concatenate([grooves.ravel(), *spheres])


def node_values() -> list[tuple[float, ...]]:
    """Radius, thickness, layer and ratio of every finger to be solved."""
    return list(itertools.product(*(axis.nodes.tolist() for axis in FINGERS)))


@dataclass(frozen=True)
class Emulator:
    """Depths of any finger of the prior, interpolated between those that were solved.

    Attributes:
        grooves: (radii, thicknesses, layers, ratios, loads, widths) logarithms of mm.
        sphere: (radii, thicknesses, layers, ratios, diameters, loads) logarithms of mm.
    """

    grooves: Array
    sphere: Array

    @classmethod
    def of(cls, fingers: Mapping[str, Array]) -> Emulator:
        """The emulator of solved fingers by their names (`node_key`); depths as `solved` gives them."""
        counts = tuple(axis.count for axis in FINGERS)
        every = np.log([fingers[node_key(values)] for values in node_values()])
        grooves, sphere = np.split(every, [LOADS * len(GROOVES.at)], axis=1)
        return cls(
            grooves.reshape(*counts, LOADS, len(GROOVES.at)), sphere.reshape(*counts, DIAMETERS, SPHERE_LOADS)
        )

    def groove_depths(self, draws: Mapping[str, Array]) -> Array:
        """(draws, widths) mm at `GROOVE_FORCE_N`."""
        field = _contracted(self.grooves, draws)
        weights = GROOVE_LOADS.weights(GROOVE_FORCE_N / base_at(draws, GROOVE_FORCE_N))
        return np.asarray(np.exp(np.einsum("il,ilw->iw", weights, field)))

    def sphere_forces(self, draws: Mapping[str, Array], samples: int = 48) -> Array:
        """(draws, depths) N on a sphere of `draws["diameter_mm"]`, at depths that count from 0.01 N."""
        curve = np.einsum(
            "id,idl->il", SPHERES.weights(draws["diameter_mm"]), _contracted(self.sphere, draws)
        )
        forces = np.geomspace(FIRST_FORCE_N, GREATEST_N, samples)
        depths = np.empty((curve.shape[0], samples))
        for column, force in enumerate(forces):
            weights = SPHERE_RANGE.weights(force / base_at(draws, float(force)))
            depths[:, column] = np.exp(np.einsum("il,il->i", weights, curve))
        depths -= depths[:, :1]
        found = np.empty((curve.shape[0], len(SPHERE.at)))
        for row, depth in enumerate(depths):
            # Linear in the square root of depth, in which the logarithm of the force is smooth.
            found[row] = np.interp(np.sqrt(SPHERE.at), np.sqrt(np.maximum(depth, 0.0)), np.log(forces))
        return np.asarray(np.exp(found))


def base_at(draws: Mapping[str, Array], force_n: float) -> Array:
    """(draws) modulus of the base at a force, MPa: that of 0.1 N, or stiffer by a power of the force."""
    base = draws["base_mpa"]
    return base * (force_n / STIFFENING_N) ** draws["stiffening"] if "stiffening" in draws else base


def _contracted(field: Array, draws: Mapping[str, Array]) -> Array:
    """(draws, ...): a field of nodes between them."""
    weights = [axis.weights(draws[name]) for axis, name in zip(FINGERS, NODES, strict=True)]
    return np.asarray(np.einsum("ia,ib,ic,id,abcd...->i...", *weights, field, optimize=_ORDER))


_ORDER = ["einsum_path", (0, 4), (0, 3), (0, 2), (0, 1)]
"""One axis of a field after the other."""


def residuals(measured: Mechanical, model: Array) -> Array:
    """Logarithms of model over measured (..., values)."""
    return np.asarray(np.log(model / np.array(measured.values)))


def log_likelihood(measured: Mechanical, model: Array) -> Array:
    """(draws) logarithm of the likelihood of a source, without its constant, by its noise."""
    count = len(measured.values)
    covariance = measured.common**2 * np.ones((count, count)) + measured.own**2 * np.eye(count)
    apart = residuals(measured, model)
    return np.asarray(-0.5 * np.einsum("ia,ab,ib->i", apart, np.linalg.inv(covariance), apart))


@dataclass(frozen=True)
class Posterior:
    """Draws of the prior with what each gives, and the likelihood of each source.

    Attributes:
        draws: by name (draws): those of `PRIOR` and the sphere's diameter.
        models: by source (draws, values).
        likelihood: by source (draws), logarithms.
    """

    draws: dict[str, Array]
    models: dict[str, Array]
    likelihood: dict[str, Array]

    @classmethod
    def of(
        cls,
        emulator: Emulator,
        stiffening: bool = False,
        draws_log2: int = DRAWS_LOG2,
        seed: int = 1,
        chunk: int = 8192,
    ) -> Posterior:
        """The posterior by an emulator, of fingers whose moduli grow with force if `stiffening`."""
        ranges = [*PRIOR.values(), SPHERE_DIAMETERS_MM, STIFFENING]
        unit = qmc.Sobol(len(ranges), seed=seed).random_base2(draws_log2)
        draws = {
            name: low * (high / low) ** unit[:, column]
            for column, (name, (low, high)) in enumerate(PRIOR.items())
        }
        for name, (low, high), column in (
            ("diameter_mm", SPHERE_DIAMETERS_MM, -2),
            *((("stiffening", STIFFENING, -1),) if stiffening else ()),
        ):
            draws[name] = low + (high - low) * unit[:, column]
        parts: dict[str, list[Array]] = {GROOVES.name: [], SPHERE.name: []}
        for first in range(0, unit.shape[0], chunk):
            some = {name: values[first : first + chunk] for name, values in draws.items()}
            parts[GROOVES.name].append(emulator.groove_depths(some))
            parts[SPHERE.name].append(emulator.sphere_forces(some))
        models = {name: np.concatenate(part) for name, part in parts.items()}
        likelihood = {source.name: log_likelihood(source, models[source.name]) for source in MECHANICAL}
        return cls(draws, models, likelihood)

    def weights(self, sources: Sequence[str]) -> Array:
        """(draws) weights that sum to one, by the likelihood of some of the sources."""
        total = sum((self.likelihood[name] for name in sources), np.zeros(len(self.draws["ratio"])))
        weights = np.exp(total - total.max())
        return np.asarray(weights / weights.sum())

    def evidence(self, sources: Sequence[str]) -> float:
        """Logarithm of the mean likelihood over the prior."""
        total = sum((self.likelihood[name] for name in sources), np.zeros(len(self.draws["ratio"])))
        return float(np.log(np.exp(total - total.max()).mean()) + total.max())

    def values(self, number: int) -> dict[str, float]:
        """A draw, by name."""
        return {name: float(values[number]) for name, values in self.draws.items()}

    def sample(self, sources: Sequence[str], count: int, seed: int = 7) -> list[dict[str, float]]:
        """Draws of equal weight."""
        chosen = np.random.default_rng(seed).choice(
            len(self.draws["ratio"]), count, replace=False, p=self.weights(sources)
        )
        return [self.values(int(number)) for number in chosen]


def quantile(values: Array, weights: Array, shares: Sequence[float]) -> list[float]:
    """Weighted quantiles."""
    order = np.argsort(values)
    total = np.cumsum(weights[order])
    return [float(values[order][min(int(np.searchsorted(total, share)), len(order) - 1)]) for share in shares]


def effective(weights: Array) -> float:
    """Number of equal draws that are as good as weighted ones."""
    return float(1.0 / np.square(weights).sum())


def worst(emulator: Emulator, draws: Sequence[Mapping[str, float]]) -> dict[str, float]:
    """Error of the emulator against solved fingers: rms and greatest of the logarithms, by source."""
    errors = [compared(emulator, values) for values in draws]
    found = {}
    for source in MECHANICAL:
        error = np.concatenate([one[source.name] for one in errors])
        found[f"{source.name}, rms"] = math.sqrt(float(np.square(error).mean()))
        found[f"{source.name}, greatest"] = float(np.abs(error).max())
    return found


def direct(skin: Skin, diameter_mm: float) -> dict[str, Array]:
    """What a finger gives, solved and not interpolated: depths in grooves, forces on the sphere."""
    forces = tuple(np.geomspace(FIRST_FORCE_N, GREATEST_N, 14))
    depths = sphere_depths(skin, diameter_mm, forces)
    return {
        GROOVES.name: groove_depths(skin, GROOVES.at, (GROOVE_FORCE_N,))[0],
        SPHERE.name: sphere_forces(depths, np.array(forces), SPHERE.at, FIRST_FORCE_N),
    }


def compared(emulator: Emulator, values: Mapping[str, float]) -> dict[str, Array]:
    """Logarithms of what the emulator gives over what is solved, by source."""
    draws = {name: np.array([value]) for name, value in values.items()}
    exact = direct(finger(values), values["diameter_mm"])
    return {
        GROOVES.name: np.log(emulator.groove_depths(draws)[0] / exact[GROOVES.name]),
        SPHERE.name: np.log(emulator.sphere_forces(draws)[0] / exact[SPHERE.name]),
    }
