"""Fuzzy skin for a feel: numbers for a slicer's profile, judged on what the slicer makes of them.

Thickness and point distance are found by pressing on computed walls.
"""

import os
import shutil
import tempfile
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import brentq

from optimize.settings.skins import load_skin
from optimize.verification.solids.bead_feel import feel_of_beads
from optimize.verification.solids.mesh_feel import pressed
from relief.ground.errors import InputError, option_error
from relief.ground.files import check_file_to_write, write_atomically
from relief.ground.formatting import number
from relief.ground.lengths import Lengths
from relief.ground.limits import PATCH_SIDE_MM
from relief.ground.options import by_keywords, checked
from relief.ground.progress import stage
from relief.solids.body import Part
from relief.solids.export.parts import write_parts
from relief.solids.filament import profiles
from relief.solids.filament.bead_surface import BeadSurface
from relief.solids.filament.fuzzy_skin import fuzzy_wall
from relief.solids.filament.profiles import Profile, Setting, read_profile
from relief.solids.files.mesh import Mesh
from retouch.verbs.evaluation import evaluate
from retouch.verbs.filament.slicing import check_slicer, sliced
from retouch.verbs.fuzzy.fuzzy_options import FuzzyOptions
from retouch.verbs.progress_display import followed
from retouch.verbs.solid_evaluation import read_solid
from tactile.jnd import SMOOTH_BELOW, jnd_apart, jnd_scaled, smooth_clause
from tactile.quantities import ROUGHNESS
from tactile.skin import Skin

PATCHES = 16
"""Places on a computed wall. V differs by 5 % from place to place, so that its mean is known to 1.3 %,
0.07 just-noticeable differences."""
FINEST_MM = 1e-3
"""Step of thickness and point distance, mm: G-code has three decimals, and slicers' windows four."""
SPARSEST_MM = 1.2
"""Point distance, mm, beyond which V does not grow: from 1.2 to 5 mm V changes by less than the 5 % among
places, for thicknesses of 0.1 and 0.3 mm."""


@dataclass(frozen=True)
class Wall:
    """An outer wall, and the finger that presses on it.

    Attributes:
        width_mm: of the bead.
        layer_mm: height of a layer.
        skin: of the finger.
    """

    width_mm: float
    layer_mm: float
    skin: Skin


@cache
def roughness(wall: Wall, thickness_mm: float, point_distance_mm: float) -> float:
    """Mean roughness of a wall with a fuzzy skin, no unit; its points are drawn alike for every thickness."""
    side_mm, random = wall.skin.patch_mm or PATCH_SIDE_MM, np.random.default_rng(0)
    of_wall = wall.width_mm, wall.layer_mm, side_mm, PATCHES, random
    beads, places = fuzzy_wall(thickness_mm, point_distance_mm, *of_wall)
    surface = BeadSurface(beads, side_mm=wall.skin.patch_mm)
    heights = np.stack([surface.crop(place).heights for place in places])
    return float(pressed(heights, wall.skin, "layer", side_mm)[0][ROUGHNESS.name].mean())


def nearest(wall: Wall, target: float, point_distance_mm: float, most_mm: float) -> tuple[float, float]:
    """Thickness and point distance, mm, of the fuzzy skin whose roughness is nearest to a target.

    Args:
        wall: that becomes fuzzy.
        target: roughness that is wanted.
        point_distance_mm: kept, unless no thickness is rough enough with it.
        most_mm: largest thickness.
    """
    points, most = point_distance_mm, round(most_mm, 3)
    with stage("finding the fuzzy skin"):
        if roughness(wall, most, points) < target:
            sparse = max(points, SPARSEST_MM)
            if roughness(wall, most, sparse) <= target:
                return most, sparse
            points = _root(lambda each: roughness(wall, most, each) - target, points, sparse)
            points += FINEST_MM * (roughness(wall, most, points) < target)
        if roughness(wall, FINEST_MM, points) >= target:
            return FINEST_MM, points
        return _root(lambda each: roughness(wall, each, points) - target, FINEST_MM, most), points


