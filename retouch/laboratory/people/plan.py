"""The plan of an experiment: which plates each person compares, sorts and rates, and in which order.

Every pair of levels of a texture comes equally often over all people, to within one, and in both orders; the
order of trials is random by a seed, and one texture comes again after two other trials at the earliest, as in
section 5.3.2 of the paper, where the set has enough textures. People sort the levels of each texture once, as
in section 5.4, and give each plate a number.
"""

import csv
import hashlib
import io
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from relief.ground.errors import InputError
from relief.ground.files import write_atomically
from relief.ground.progress import say
from retouch.laboratory.people.plates import SetPlate, areas_of, levels_of, read_plates
from retouch.laboratory.people.reading import COLDER, HEADINGS, MAGNITUDES, ROUGHER, SAME, SORTS, TRIAL
from retouch.laboratory.people.tables import PLATES, grouped, read_table
from retouch.laboratory.stimulus_sets.levels import CONTACT, ROUGHNESS
from retouch.laboratory.stimulus_sets.stimulus_set import Experiment

FOLDER, ANSWERS = "experiment", "answers-"
"""Folder of the plan in that of a set, and how folders and tables of answers begin there."""
APART = 2
"""Trials of other textures between two of one."""
MOST_RATINGS = 60
"""About the most numbers that a person gives; each plate is rated at least once."""
MOST_SORTED = 26
"""Most plates of a sort, which the page names by letters; nobody sorts so many."""

Trials = list[tuple[int, ...]]
"""Trials of a person: places of the plates in the list of labels."""


@dataclass(frozen=True)
class TrialPlan:
    """The plan of an experiment.

    Attributes:
        plates: of the set.
        trials: by question and person.
        seed: of its random order.
    """

    plates: tuple[SetPlate, ...]
    trials: dict[str, dict[str, Trials]]
    seed: int

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of the plates to people: their codes, if they have any."""
        return tuple(plate.code or plate.label for plate in self.plates)

    @property
    def textures(self) -> tuple[str, ...]:
        """Names of the plates' textures."""
        return tuple(plate.texture for plate in self.plates)

    @property
    def digest(self) -> str:
        """Sixteen characters that differ between plans and sets: answers are kept under them."""
        # Folders may be moved, and runs removed, while the plates in people's hands stay the same.
        plates = [replace(plate, folder=Path(), by_finger={}) for plate in self.plates]
        content = json.dumps([[asdict(plate) for plate in plates], self.trials, self.seed], default=str)
        return hashlib.sha256(content.encode()).hexdigest()[:16]

    def as_json(self) -> dict[str, Any]:
        """What the page of the experiment needs."""
        return {
            "digest": self.digest,
            "labels": self.labels,
            "people": list(next(iter(self.trials.values()))),
            "trials": self.trials,
            "headings": HEADINGS,
        }

    def rows(self, question: str) -> Iterator[list[str]]:
        """Rows of a question's table: headings, then trials with room for the answer."""
        person, *others = HEADINGS[question]
        yield [person, TRIAL, *others]
        for name, trials in self.trials[question].items():
            for number, places in enumerate(trials, start=1):
                labels = [self.labels[place] for place in places]
                begin = [name, str(number)]
                if question == SORTS:
                    yield from ([*begin, self.textures[places[0]], "", label] for label in labels)
                else:
                    yield [*begin, *labels, ""]


def plan(plates: Mapping[str, SetPlate], experiment: Experiment) -> TrialPlan:
    """The plan for the plates of a set; questions that they cannot answer are left out."""
    rng = np.random.default_rng(experiment.seed)
    textures = tuple(plate.texture for plate in plates.values())
    place = {label: number for number, label in enumerate(plates)}
    levels = [[place[plate.label] for plate in each] for each in levels_of(dict(plates)).values()]
    areas = [[place[plate.label] for plate in each] for each in areas_of(dict(plates)).values()]
    people = [f"P{number}" for number in range(1, experiment.people + 1)]
    rated: Trials = [(one,) for level in levels for one in level]
    sorts = [tuple(level) for level in levels if 2 < len(level) <= MOST_SORTED]
    pairs = {
        ROUGHER: _both_orders(levels),
        COLDER: _both_orders(areas),
        SAME: _with_texture(plates, place),
    }
    trials: dict[str, dict[str, Trials]] = {}
    for question, each in pairs.items():
        if each:
            trials[question] = _shared_out(each, people, experiment.pairs, textures, rng)
    if sorts:
        trials[SORTS] = {
            name: [tuple(rng.permutation(sorts[k]).tolist()) for k in rng.permutation(len(sorts))]
            for name in people
        }
    if rated:
        trials[MAGNITUDES] = _shared_out(rated, people, max(MOST_RATINGS, len(rated)), textures, rng)
    return TrialPlan(tuple(plates.values()), trials, experiment.seed)


def _both_orders(levels: Sequence[Sequence[int]]) -> Trials:
    """Every two plates of each texture, in both orders."""
    return [(one, other) for level in levels for one in level for other in level if one != other]


