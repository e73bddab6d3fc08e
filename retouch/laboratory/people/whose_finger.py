"""Whose finger explains people's answers best, of the fingers in the table of every run."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from relief.ground.arrays import Array
from relief.ground.progress import stage
from retouch.laboratory.people.comparisons import Fractions, Question
from retouch.laboratory.people.plates import SetPlate
from retouch.laboratory.people.population import Population, fit

RESAMPLES, SEED = 2000, 0
"""Resampled groups of people by which fingers are compared, and their seed."""
LEAST_PEOPLE = 3
"""People from which on resampling them says how sure the best finger is."""


@dataclass(frozen=True)
class FingerFit:
    """How well answers go by what a finger feels, with a JND of its own.

    Attributes:
        name: of the finger.
        log_likelihood: of the answers.
        behind: by how much it is less than that of the likeliest finger.
        best_of_resampled_percent: of groups of people; None for too few people.
        weber: Weber fraction, with the ends of its interval.
    """

    name: str
    log_likelihood: float
    behind: float
    best_of_resampled_percent: float | None
    weber: float | None
    weber_low: float
    weber_high: float | None


def fingers(question: Question, plates: Mapping[str, SetPlate]) -> tuple[FingerFit, ...]:
    """How well the answers go by what each finger feels, each with a JND of its own.

    Returns:
        The likeliest first; none where the runs of the set are not there.
    """
    labels = {label for pair in itertools.chain(*question.pairs) for label in (pair.first, pair.second)}
    names = dict.fromkeys(name for label in labels for name in plates[label].by_finger)
    whole = [name for name in names if all(name in plates[label].by_finger for label in labels)]
    if not whole:
        return ()
    with stage("comparing fingers", total=len(whole)) as advance:
        fits = []
        for name in whole:
            felt = {label: plates[label].by_finger[name] for label in labels}
            fits.append(fit(question.answers(felt.__getitem__)))
            advance()
    wins = _wins(fits)
    best = max(one.log_likelihood for one in fits)
    found = []
    for number, (name, one) in enumerate(zip(whole, fits, strict=True)):
        fraction = Fractions.of(one.middle)
        found.append(
            FingerFit(
                name=name,
                log_likelihood=one.log_likelihood,
                behind=best - one.log_likelihood,
                best_of_resampled_percent=None if wins is None else 100.0 * float(wins[number]),
                weber=fraction.weber,
                weber_low=fraction.weber_low,
                weber_high=fraction.weber_high,
            )
        )
    return tuple(sorted(found, key=lambda one: one.behind))


def _wins(fits: Sequence[Population]) -> Array | None:
    """Share of resampled people whose answers each finger explains best; None for too few people."""
    each = np.array([one.of_people for one in fits])
    if each.shape[1] < LEAST_PEOPLE:
        return None
    drawn = np.random.default_rng(SEED).integers(each.shape[1], size=(RESAMPLES, each.shape[1]))
    best = each[:, drawn].sum(axis=2).argmax(axis=0)
    return np.asarray(np.bincount(best, minlength=len(fits)) / RESAMPLES)
