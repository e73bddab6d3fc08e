"""`retouch optimize`: change how a texture feels while it keeps its look.

Changes the relief until the finger feels the target, while the pictures of the scene change as little as
possible. Takes a texture with a target, or a run file (.toml), which says everything; options override the
run file. A texture lies in the scene `studio`, or in the one that --scene names.

examples:
  retouch optimize stone.png --relief-mm 1.2 --jnd 2
  retouch optimize stone.exr --contact-area-scale 0.7 --scene scene.xml -o runs/cold
  retouch optimize stone.png --relief-mm 1.2 --jnd 2 --printer mask-50
  retouch optimize stone.png --relief-mm 1.2 --jnd 2 --dry-run
  retouch optimize knit --feel-of brick
  retouch optimize gravel
  retouch optimize gravel --jnd 1 --fast --set descent.tolerance=0.005 -o runs/gravel-1

RUN_DIR then holds report.html (the overview), plate.stl and plate.3mf to print, heights.exr and heights.png,
the pictures before and after, and result.json with every number; -v prints more of them.

{STATUSES}
"""

import argparse
import os
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import retouch
from mitsuba_scenes import DEFAULT_SCENE, find_file, find_texture
from optimize.descent.stop_reason import StopReason
from optimize.run_directory.earlier import checkpoint_stamp, resume_advice
from optimize.runs.interrupts import INTERRUPTED
from optimize.settings.fast_models import FAST_MODELS
from optimize.settings.run_options import run_options, run_overrides, states_a_target
from relief.ground.errors import InputError
from relief.ground.formats import HEIGHT_MAPS, HEIGHTS
from relief.ground.options import add_options, declared, given, literal
from retouch.commands import options
from retouch.commands.summary import summary

if TYPE_CHECKING:
    from optimize.verification.verification import Verification
    from retouch import Run

REACHED = 0
SHORT_OF_TARGET = 3
"""Exit status of a run that ended before the target was reached."""

