"""A finger of one's own: the stiffness and receptor depth of a skin that explain people's answers best.

The skin that a set was made for is varied by one factor of all its moduli and by the depth of its receptors.
For each such finger V of the plates is computed, and the answers to pairs are fitted with a JND of their own,
so that nothing is assumed of the JND: what decides is how the plates lie to one another. Simple measurements
on the finger (`retouch.laboratory.people.skin_fit.measurements`) say more of the stiffness, and nothing of
the receptors.
"""

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import tomli_w
from scipy.interpolate import RectBivariateSpline
from scipy.special import ndtr

import tactile
from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.settings.skins import SKIN_KEYS, SkinKeys, load_skin
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.progress import stage
from retouch.laboratory.people.comparisons import Question
from retouch.laboratory.people.own_finger import FittedKey, HeldOut, Proposal
from retouch.laboratory.people.plates import SetPlate
from retouch.laboratory.people.population import DROP, Estimate
from retouch.laboratory.people.reading import ROUGHER, Answers
from retouch.laboratory.people.skin_fit.measurements import (
    Measurement,
    log_likelihood,
    predicted,
    read_measurements,
)
from retouch.laboratory.people.skin_fit.tried_fingers import (
    DEPTHS,
    STIFFNESS,
    Felt,
    felt_by,
    fitted_logs,
    varied,
)
from retouch.laboratory.stimulus_sets.stimulus_set import FILE, StimulusSet

FINE = 161
"""Values of each quantity between those tried, at which a spline is read."""
NOISES = np.exp(np.linspace(math.log(0.02), math.log(2.0), 81))
LAPSES = 0.02
"""Noises s and the lapse rate by which answers to textures that were left out are predicted."""


def propose(
    folder: Path,
    answers: Answers,
    plates: Mapping[str, SetPlate],
    press: str | os.PathLike[str] | None = None,
    skin: str | os.PathLike[str] | None = None,
) -> tuple[Proposal, bytes]:
    """Propose a finger.

    Args:
        folder: of the set.
        answers: of people; those to the question which of two plates is rougher count.
        plates: of the set.
        press: table of measurements on the finger; None: answers alone.
        skin: to start from, a name or a file; None: that of the set.

    Returns:
        What `answers.json` says of the proposal, and the skin file.

    Raises:
        InputError: there are no such answers, or the reliefs of their plates are not in the folder.
    """
    if not answers.pairs.get(ROUGHER):
        raise InputError("skin_out: needs answers to which of two plates is rougher")
    stimuli = StimulusSet.read(folder / FILE)
    base = _skin_of(stimuli) if skin is None else load_skin(skin)
    question = Question.of(ROUGHER, answers.pairs[ROUGHER])
    measured = [] if press is None else read_measurements(Path(press), base)
    felt = felt_by(base, question, plates, not stimuli.whole)
    logs = fitted_logs(question, felt)
    pressed = _pressed(measured, felt) if measured else np.zeros(len(STIFFNESS))
    fitted, own_skin = fitted_skin(logs + pressed[:, None], base)
    if measured:
        # Measurements say nothing of the receptors.
        fitted = tuple(
            replace(one, source="answers and measurements") if one.key == "young_modulus_mpa" else one
            for one in fitted
        )
    proposal = Proposal(
        fitted,
        own_skin.described(),
        answers=sum(map(len, question.pairs)),
        people=len(question.people),
        measurements=len(measured),
        start=Path(skin).stem if skin else _name(stimuli),
        held_out=held_out(question, felt, plates),
    )
    return proposal, _file(proposal)


def _name(stimuli: StimulusSet) -> str:
    return Path(str(stimuli.settings.get("touch.skin", DEFAULT_SKIN))).stem


def _skin_of(stimuli: StimulusSet) -> tactile.Skin:
    """The finger that a set was made for."""
    base = load_skin(str(stimuli.settings.get("touch.skin", DEFAULT_SKIN)))
    own = {key: stimuli.settings[f"touch.{key}"] for key in SKIN_KEYS if f"touch.{key}" in stimuli.settings}
    return replace(base, **own)  # type: ignore[arg-type]


def _pressed(measured: Sequence[Measurement], felt: Felt) -> Array:
    """(stiffness,) logarithms of the likelihood of measurements by each stiffness."""
    found = np.full(len(STIFFNESS), -np.inf)
    with stage("comparing measurements", total=len(STIFFNESS)) as advance:
        for number, (skin, *_) in enumerate(felt.skins):
            try:
                found[number] = log_likelihood(measured, [predicted(one, skin) for one in measured])
            except (InputError, tactile.ContactError):
                # Such a soft finger would be flattened beyond a patch: as unlikely as can be.
                found[number] = -1e4
            advance()
    return found


