"""Stimuli: labelled plates of a texture at several levels of feel, to print for experiments."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, Unpack

from mitsuba_scenes import find_texture
from optimize.settings.fast_models import FAST_MODELS
from relief.ground.errors import InputError
from relief.ground.files import only_writer
from relief.ground.lengths import Lengths
from relief.ground.progress import Progress, say
from relief.heightmap import check_scales
from retouch.laboratory.people.plan import check_answers, write_plan
from retouch.laboratory.people.serving.experiment_page import write_experiment_page
from retouch.laboratory.stimulus_sets.making import StimulusPlates, make
from retouch.laboratory.stimulus_sets.stimulus_set import FILE, StimulusSet
from retouch.laboratory.studies.engine import MakeRunner
from retouch.laboratory.workers.choice import runner
from retouch.verbs.progress_display import followed


def stimuli(
    textures: Sequence[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    *,
    jnd: Sequence[float] = (),
    contact_area_scale: Sequence[float] = (),
    same_roughness: bool = False,
    whole: bool = False,
    with_scaled: bool = False,
    sources: Sequence[str | os.PathLike[str]] = (),
    source_mm: float | None = None,
    controls: int | None = None,
    printer: str | None = None,
    skin: str | os.PathLike[str] | None = None,
    plates: Mapping[str, Any] | None = None,
    experiment: Mapping[str, Any] | None = None,
    fast: bool = False,
    settings: Mapping[str, Any] | None = None,
    workers: int | None = None,
    dask: str | None = None,
    quiet: bool | None = None,
    progress: Callable[[Progress], None] | None = None,
    **lengths: Unpack[Lengths],
) -> StimulusPlates:
    """Make plates that look like a texture and feel rougher or smoother by given levels, each verified.

    Args:
        textures: height maps or names of bundled ones: tiles, or with `whole` plates.
        out: folder to write to, or to go on in.
        jnd: levels of roughness, just-noticeable differences from the texture; 0 is the texture.
        contact_area_scale: levels of contact area in units of the texture's own.
        same_roughness: whether levels of contact area keep the texture's roughness.
        whole: whether a texture is no tile, but at least as large as a plate, and optimised as a whole.
        with_scaled: make each level of roughness also by scaling the heights.
        sources: for each texture the picture that it was cut from, of which other patches become plates.
        source_mm: width of these pictures, mm; None: as their headers say.
        controls: number of these patches; None: 3.
        printer: name of a printer, between whose prints each level is felt and seen.
        lengths: `size_mm`, `relief_mm` and `height_scale` of the textures, as in `Relief.read`.
        skin: of the finger, a name or a file.
        plates: `plate_mm`, `base_mm`, `bed_mm` and `label`, as in the section [print] of a set.
        experiment: `people`, `pairs`, `seed` and `codes` of the plan of trials, as in the section
            [experiment].
        fast: compute each step with the fast models.
        settings: any keys of a run file and their values, for every plate.
        workers, dask, quiet, progress: as in `study`.

    Raises:
        InputError: what is wrong with the textures or the levels, or the folder holds something else.
        KeyboardInterrupt: plates that are done stay; the same call goes on.
    """
    if not sources and (source_mm is not None or controls is not None):
        raise InputError(
            "source_mm, controls: are for sources, which are missing",
            "--source-mm, --controls: are for a --source, which is missing",
        )
    if not textures:
        fault = "stimuli: name a texture"
        raise InputError(fault, f"{fault}, as in retouch stimuli gravel-tile --jnd -1,0,1 -o DIR")
    own = {
        "jnd": jnd,
        "contact_area_scale": contact_area_scale,
        "same_roughness": same_roughness,
        "whole": whole,
        "with_scaled": with_scaled,
        "sources": [Path(source).absolute() for source in sources],
        "experiment": dict(experiment or {}),
        "source_mm": source_mm,
        "controls": controls,
    }
    settings = given_values({"print.printer": printer}) | dict(settings or {})
    request = StimulusSet.checked(
        plate_fields(textures, lengths, skin, plates, fast, settings) | given_values(own)
    )
    with followed(progress, quiet):
        return _made(request, Path(out), lambda work, observer: runner(work, workers, dask, observer))


def redraw_stimuli(
    out: str | os.PathLike[str],
    *,
    plates: Mapping[str, Any] | None = None,
    experiment: Mapping[str, Any] | None = None,
    quiet: bool | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> StimulusPlates:
    """Draw plates and page of a set anew, and compute nothing.

    Args:
        out: folder of the set.
        plates, experiment: what is to be different, as in `stimuli`.
        quiet, progress: as in `optimize`.

    Raises:
        InputError: the folder holds no set, or the plates cannot be made so.
    """
    there = StimulusSet.read(Path(out) / FILE)
    print_settings = {**there.print.model_dump(), **(plates or {})}
    trials = {**there.experiment.model_dump(), **(experiment or {})}
    request = StimulusSet.checked({**there.model_dump(), "print": print_settings, "experiment": trials})
    with followed(progress, quiet):
        return _made(request, Path(out), None)


def _made(request: StimulusSet, out: Path, make_runner: MakeRunner | None) -> StimulusPlates:
    """The set, with the plan of its experiment where two plates can be compared."""
    if (out / FILE).is_file() and StimulusSet.read(out / FILE).experiment != request.experiment:
        check_answers(out)
    made = make(request, out, make_runner)
    if not made.numbers.plates:
        return made
    try:
        with only_writer(out):
            plan = write_plan(out, request.experiment)
            page = (
                write_experiment_page(out, plan, f"Experiment: {', '.join(request.names)}") if plan else None
            )
    except InputError as error:
        # Plates that were not verified have no values to compare, and are plates all the same.
        say(f"no plan of an experiment: {error}")
        page = None
    return replace(made, experiment=page)


def given_values(values: Mapping[str, Any]) -> dict[str, Any]:
    """Those that are not None."""
    return {name: value for name, value in values.items() if value is not None}


def plate_fields(
    textures: Sequence[str | os.PathLike[str]],
    lengths: Lengths,
    skin: str | os.PathLike[str] | None = None,
    plates: Mapping[str, Any] | None = None,
    fast: bool = False,
    settings: Mapping[str, Any] | None = None,
) -> dict[str, Any]:
    """Fields that all requests for plates have (`PlateSet`); arguments as of `stimuli`. Raises InputError."""
    files = [find_texture(texture).absolute() for texture in textures]
    check_scales(files, lengths)
    if skin is not None:
        skin = str(Path(skin).absolute()) if Path(skin).is_file() else str(skin)
    own = (FAST_MODELS if fast else {}) | given_values({**lengths, "touch.skin": skin})
    return {"textures": files, "settings": own | dict(settings or {}), "print": dict(plates or {})}
