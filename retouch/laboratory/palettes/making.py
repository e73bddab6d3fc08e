"""A palette from its request: textures are tried both ways, levels chosen, optimised, verified and mended."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from optimize.estimates.change_curves import crossing
from optimize.run_directory.finished_run import read_result, read_verification
from optimize.verification.verification import Verification
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.progress import say
from relief.relief import Relief
from retouch.laboratory.palettes.choice import Way, chosen, felt_jnd
from retouch.laboratory.palettes.palette import Palette
from retouch.laboratory.stimulus_sets.levels import JND, TEXTURE, study_of
from retouch.laboratory.stimulus_sets.making import MakeRunner
from retouch.laboratory.studies import engine
from retouch.laboratory.studies.rows import expand
from tactile.quantities import ROUGHNESS

TRIED_JND = 4.0
"""Level at which each texture is tried, rougher and smoother. What fingers feel is taken as proportional to
the level, and so is the change of the pictures toward smoother."""
TRIED_STEPS = 16
"""Most steps of such a descent; those of the bundled tiles that arrive take four to nine."""
BEND = 0.01
"""Share by which the rate of that change grows toward rougher, for each squared JND. Gravel has 0.006 up to
+9.8 JND, and eleven of the twelve bundled tiles 0 to 0.011 up to +4."""
LEAST_SHARE, LEAST_JND = 0.9, 0.5
"""Share of that level that counts as reached, and least change that says how a texture changes."""
MARGIN_JND = 0.06
"""By which chosen levels lie farther apart than asked for, JND: a run may miss its target by 1 % of V."""
ROUNDS = 3
"""Most times that fills are optimised."""
MOST_BY_DEFAULT = 8
"""Most fills of one texture where no number is given: as many plates as the default bed holds."""


Wanted = tuple[int, float]
"""A fill to optimise: number of its texture, and level."""


@dataclass(frozen=True, eq=False)
class Fill:
    """A fill as verified.

    Attributes:
        name: of its texture.
        level: JND from the texture as found, as optimised for.
        folder: run directory.
        result: its verification.
        before, after: (fingers,) JND at which texture and fill are felt (`choice.felt_jnd`).
    """

    name: str
    level: float
    folder: Path
    result: Verification
    before: Array
    after: Array

    @property
    def tile(self) -> Relief:
        """The fill."""
        return read_result(self.folder, repeats=True)


def make(request: Palette, out: Path, make_runner: MakeRunner, dry_run: bool = False) -> list[Fill]:
    """Make the fills of a palette, or what is missing of them.

    Args:
        request: the palette, whose folder is claimed.
        out: the folder.
        make_runner: of the runner of rows.
        dry_run: whether only levels are chosen, and said.

    Returns:
        The fills from the smoothest to the roughest; none of a dry run.

    Raises:
        InputError: there is no room for so many fills, or a texture or a fill cannot be felt.
        OSError, KeyboardInterrupt: rows that are done stay; the same call goes on.
    """
    names = request.names
    tried = [(texture, sign * TRIED_JND) for texture in range(len(names)) for sign in (-1.0, 1.0)]
    brief = {"descent.steps": TRIED_STEPS} | request.settings
    fills, failures = _optimised(request, tried, out, make_runner, brief)
    count = request.fills or (len(names) if len(names) > 1 else None)
    each = math.ceil((count or MOST_BY_DEFAULT) / len(names))
    ways = [way for wanted in tried for way in [_way(wanted, fills, failures)] * each]
    apart = request.apart + MARGIN_JND
    room = chosen(ways, apart, each)
    most = sum(map(math.isfinite, room or ()))
    if most < (count or 2):
        asked = f"{count or 2} fills {request.apart:g} JND apart"
        raise InputError(f"fills: there is no room for {asked}: {most} is the most by roughness alone")
    levels = chosen(ways, apart, each, count or most) or room
    for _ in range(ROUNDS):
        if levels is None:
            break
        used = [(way, round(x, 2)) for way, x in zip(ways, levels, strict=True) if math.isfinite(x)]
        ways, now = [way for way, _ in used], [x for _, x in used]
        wanted = [
            (way.texture, math.copysign(x, way.slope[0]) or 0.0) for way, x in zip(ways, now, strict=True)
        ]
        say(f"levels, JND: {', '.join(f'{names[texture]} {x:+.2f}' for texture, x in wanted)}")
        if dry_run:
            return []
        fills, failures = _optimised(request, wanted, out, make_runner)
        for failure in failures.values():
            raise InputError(failure)
        in_order = sorted(fills.values(), key=lambda fill: float(fill.after[0]))
        if least_apart(in_order).min() >= request.apart:
            break
        ways = [_measured(way, fills[key]) for way, key in zip(ways, wanted, strict=True)]
        levels = chosen(ways, apart, len(ways), len(ways), now)
    return in_order


def least_apart(fills: Sequence[Fill]) -> Array:
    """(fills, fills) JND by which the rougher of two fills is rougher for the finger that feels least of it.

    Args:
        fills: from the smoothest to the roughest; the diagonal is infinite.
    """
    felt = np.array([fill.after for fill in fills])
    above = np.triu((felt[None] - felt[:, None]).min(axis=2), 1)
    return above + above.T + np.diag(np.full(len(fills), np.inf))


def _optimised(
    request: Palette,
    wanted: Sequence[Wanted],
    out: Path,
    make_runner: MakeRunner,
    settings: Mapping[str, Any] | None = None,
) -> tuple[dict[Wanted, Fill], dict[Wanted, str]]:
    """The fills that could be optimised, with further settings of runs, and why others could not."""
    labels = {f"{request.names[texture]} {level:+g}": (texture, level) for texture, level in wanted}
    values = [
        {"label": label, TEXTURE: str(request.textures[texture]), JND: level}
        for label, (texture, level) in labels.items()
    ]
    tables = [{"name": "fills", "set": settings or {}, "axes": {"fill": values}}]
    study = study_of(request, f"Palette: {', '.join(request.names)}", tables, out)
    expanded = expand(study)
    rows = engine.compute(expanded, out, make_runner, study.measures)
    fills, failures = {}, dict.fromkeys(wanted, "; ".join(expanded.faults))
    for row in expanded.rows.values():
        texture, level = key = labels[row.labels["fill"]]
        folder = engine.row_folder(out, row)
        result = read_verification(folder) if row.key in rows.records else None
        if result is None:
            failures[key] = rows.failures.get(row.key, f"{folder}: damaged")
        elif result.touch.fingers is None:
            failures[key] = f"{folder}: the contact of another finger does not converge"
        else:
            felt = (
                felt_jnd(_roughness(result, state, request.one_finger)) for state in ("initial", "verified")
            )
            fills[key] = Fill(request.names[texture], level, folder, result, *felt)
            del failures[key]
    return fills, failures


def _roughness(result: Verification, state: str, one_finger: bool) -> Array:
    """(fingers,) roughness by finite elements, at held-out contact locations where there are any.

    What other fingers feel is known by the layer, as a ratio to what this finger feels by the layer.
    """
    touch = result.touch
    assert touch.fingers is not None
    places = touch.places and (touch.places.between or touch.places.steered)
    mean = np.mean(getattr(places or touch, state)[ROUGHNESS.name])
    layer = {"initial": "initial_roughness", "verified": "roughness"}[state]
    each = np.array([getattr(finger, layer) for finger in touch.fingers.each[: 1 if one_finger else None]])
    return np.asarray(mean * each / each[0])


def _way(wanted: Wanted, fills: Mapping[Wanted, Fill], failures: Mapping[Wanted, str]) -> Way:
    """What was found by trying a texture one way. Raises InputError if it failed both ways."""
    texture, level = wanted
    if (fill := fills.get(wanted)) is None:
        if (other := fills.get((texture, -level))) is None:
            raise InputError(failures[wanted])
        return Way(texture, other.before, np.full_like(other.before, math.copysign(1.0, level)), 0.0)
    change, sign = fill.after - fill.before, math.copysign(1.0, level)
    reached, picture = sign * float(change[0]), fill.result.look.change_percent_of_white
    if reached < LEAST_JND:
        return Way(texture, fill.before, np.full_like(change, sign), 0.0)
    half = 0.5 * picture * (1.0 + BEND * (0.5 * reached) ** 2) / (1.0 + BEND * reached**2)
    most = crossing([(0.5 * reached, half), (reached, picture)], bends=level > 0.0)
    if reached < LEAST_SHARE * TRIED_JND:
        return Way(texture, fill.before, change / reached, min(most, reached))
    return Way(texture, fill.before, change / TRIED_JND, most)


def _measured(way: Way, fill: Fill) -> Way:
    """A way through what a fill of it was measured to be."""
    level = abs(fill.level)
    slope = (fill.after - fill.before) / level if level > LEAST_JND else way.slope
    return way._replace(felt=fill.after - slope * level, slope=slope)