def _root(excess: Callable[[float], float], low: float, high: float) -> float:
    """Where a function that is negative at `low` and positive at `high` is 0, in whole steps, mm."""
    return round(float(brentq(excess, low, high, xtol=0.5 * FINEST_MM)), 3)


SLICES, PLACES = 5, 12
"""Slices by which a fuzzy skin is judged, because its noise is random, and contact locations on each: the
mean over all is known to 0.7 %, as V differs by 5 % from place to place. (Where PrusaSlicer 2.5 has one
thread, it draws the same noise again; the mean is then known to 1.4 %.)"""
CLOSE_JND = 0.25
"""Largest just-noticeable differences from a target that counts as reached: 57 of 100 people name the rougher
of two surfaces that differ so little."""


@dataclass(frozen=True, eq=False)
class FuzzyProfile:
    """A profile whose fuzzy skin has a feel.

    Attributes:
        file: the profile that was written.
        profile: that was given.
        settings: that make the fuzzy skin, with their values.
        target: roughness that was asked for.
        roughness: of a computed wall with these settings, mean over contact locations.
        slices: (n,) the same of the sides of the part, by slice; empty if the part was not sliced or has no
            upright side as large as a finger.
        slicer: program that sliced; None: none.
    """

    file: Path
    profile: Profile
    settings: dict[Setting, str]
    target: float
    roughness: float
    slices: tuple[float, ...]
    slicer: str | None

    @property
    def jnd_from_target(self) -> float | None:
        """Just-noticeable differences of the slices' mean roughness from the target; None without slices."""
        return jnd_apart(float(np.mean(self.slices)), self.target) if self.slices else None

    def lines(self) -> Iterator[str]:
        """Sentences for a person: the numbers to type in first."""
        yield from self.profile.shown(self.settings)
        yield f"Sides: V {number(self.roughness)} as computed, target {number(self.target)}."
        if self.slices:
            mean, *ends = (number(float(of(self.slices))) for of in (np.mean, min, max))
            apart = f"{number(self.jnd_from_target, 2)} JND from the target"
            yield f"Sides of {SLICES} slices by {self.slicer}: V {mean} ({' to '.join(ends)}), {apart}."
        else:
            why = "has no side as large as a finger" if self.slicer else "was not sliced"
            yield f"The part {why}; retouch evaluate reads G-code."
        yield "Tops are as they were: fuzzy skin changes sides only."
        yield f"{self.file}: {self.profile.path} with these numbers"

    def as_json(self) -> dict[str, Any]:
        """What `retouch fuzzy --json` prints."""
        settings = {self.profile.key(setting): value for setting, value in self.settings.items()}
        texts = {"file": str(self.file), "profile": str(self.profile.path), "settings": settings}
        return {**vars(self), **texts, "jnd_from_target": self.jnd_from_target}


