"""Checks of many runs before the first of them begins: what one lacks is reported before hours of others."""

from collections.abc import Hashable, Mapping

from optimize.runs.preparation import check_look, checked_goals, scene_of
from optimize.settings.run_file import Run
from relief.ground.errors import InputError
from relief.ground.lengths import Lengths
from relief.ground.progress import stage


def faults_of(runs: Mapping[str, Run]) -> dict[str, InputError]:
    """What is wrong with runs as far as it is known without pressing and rendering, by their keys.

    A run takes milliseconds. The scene with its relief is loaded once for all runs that share both.
    """
    groups: dict[Hashable, dict[str, Run]] = {}
    for key, settings in runs.items():
        groups.setdefault(_pictured(settings), {})[key] = settings
    faults = dict[str, InputError]()
    with stage("checking the runs", len(groups)) as advance:
        for group in groups.values():
            try:
                scene = scene_of(next(iter(group.values())))
            except InputError as error:
                faults |= dict.fromkeys(group, error)
                group = {}
            for key, settings in group.items():
                try:
                    check_look(settings, scene)
                    checked_goals(settings, scene)
                except InputError as error:
                    faults[key] = error
            advance()
    return faults


def _pictured(settings: Run) -> Hashable:
    """What scene and relief of a run depend on."""
    keys = {"scene", "texture", "repeats", "define", "print", *Lengths.__annotations__}
    return settings.model_dump_json(include=keys)
