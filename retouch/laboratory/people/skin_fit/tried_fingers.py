"""Fingers that are tried against answers: what each feels of the plates, and how likely the answers are."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

import tactile
from optimize.verification.other_fingers import in_the_middle
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.formats import RUN_HEIGHTS
from relief.ground.progress import stage
from relief.relief import Relief
from retouch.laboratory.people.comparisons import Question
from retouch.laboratory.people.likelihood import LikelihoodGrid
from retouch.laboratory.people.plates import SetPlate
from retouch.laboratory.people.population import fit
from tactile.fingers import roughness_by_skin

STIFFNESS = np.exp(np.linspace(math.log(0.2), math.log(5.0), 9))
"""Factors of the moduli that are tried: people's fingers differ by 4 either way (docs/evidence/touch.md)."""
DEPTHS = np.linspace(0.5, 1.6, 6)
"""Factors of the receptor depth that are tried: 0.375 to 1.2 mm of 0.75."""
USUAL_SHARE = math.log(0.5)
"""Logarithm of the noise over the spread of the plates where answers give no noise: plates 1 JND apart,
mostly."""


@dataclass(frozen=True)
class Felt:
    """What the fingers that are tried feel of plates.

    Attributes:
        skins: by factor of stiffness and of depth, in the order of `STIFFNESS` and `DEPTHS`.
        labels: of the plates.
        logs: (stiffness, depths, plates) logarithms of V.
    """

    skins: tuple[tuple[tactile.Skin, ...], ...]
    labels: tuple[str, ...]
    logs: Array

    def values(self, stiffness: int, depth: int) -> dict[str, float]:
        """V by label, to one of the fingers."""
        return dict(zip(self.labels, np.exp(self.logs[stiffness, depth]).tolist(), strict=True))


def varied(base: tactile.Skin, stiffness: float, depth: float) -> tactile.Skin:
    """The skin with all moduli and the depth of the receptors times a factor each."""
    return replace(
        base,
        young_modulus_mpa=stiffness * base.young_modulus_mpa,
        layers=tuple((thickness, stiffness * modulus) for thickness, modulus in base.layers),
        depth_mm=min(depth * base.depth_mm, 0.5 * (base.depth_mm + base.thickness_mm)),
    )


def felt_by(
    base: tactile.Skin, question: Question, plates: Mapping[str, SetPlate], tiles: bool = True
) -> Felt:
    """Press every finger that is tried on the plates of the answers, at a few places each.

    Args:
        base: finger that the others vary.
        question: the answers.
        plates: of the set.
        tiles: whether the plates repeat tiles.

    Raises:
        InputError: a relief is missing, or too small or too coarse for a finger.
    """
    labels = tuple(
        dict.fromkeys(label for each in question.pairs for one in each for label in (one.first, one.second))
    )
    skins = tuple(tuple(varied(base, factor, depth) for depth in DEPTHS) for factor in STIFFNESS)
    # The softest finger needs the widest patch; all are pressed on one.
    widest = max(skins, key=lambda each: each[0].patch_mm or 0.0)[0]
    logs = np.empty((len(STIFFNESS), len(DEPTHS), len(labels)))
    with stage("pressing plates with fingers", total=len(labels)) as advance:
        for number, label in enumerate(labels):
            file = plates[label].folder / RUN_HEIGHTS
            if not file.is_file():
                raise InputError(f"{file}: no such file; a finger needs the run directories of the set")
            relief = Relief.read(file, repeats=tiles)
            patches = in_the_middle(relief.surface, widest)
            heights = patches.within_reach(relief.heights)
            every = [skin for each in skins for skin in each]
            try:
                values = roughness_by_skin(heights, widest, every, patches.size_mm).mean(axis=1)
            except tactile.ContactError as error:
                raise InputError(f"{file}: {error}") from error
            logs[:, :, number] = np.log(np.maximum(values, 1e-12)).reshape(logs.shape[:2])
            advance()
    return Felt(skins, labels, logs)


def fitted_logs(question: Question, felt: Felt) -> Array:
    """(stiffness, depths) logarithms of the likelihood of the answers by each finger, at its best JND."""
    found = np.empty(felt.logs.shape[:2])
    grid = LikelihoodGrid.for_answers(max(map(len, question.pairs)))
    share = None
    with stage("fitting a finger", total=found.size) as advance:
        for place in np.ndindex(found.shape):
            values = felt.values(*place)
            people = question.answers(values.__getitem__)
            spread = math.log(np.std(np.concatenate([one.differences for one in people])) + 1e-3)
            if share is None:
                noise = fit(people, grid).middle.noise.value
                share = USUAL_SHARE if noise is None else noise - spread
            # To a finger that feels plates farther apart the noise is larger by as much.
            found[place] = fit(people, grid.about(spread + share)).log_likelihood
            advance()
    return found