def fitted_skin(logs: Array, base: tactile.Skin) -> tuple[tuple[FittedKey, ...], tactile.Skin]:
    """The likeliest stiffness and depth with their intervals, from logarithms (stiffness, depths)."""
    fine = [np.linspace(values[0], values[-1], FINE) for values in (np.log(STIFFNESS), DEPTHS)]
    surface = RectBivariateSpline(np.log(STIFFNESS), DEPTHS, logs)(*fine)
    best = np.unravel_index(surface.argmax(), surface.shape)
    skin = varied(base, math.exp(fine[0][best[0]]), float(fine[1][best[1]]))
    moduli = _profile(fine[0], surface.max(axis=1)).mapped(lambda log: math.exp(log) * base.young_modulus_mpa)
    depths = _profile(fine[1], surface.max(axis=0)).mapped(lambda factor: factor * base.depth_mm)
    values = {"young_modulus_mpa": (skin.young_modulus_mpa, moduli), "depth_mm": (skin.depth_mm, depths)}
    return tuple(FittedKey(key, value, one.low, one.high) for key, (value, one) in values.items()), skin


def _profile(values: Array, logs: Array) -> Estimate:
    """The interval of a quantity; an end is open where the last value that was tried is likely enough."""
    likely = np.flatnonzero(logs >= logs.max() - DROP)
    low = None if likely[0] == 0 else float(values[likely[0]])
    high = None if likely[-1] == len(values) - 1 else float(values[likely[-1]])
    return Estimate(float(values[logs.argmax()]), low, high)


def held_out(question: Question, felt: Felt, plates: Mapping[str, SetPlate]) -> HeldOut | None:
    """How well a finger that is fitted to all textures but one predicts that one; None for one texture."""
    by_texture: dict[str, list[tuple[int, int, bool]]] = {}
    place = {label: number for number, label in enumerate(felt.labels)}
    for each in question.pairs:
        for one in each:
            if plates[one.first].texture == plates[one.second].texture:
                answer = place[one.first], place[one.second], one.second_told
                by_texture.setdefault(plates[one.first].texture, []).append(answer)
    if len(by_texture) < 2:
        return None
    tables = np.array([_by_noise(felt.logs, each) for each in by_texture.values()])
    count = sum(map(len, by_texture.values()))
    start = np.abs(np.log(STIFFNESS)).argmin(), np.abs(DEPTHS - 1.0).argmin()
    own = usual = 0.0
    for table in tables:
        rest = tables.sum(axis=0) - table
        own += float(table[np.unravel_index(rest.argmax(), rest.shape)])
        usual += float(table[start][rest[start].argmax()])
    return HeldOut(own / count, usual / count, len(by_texture))


def _by_noise(logs: Array, answers: Sequence[tuple[int, int, bool]]) -> Array:
    """(stiffness, depths, noises) logarithms of the likelihood of answers, alike for all people."""
    first, second, above = (np.array(part) for part in zip(*answers, strict=True))
    differences = np.where(above, 1.0, -1.0) * (logs[..., second] - logs[..., first])
    found = [
        np.log(0.5 * LAPSES + (1.0 - LAPSES) * ndtr(differences / noise)).sum(axis=-1) for noise in NOISES
    ]
    return np.stack(found, axis=-1)


def _file(proposal: Proposal) -> bytes:
    """The skin file, whose comments say what was fitted to what."""
    keys = {key: value for key, value in proposal.skin.items() if key in SKIN_KEYS and value is not None}
    # Read back as any skin file is, so that nothing is written that would be refused.
    values = SkinKeys.model_validate(_short(keys)).model_dump(mode="json", exclude_none=True)
    comments = [
        f"# Proposed by retouch answers from {proposal.answers} answers of {proposal.people} people and "
        f"{proposal.measurements} measurements, starting from {proposal.start}.",
        *(
            f"# {one.key}: 95 % from {' to '.join(one.ends('unknown'))}, from {one.source}; "
            "fitted, not predicted."
            for one in proposal.fitted
        ),
        "# All other keys are those of the skin it starts from.",
    ]
    return ("\n".join(comments) + "\n" + tomli_w.dumps(values)).encode()


def _short(value: Any) -> Any:
    """Numbers of four significant digits, more than any of them means."""
    if isinstance(value, Mapping):
        return {key: _short(part) for key, part in value.items()}
    if isinstance(value, list | tuple):
        return [_short(part) for part in value]
    return float(f"{value:.4g}") if isinstance(value, float) else value