def _with_texture(plates: Mapping[str, SetPlate], place: Mapping[str, int]) -> Trials:
    """Each texture as found with each of its other plates, in both orders; none for a set of areas alone."""
    pairs: Trials = []
    for texture in plates.values():
        if texture.kind != ROUGHNESS or texture.level != 0.0:
            continue
        for other in plates.values():
            if other.texture == texture.texture and other.label != texture.label and other.kind != CONTACT:
                two = place[texture.label], place[other.label]
                pairs += [two, two[::-1]]
    return pairs


def _shared_out(
    trials: Trials, people: Sequence[str], most: int, textures: Sequence[str], rng: np.random.Generator
) -> dict[str, Trials]:
    """Trials of each person: all of them as often as `most` allows, or shares that go round all people."""
    shuffled = [trials[k] for k in rng.permutation(len(trials))]
    repeats = most // len(trials)
    shares = {}
    for number, name in enumerate(people):
        if repeats:
            share = shuffled * repeats
        else:
            share = [shuffled[(number * most + k) % len(shuffled)] for k in range(most)]
        shares[name] = _ordered(share, textures, rng)
    return shares


def _ordered(trials: Trials, textures: Sequence[str], rng: np.random.Generator) -> Trials:
    """Trials in random order, one texture again after `APART` others where that is possible."""
    shuffled = [trials[k] for k in rng.permutation(len(trials))]
    waiting = grouped((textures[trial[0]], trial) for trial in shuffled)
    ordered: Trials = []
    recent: list[str] = []
    while waiting:
        # The longer a texture has waited, the better, if every texture is a recent one.
        free = [name for name in waiting if name not in recent] or [min(waiting, key=recent.index)]
        counts = np.array([len(waiting[name]) for name in free], dtype=float)
        # A texture that must come every third time from now on comes now, so that no run of it is left over.
        urgent = np.flatnonzero(counts * (APART + 1) >= sum(map(len, waiting.values())))
        chosen = free[urgent[0] if len(urgent) else rng.choice(len(free), p=counts / counts.sum())]
        ordered.append(waiting[chosen].pop())
        recent = [*recent, chosen][-APART:]
        waiting = {name: each for name, each in waiting.items() if each}
    return ordered


def csv_bytes(rows: Iterable[Sequence[object]]) -> bytes:
    """A table as CSV."""
    text = io.StringIO()
    csv.writer(text).writerows(rows)
    return text.getvalue().encode()


def check_answers(folder: Path) -> None:
    """Raises InputError if a set holds answers to its plan, which another plan cannot read."""
    if answered := sorted((folder / FOLDER).glob(f"{ANSWERS}*/{ANSWERS}*.csv")):
        raise InputError(
            f"{answered[-1].parent}: answers to the plan that is there; move them, or keep the plan"
        )


def write_plan(folder: Path, experiment: Experiment) -> TrialPlan | None:
    """Write the tables of a plan into the folder of a set; None where the set has no two plates to compare.

    Raises:
        InputError: the folder holds no plates.
    """
    trial_plan = plan(read_plates(folder), experiment)
    if not trial_plan.trials:
        return None
    compared = trial_plan.trials.get(ROUGHER) or trial_plan.trials.get(COLDER) or {}
    if any(len(trials) != experiment.pairs for trials in compared.values()):
        trials = len(next(iter(compared.values())))
        say(
            f"{trials} pairs each instead of {experiment.pairs}: each of the plan's pairs comes equally often"
        )
    for question in trial_plan.trials:
        write_atomically(folder / FOLDER / f"{question}.csv", csv_bytes(trial_plan.rows(question)))
    for question in HEADINGS.keys() - trial_plan.trials.keys():
        (folder / FOLDER / f"{question}.csv").unlink(missing_ok=True)
    return trial_plan


def planned(folder: Path, labels: Mapping[str, str]) -> dict[str, dict[tuple[str, int], tuple[str, ...]]]:
    """Labels of each trial of a set's plan, by question, person and number; empty without a plan.

    Args:
        folder: of the set.
        labels: by code.

    Raises:
        InputError: a table of the plan is damaged.
    """
    found: dict[str, dict[tuple[str, int], tuple[str, ...]]] = {}
    for question, headings in HEADINGS.items():
        file = folder / FOLDER / f"{question}.csv"
        if not file.is_file():
            continue
        table = read_table(file)
        if not {*headings, TRIAL} <= set(table.headings):
            raise InputError(
                f"{file}: is no table of a plan; retouch stimuli --redraw -o {folder} writes it anew"
            )
        trials = found.setdefault(question, {})
        for row in table.rows:
            key = row.text("person"), row.whole(TRIAL)
            if key in trials and question != SORTS:
                raise row.fault(f"trial: {key[1]} of {key[0]} is there twice")
            plates = [row.text(name) for name in PLATES[question]]
            trials[key] = (*trials.get(key, ()), *(labels.get(plate, plate) for plate in plates))
    return found