@by_keywords(FuzzyOptions)
def fuzzy(
    part: str | os.PathLike[str],
    profile: str | os.PathLike[str],
    out: str | os.PathLike[str],
    options: FuzzyOptions,
) -> FuzzyProfile:
    """Find the fuzzy skin by which the sides of a part feel as wanted, as `retouch fuzzy` does.

    Args:
        part: print file of a solid (STL, OBJ, PLY, GLB, 3MF, STEP), or the name of a bundled object.
        profile: process profile of PrusaSlicer or SuperSlicer (.ini), OrcaSlicer or Bambu Studio (.json).
        out: profile to write, with the fuzzy skin and everything else as it was.

    Raises:
        InputError: what is wrong with the input, or cannot be reached, in one line.
        ContactError: a contact does not converge.
    """
    checked(options)
    out, stated = Path(out), read_profile(Path(profile))
    check_file_to_write(out)
    goals = [name for name in ("feel_of", "roughness", "jnd") if getattr(options, name) is not None]
    if len(goals) != 1:
        raise InputError(
            "state one of feel_of, roughness and jnd", "state one of --feel-of, --roughness and --jnd"
        )
    if options.relief_mm is not None and options.feel_of is None:
        raise option_error("relief_mm", "is for the height map of a feel")
    here = stated.slicer == "PrusaSlicer" and shutil.which("prusa-slicer")
    if slicer := options.slicer or ("prusa-slicer" if here else None):
        check_slicer(slicer, stated.path)
    finger = options.skin if isinstance(options.skin, Skin) else load_skin(options.skin)
    wall = Wall(stated.wall_mm, stated.mm(profiles.LAYER), finger)
    # PrusaSlicer lays points farther out than half of wall and nozzle as overhangs, that is, round strands.
    most, points = 0.5 * (wall.width_mm + stated.mm(profiles.NOZZLE)), stated.mm(profiles.POINTS)
    with followed(options.progress, options.quiet):
        mesh = read_solid(part)
        target = _target(options, goals[0], stated, wall)
        aim = target
        # Slices rougher than computed walls, as PrusaSlicer 2.5 makes on fine facets, correct the aim once.
        for _ in range(2):
            found = nearest(wall, aim, points, most)
            settings, felt = stated.fuzzy_settings(*found), roughness(wall, *found)
            if abs(jnd_apart(felt, aim)) > CLOSE_JND:
                numbers = f"the nearest is V {number(felt)}, {', '.join(stated.shown(settings))}"
                raise option_error(goals[0], f"V {number(target)} is out of reach of fuzzy skin; {numbers}")
            content = stated.changed(settings)
            slices = judged(slicer, mesh, content, finger) if slicer else ()
            if not slices or abs(jnd_apart(float(np.mean(slices)), target)) <= CLOSE_JND:
                break
            aim *= target / float(np.mean(slices))
    write_atomically(out, content)
    return FuzzyProfile(out, stated, settings, target, felt, slices, slicer)


def judged(slicer: str, mesh: Mesh, profile: bytes, skin: Skin) -> tuple[float, ...]:
    """Roughness of a part's upright sides in five slices, at held-out contact locations.

    Raises:
        InputError: the slicer fails, or its G-code cannot be read.
        ContactError: a contact does not converge.
    """
    with tempfile.TemporaryDirectory() as folder, stage("judging slices"):
        (file := Path(folder) / "profile.ini").write_bytes(profile)
        solid = write_parts(Path(folder) / f"{mesh.path.stem}.stl", [Part(mesh.path.stem, mesh.body)])
        slices = [sliced(slicer, solid, file) for _ in range(SLICES)]
        felt = feel_of_beads(slices, skin, most=PLACES, without_texture=mesh, region="side")
    return tuple(feel.means[ROUGHNESS.name] for feel in felt)


def _target(options: FuzzyOptions, goal: str, profile: Profile, wall: Wall) -> float:
    """The roughness that is asked for. Raises InputError if it counts from nothing, or is smooth."""
    if options.jnd is not None:
        own = 0.0
        if profile.fuzzy and profile.classic:
            own = roughness(wall, profile.mm(profiles.THICKNESS), profile.mm(profiles.POINTS))
        if own < SMOOTH_BELOW:
            why = f"is {smooth_clause(own)}" if own else "is none, or no classic one"
            line = f"counts from the fuzzy skin of {profile.path}, which {why}"
            raise option_error(goal, f"{line}; state --roughness or --feel-of")
        target = jnd_scaled(own, options.jnd)
    elif options.feel_of is not None:
        lengths: Lengths = {} if options.relief_mm is None else {"relief_mm": options.relief_mm}
        target = evaluate(options.feel_of, skin=wall.skin, **lengths).roughness
    else:
        target = options.roughness or 0.0
    if not target >= SMOOTH_BELOW:
        raise option_error(goal, f"{smooth_clause(target)}; walls without fuzzy skin are smooth")
    return target
