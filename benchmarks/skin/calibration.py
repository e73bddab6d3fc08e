"""The finger that fits mechanical measurements: posterior, one source left out at a time, named fingers."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from benchmarks.skin.posterior import (
    DRAWS_LOG2,
    PRIOR,
    Emulator,
    Posterior,
    base_at,
    direct,
    effective,
    finger,
    node_key,
    node_values,
    quantile,
    residuals,
    solved,
    worst,
)
from benchmarks.skin.quarter import flat_contact, groove_depths, sphere_depths, sphere_forces
from benchmarks.skin.sources import FIRST_FORCE_N, GROOVE_FORCE_N, GROOVES, MECHANICAL, SPHERE
from relief.ground.limits import PATCH_SIDE_MM
from relief.ground.progress import say
from tactile.skin import Skin

SHARES = (0.025, 0.16, 0.5, 0.84, 0.975)
"""Quantiles that are reported."""
MEASURED = {"radius_mm": 9.0, "thickness_mm": 4.0, "layer_mm": 0.6, "layer_mpa": 0.13, "base_mpa": 0.025}
"""The finger `measured`: the posterior's middle in round numbers."""
SPHERE_MM = 4.0
"""Diameter of the sphere where one is to be named, the middle of its range."""
MANY = 24
"""Draws of the posterior by which the emulator is checked."""
CLOUD = 150
"""Draws of each posterior in the picture."""
KEPT = 30
"""Fingers after which what was solved is kept."""
SETS = {"both": ("grooves", "sphere"), "grooves": ("grooves",), "sphere": ("sphere",)}
"""Sources that fit, by name."""


def solved_fingers(depths: dict[str, str], keep: Callable[[], object]) -> Emulator:
    """The emulator by fingers that are solved where `depths` has none; `keep` is called now and then.

    Args:
        depths: by name of a finger (`node_key`), in one line each; filled.
        keep: what writes `depths` down.
    """
    every = node_values()
    for number, values in enumerate(every):
        if node_key(values) in depths:
            continue
        depths[node_key(values)] = " ".join(f"{depth:.5g}" for depth in solved(values))
        if number % KEPT == KEPT - 1:
            say(f"finger {number + 1} of {len(every)}")
            keep()
    keep()
    return Emulator.of({name: np.array(line.split(), dtype=float) for name, line in depths.items()})


def named() -> dict[str, dict[str, float]]:
    """Values of the fingers `measured`, `measured-soft` and `measured-stiff`, by name.

    Soft and stiff have both moduli scaled so that the sphere's forces, in the mean of the logarithms, are as
    much less and more than the measured finger's as the least and the greatest person's than the median's.
    """
    middle = MEASURED | {"ratio": MEASURED["layer_mpa"] / MEASURED["base_mpa"], "diameter_mm": SPHERE_MM}
    found = {"measured": middle}
    for name, end in (("measured-soft", 0), ("measured-stiff", 1)):
        people = np.array([person[end] for person in SPHERE.people])
        found[name] = scaled(middle, float(np.log(people / SPHERE.values).mean()))
    return found


def scaled(values: Mapping[str, float], log_force: float) -> dict[str, float]:
    """A finger with both moduli scaled until the sphere's forces differ by a logarithm, to two digits."""
    before = np.log(direct(finger(values), SPHERE_MM)[SPHERE.name])
    scale, step = math.exp(log_force), 0.0
    for _ in range(4):
        other = dict(values) | {"base_mpa": values["base_mpa"] * scale}
        step = log_force - float((np.log(direct(finger(other), SPHERE_MM)[SPHERE.name]) - before).mean())
        scale *= math.exp(step)
    layer, base = (float(f"{values[name] * scale:.2g}") for name in ("layer_mpa", "base_mpa"))
    return dict(values) | {"layer_mpa": layer, "base_mpa": base, "ratio": layer / base}


def calibration(emulator: Emulator) -> dict[str, Any]:
    """Everything that the measurements say of a finger, for the results."""
    posterior = Posterior.of(emulator)
    stiffer = Posterior.of(emulator, stiffening=True)
    both = SETS["both"]
    found: dict[str, Any] = {
        "prior": {name: list(range_) for name, range_ in PRIOR.items()},
        "draws": 2**DRAWS_LOG2,
        "emulator, error of logarithms": worst(emulator, posterior.sample(both, MANY, seed=3)),
        "posterior": {name: described(posterior, sources) for name, sources in SETS.items()},
        "stiffening": described(stiffer, both)
        | {
            "log Bayes factor": stiffer.evidence(both) - posterior.evidence(both),
            "base at 1 N, MPa": quantile(base_at(stiffer.draws, 1.0), stiffer.weights(both), SHARES),
            "layer at 1 N, MPa": quantile(
                stiffer.draws["ratio"] * base_at(stiffer.draws, 1.0), stiffer.weights(both), SHARES
            ),
        },
        "fingers": {name: _finger(values) for name, values in named().items()},
    }
    found["fingers"]["paper"] = _flat()
    found["cloud, MPa"] = {
        name: [
            [float(f"{one['ratio'] * one['base_mpa']:.3g}"), float(f"{one['base_mpa']:.3g}")]
            for one in posterior.sample(sources, CLOUD)
        ]
        for name, sources in SETS.items()
    }
    return found


def described(posterior: Posterior, sources: tuple[str, ...]) -> dict[str, Any]:
    """Quantiles of a posterior by some sources, and what it predicts of every source."""
    weights = posterior.weights(sources)
    quantities = dict(posterior.draws)
    if "stiffening" not in quantities:
        quantities["layer_mpa"] = quantities["ratio"] * quantities["base_mpa"]
    return {
        "effective draws": effective(weights),
        "quantiles": {name: quantile(values, weights, SHARES) for name, values in quantities.items()},
        "model": {
            source.name: [
                quantile(posterior.models[source.name][:, column], weights, SHARES)
                for column in range(len(source.at))
            ]
            for source in MECHANICAL
        },
        "mean residual": {
            source.name: (weights @ residuals(source, posterior.models[source.name])).tolist()
            for source in MECHANICAL
        },
    }


def _flat() -> dict[str, Any]:
    """The paper's flat finger on its 10 mm with sliding sides, on grooves and sphere."""
    half = 0.5 * PATCH_SIDE_MM
    forces = tuple(np.geomspace(FIRST_FORCE_N, 10.0, 16))
    depths = sphere_depths(Skin(), SPHERE_MM, forces, half, side=50)
    model = {
        GROOVES.name: groove_depths(Skin(), GROOVES.at, (GROOVE_FORCE_N,), half, (1, 200))[0],
        SPHERE.name: sphere_forces(depths, np.array(forces), SPHERE.at, FIRST_FORCE_N),
    }
    return {
        "model": {name: numbers.tolist() for name, numbers in model.items()},
        "residual": {source.name: residuals(source, model[source.name]).tolist() for source in MECHANICAL},
    }


def _finger(values: dict[str, float]) -> dict[str, Any]:
    skin = finger(values)
    model = direct(skin, SPHERE_MM)
    return {
        "values": {name: value for name, value in values.items() if name not in ("ratio", "diameter_mm")},
        "model": {name: numbers.tolist() for name, numbers in model.items()},
        "residual": {source.name: residuals(source, model[source.name]).tolist() for source in MECHANICAL},
        "flat, mm2": {f"{force:g} N": flat_contact(skin, force)[0] for force in (0.6, 1.0, 2.0)},
    }