STATUSES = """\
exit status: 0 if the target was reached; 3 if the run ended short of the target; 2 for bad input; 130 if
interrupted (Ctrl-C). After 3 and 130 the best result is written, and `retouch resume` can continue the run.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    text = f"{options.TEXTURE}; or run file; or scene (.xml) for --texture"
    options.add(parser, "source TEXTURE|RUN.toml", text, type=Path)
    options.add_out(parser, "RUN_DIR", "folder to write to (default: runs/<name of the run file or texture>)")
    options.add(parser, "--force", "replace an earlier run in RUN_DIR")
    text = "only check everything, and estimate time and memory of the run; write nothing"
    options.add(parser, "--dry-run", text)
    options.add_talk(parser, "the content of result.json, with the files written,")

    groups = add_options(parser, run_options())
    options.add_repeats(groups["the plate"], "the run file's")
    details = groups["details"]
    text = "any key of the run file, as in descent.steps=20 or touch.force_n=2; may be given several "
    text += "times; overrides every other option"
    options.add(details, "--set KEY=VALUE", text, dest="settings", action="append", default=[])
    options.add_mitsuba(details)


def after_interrupt(arguments: argparse.Namespace) -> str:
    """End of the line that an interrupt prints; before `run`, any checkpoint is of an earlier run."""
    out: Path | None = arguments.out
    now = None if out is None else checkpoint_stamp(out)
    if now is not None and now == getattr(arguments, "earlier", now):
        return f"; no step of this run is written, and {out} still holds the earlier run"
    return how_to_go_on(out)


def how_to_go_on(run_dir: Path | None) -> str:
    """How to go on with a run, as the end of a line; empty if there is nothing to go on from."""
    advice = "" if run_dir is None else resume_advice(run_dir)
    return f"; {advice}" if advice else ""


def run(arguments: argparse.Namespace) -> int:
    settings = load(arguments)
    settings.check_texture()
    name = arguments.source if _is_run_file(arguments.source) else settings.texture
    out = arguments.out = arguments.out or Path("runs") / name.stem
    arguments.earlier = checkpoint_stamp(out)
    _refuse_inputs_in(out, (arguments.source, *settings.files().values()))
    with options.contact_errors_name(settings.texture):
        if arguments.dry_run:
            return _forecast(settings, out, arguments)
        result = retouch.optimize(
            settings, out, variant=arguments.variant, force=arguments.force, quiet=arguments.quiet
        )
    return finish(result.verification, result.run_dir, arguments)


def load(arguments: argparse.Namespace) -> "Run":
    """The run that the arguments describe. Raises InputError."""
    source = arguments.source = find_file(arguments.source, ".toml", ".xml", *HEIGHT_MAPS)
    if arguments.texture is not None:
        arguments.texture = find_texture(arguments.texture)
    scene, texture = _scene_and_texture(arguments)
    settings, shared = overrides(arguments), FAST_MODELS if arguments.fast else ()
    if texture is None:
        return retouch.load_run(source, settings, shared=shared)
    if not states_a_target(settings):
        raise InputError(
            f"{source}: no target: give --roughness, --jnd, --feel-of, or one for the contact area"
        )
    return retouch.run_from_scene(scene, texture, settings, shared=shared)


def _scene_and_texture(arguments: argparse.Namespace) -> tuple[Path, Path | None]:
    """The scene and the texture of a run without a run file; no texture if the source is a run file.

    Raises:
        InputError: the source is of no known kind, or one thing is given twice.
    """
    source, scene, texture = arguments.source, arguments.scene, arguments.texture
    if _is_run_file(source):
        return source, None
    if texture is not None:
        if source.suffix.lower() in HEIGHTS:
            raise InputError(f"--texture: {texture}: there is a texture already, {source}")
        if scene is not None:
            raise InputError(f"--scene: {scene}: there is a scene already, {source}")
        return source, texture
    if source.suffix.lower() == ".xml":
        raise InputError(
            f"{source}: a scene needs --texture, a height map, as well; a run file ends in .toml"
        )
    return find_file(scene or DEFAULT_SCENE, ".xml"), source


def overrides(arguments: argparse.Namespace) -> list[str]:
    """The options as overrides of a run file, `--set` last. Raises InputError if `--feel-of` is no file."""
    values = given(arguments, *declared(run_options()))
    # The folder of a run is left to the run file's reader, which also asks whether its result is a tile.
    if (other := values.get("feel_of")) and not other.is_dir():
        values["feel_of"] = find_texture(other)
    settings = run_overrides(values)
    settings += [f"define.{key}={literal(value)}" for key, value in arguments.defines]
    if arguments.repeats is not None:
        settings.append(f"repeats={literal(arguments.repeats)}")
    return [*settings, *arguments.settings]


def finish(result: "Verification", run_dir: Path, arguments: argparse.Namespace) -> int:
    """Print the summary of a run as wanted; returns the exit status.

    Args:
        result: what was measured of the result.
        run_dir: folder of the run.
        arguments: of the command, with `json` and `quiet`.
    """
    stop = StopReason[result.stop.reason.upper()]
    status = INTERRUPTED if stop is StopReason.INTERRUPTED else REACHED if stop.met else SHORT_OF_TARGET
    files = sorted(str(path) for path in run_dir.rglob("*") if path.is_file())
    document = {"run_dir": str(run_dir), "exit_status": status, **result.as_json(), "files": files}
    options.report(arguments, document, summary(result, run_dir, arguments.verbose))
    return status


def _forecast(settings: "Run", out: Path, arguments: argparse.Namespace) -> int:
    """Check a run and print what it takes; returns the status of success. Raises InputError."""
    estimate = retouch.forecast(settings, out, variant=arguments.variant, force=arguments.force)
    lines = [*estimate.lines(), ("folder", f"{out}, nothing written yet")]
    return options.report(arguments, {"run_dir": str(out), **estimate.as_json()}, lines)


def _refuse_inputs_in(out: Path, inputs: Iterable[Path]) -> None:
    """Raise InputError if `out`, which `--force` empties, is or holds a file that the run reads."""
    for path in inputs:
        if Path(os.path.realpath(path)).is_relative_to(os.path.realpath(out)):
            raise InputError(f"{out}: -o: is or holds {path}, which the run reads; choose another folder")


def _is_run_file(path: Path) -> bool:
    return path.suffix.lower() == ".toml"
