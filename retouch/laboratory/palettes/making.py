"""A palette from its request: textures are tried both ways, levels chosen, optimised, verified and mended."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from optimize.estimates.change_curves import crossing
from optimize.run_directory.finished_run import FinishedRun
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from relief.ground.progress import say
from retouch.laboratory.palettes.choice import Way, chosen, felt_jnd
from retouch.laboratory.palettes.palette import Palette
from retouch.laboratory.stimulus_sets.levels import JND, TEXTURE, study_of
from retouch.laboratory.studies import engine
from retouch.laboratory.studies.rows import expand
from tactile.quantities import ROUGHNESS

TRIED_JND = 4.0
"""Level at which each texture is tried, rougher and smoother. What fingers feel is taken as proportional to
the level, and so is the change of the pictures toward smoother."""
TRIED_STEPS = 16
"""Most steps of such a descent; those of the bundled tiles that arrive take four to nine."""
BEND = 0.01
"""Share by which the pictures' change per JND grows toward rougher, by the squared JND. Gravel has 0.006 up
to +9.8 JND, and eleven of the twelve bundled tiles 0 to 0.011 up to +4."""
LEAST_SHARE, LEAST_JND, STEADY_JND = 0.9, 0.1, 0.5
"""Share of `TRIED_JND` from which a try has arrived; least change of a try, JND, that is counted; and least
level of a fill, JND, whose measured slope replaces that of the try."""
MARGIN_JND = 0.06
"""Distance, JND, that chosen levels have beyond what is asked for: a run may miss its target by 1 % of V."""
ROUNDS = 3
"""Most times that fills are optimised."""
MOST_BY_DEFAULT = 8
"""Most fills of one texture where no number is given: as many plates as the default bed holds."""


@dataclass(frozen=True, eq=False)
class Fill:
    """A fill as verified.

    Attributes:
        texture: number of its texture.
        level: JND from the texture as found, as optimised for.
        run: that made it.
        before, after: (fingers,) JND at which texture and fill are felt (`choice.felt_jnd`).
    """

    texture: int
    level: float
    run: FinishedRun
    before: Array
    after: Array


def make(request: Palette, out: Path, make_runner: engine.MakeRunner) -> list[Fill]:
    """Make the fills of a palette, or what is missing of them.

    Args:
        request: the palette, whose folder is claimed.
        out: the folder.
        make_runner: of the runner of rows.

    Returns:
        The fills from the smoothest to the roughest.

    Raises:
        InputError: there is no room for so many fills, or a fill cannot be made or felt.
        OSError, KeyboardInterrupt: rows that are done stay; the same call goes on.
    """
    names = request.names
    tried = [(texture, sign * TRIED_JND) for texture in range(len(names)) for sign in (-1.0, 1.0)]
    brief = {"descent.steps": TRIED_STEPS} | request.settings
    fills = _optimised(request, tried, out, make_runner, brief)
    count = request.fills or (len(names) if len(names) > 1 else None)
    each = math.ceil((count or MOST_BY_DEFAULT) / len(names))
    ways = [way for fill in fills for way in [_way(fill)] * each]
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
        # Adding 0 makes -0 a 0.
        wanted = [(way.texture, math.copysign(x, way.slope[0]) + 0.0) for way, x in used]
        say(f"levels, JND: {', '.join(f'{names[texture]} {x:+.2f}' for texture, x in wanted)}")
        fills = _optimised(request, wanted, out, make_runner)
        in_order = sorted(fills, key=lambda fill: float(fill.after[0]))
        if least_apart(in_order).min() >= request.apart:
            break
        ways = [_measured(way, fill) for (way, _), fill in zip(used, fills, strict=True)]
        levels = chosen(ways, apart, len(ways), len(ways), [x for _, x in used])
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
    wanted: Sequence[tuple[int, float]],
    out: Path,
    make_runner: engine.MakeRunner,
    settings: Mapping[str, Any] | None = None,
) -> list[Fill]:
    """Fills of textures, by their numbers, at levels, with further settings of runs. Raises InputError."""
    values = [
        {"label": f"{request.names[at]} {level:+g}", TEXTURE: str(request.textures[at]), JND: level}
        for at, level in wanted
    ]
    table = {"name": "fills", "set": settings or {}, "axes": {"fill": values}}
    study = study_of(request, f"Palette: {', '.join(request.names)}", [table], out)
    expanded = expand(study)
    rows = engine.compute(expanded, out, make_runner, study.measures, what="fills")
    for fault in (*expanded.faults, *rows.failures.values()):
        raise InputError(fault)
    fills = []
    for (texture, level), row in zip(wanted, expanded.rows.values(), strict=True):
        run = FinishedRun.read(engine.row_folder(out, row))
        felt = (felt_jnd(_roughness(run, state, request.one_finger)) for state in ("initial", "verified"))
        fills.append(Fill(texture, level, run, *felt))
    return fills


def _roughness(run: FinishedRun, state: str, one_finger: bool) -> Array:
    """(fingers,) roughness by finite elements, at held-out contact locations where there are any.

    Other fingers press by the layer alone. Their ratio to the given finger, both by the layer, is applied to
    the given finger's roughness by finite elements. Raises InputError.
    """
    touch = run.verification.touch
    if touch.fingers is None:
        raise InputError(f"{run.folder}: the contact of another finger does not converge")
    places = touch.places and (touch.places.between or touch.places.steered)
    mean = np.mean(getattr(places or touch, state)[ROUGHNESS.name])
    layer = "initial_roughness" if state == "initial" else "roughness"
    each = np.array([getattr(finger, layer) for finger in touch.fingers.each[: 1 if one_finger else None]])
    return np.asarray(mean * each / each[0])


def _way(fill: Fill) -> Way:
    """The way of a texture that was tried at `TRIED_JND`."""
    change, picture = fill.after - fill.before, fill.run.verification.look.change_percent_of_white
    reached = max(LEAST_JND, math.copysign(float(change[0]), float(change[0]) * fill.level))
    half = 0.5 * picture * (1.0 + BEND * (0.5 * reached) ** 2) / (1.0 + BEND * reached**2)
    most = crossing([(0.5 * reached, half), (reached, picture)], bends=fill.level > 0.0)
    level = TRIED_JND if reached >= LEAST_SHARE * TRIED_JND else reached
    return Way(fill.texture, fill.before, change / level, most if level == TRIED_JND else min(most, reached))


def _measured(way: Way, fill: Fill) -> Way:
    """A way whose felt positions are those measured on a fill of it."""
    level = abs(fill.level)
    slope = (fill.after - fill.before) / level if level > STEADY_JND else way.slope
    return way._replace(felt=fill.after - slope * level, slope=slope)
