"""Everything that depends on the default finger, made anew by one command: tables, pictures, studies, nets.

python -m benchmarks.remake --dry-run        # what would be made, and CPU seconds where they are known
python -m benchmarks.remake                  # what was not yet made for the default finger of this tree
python -m benchmarks.remake skin tiles       # these alone
python -m benchmarks.remake --again          # all of them anew

Each part is a few commands, with a log in runs/remade. Its CPU seconds, and the finger that it was made for,
are kept in results/remake.json as soon as the part is done, so that an interrupted command goes on. A part
that fails is named, and the others are made all the same.
"""

from __future__ import annotations

import shlex
import shutil
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import IO, Any

from benchmarks.shared.common import ROOT, cpu_s, load, machine, parser_of, save, table
from benchmarks.shared.finished_studies import FILE, STUDIES
from relief.ground.formatting import duration
from relief.ground.progress import say
from tactile.skin import Skin

RUNS = Path("runs") / "remade"
"""Folder of the logs, studies and runs that are made on the way, from the root of the checkout."""
STUDY = "retouch study"


@dataclass(frozen=True)
class Part:
    """Something that is made.

    Attributes:
        makes: what, in words.
        commands: `retouch` and modules of Python, in order; {runs} is the folder of the runs.
        study: name under which the document of the study that it runs is committed.
    """

    makes: str
    commands: tuple[str, ...]
    study: str | None = None


def study(
    name: str,
    makes: str,
    *then: str,
    file: str | None = None,
    kept: bool = True,
    before: tuple[str, ...] = (),
) -> Part:
    """A part that is a study, modules that come before, and those that read it."""
    commands = (*before, f"{STUDY} {file or name} -o {{runs}}/{name}", *then)
    return Part(makes, commands, name if kept else None)


PARTS: Mapping[str, Part] = {
    "net": Part(
        "the data and the nets of touch and of the fast look, and their tables",
        (
            "-m benchmarks.learned.optimised {runs}/optimised",
            "retouch dataset -o {runs}/data --count 2816 --directions 1 --optimised {runs}/optimised",
            "retouch train touch --data {runs}/data -o {runs}/nets/touch --epochs 16",
            "copy {runs}/nets/touch/touch.safetensors surrogate/weights",
            "copy {runs}/nets/touch/touch.json surrogate/weights",
            "-m benchmarks.learned.touch_net --optimised {runs}/optimised",
            "-m benchmarks.learned.fast_look --optimised {runs}/optimised",
        ),
    ),
    "shipped": Part("operators of the named round fingers", ("-m benchmarks.touch.shipped",)),
    "skin": Part("calibration of the measured finger", ("-m benchmarks.skin --again",)),
    "published": Part("the scoreboard of published findings", ("-m benchmarks.skin.published --again",)),
    "round": Part("elements of a round pad", ("-m benchmarks.skin.round_truth --again",)),
    "own_finger": Part(
        "spherical fingertips of tetrahedra beside round fingers", ("-m benchmarks.touch.own_finger --again",)
    ),
    "contact": Part(
        "models of touch beside the finest",
        ("-m benchmarks.touch.contact --again", "-m benchmarks.touch.sampling --again"),
    ),
    "demo": study("demo", "the demo runs and their picture", "-m benchmarks.runs.demo_figure {runs}/demo"),
    "tiles": study("tiles", "ten tiles all over"),
    "plates": study(
        "plates",
        "plates of 25 mm",
        file="benchmarks/surfaces/plates.toml",
        before=("-m benchmarks.surfaces.plates",),
    ),
    "varied": study(
        "varied",
        "a feel that varies over a strip",
        "-m benchmarks.surfaces.varied {runs}/varied",
        "-m benchmarks.surfaces.slider_figure {runs}/varied",
        file="benchmarks/surfaces/varied.toml",
        before=("-m benchmarks.surfaces.varied textures",),
        kept=False,
    ),
    "fingers": study(
        "fingers",
        "a range of fingers",
        "-m benchmarks.surfaces.fingers {runs}/fingers",
        file="benchmarks/surfaces/fingers.toml",
        kept=False,
    ),
    "crossed": study(
        "crossed",
        "tiles optimised for one finger, felt by others",
        "-m benchmarks.surfaces.fingers_crossed {runs}/crossed",
        file="benchmarks/surfaces/fingers_crossed.toml",
        kept=False,
    ),
    "surface_bands": study(
        "surface_bands",
        "the surface of the skin by wavelength",
        "-m benchmarks.surfaces.surface_bands",
        file="benchmarks/surfaces/surface_bands.toml",
    ),
    "range": study("range", "how far the feel of textures can be moved"),
    "front": study("front", "change of the pictures over the change of the feel"),
    "same-feel": study(
        "same-feel", "different looks with one feel", "-m benchmarks.surfaces.same_feel {runs}/same-feel"
    ),
    "eye": study("eye", "what the eye sees by what steps keep", "-m benchmarks.sight.eye"),
    "in-hand": study(
        "in-hand", "what is kept from the sides, in the hand", "-m benchmarks.sight.hand {runs}/in-hand"
    ),
    "exact-vs-surrogate": study("exact-vs-surrogate", "what exactness buys"),
    **{
        f"figure{number}": study(f"figure{number}", f"figure {number} of the paper")
        for number in (3, 10, 11, 15, 17, 19, 22)
    },
    "paper": Part("the paper's other figures and claims", ("-m benchmarks.paper",)),
    "stimuli": Part(
        "a set of plates in numbers",
        (
            "retouch stimuli gravel-tile bark-tile knit-tile leather-tile pebbles-tile weave-tile "
            "--jnd -2,-1,0,1,2 -o {runs}/stimuli",
            "-m benchmarks.surfaces.stimuli {runs}/stimuli",
        ),
    ),
    "palettes": Part(
        "fills that are told apart by touch", ("-m benchmarks.surfaces.palettes {runs}/palettes",)
    ),
    "objects": Part(
        "objects: their feel, the paper's, the pictures",
        (
            "-m benchmarks.objects.bundled --again",
            "retouch study benchmarks/objects/tiles.toml -o runs/paper-objects",
            "-m benchmarks.objects.paper_objects --again",
            "-m benchmarks.objects.curved --again",
            "-m benchmarks.objects.pairs_figure",
            "-m benchmarks.touch.mesh_feel --again",
            "-m benchmarks.objects.plates --again",
        ),
    ),
    "prints": study(
        "prints",
        "prints of runs with and without a printer",
        "-m benchmarks.prints.pairs {runs}/prints",
        "-m benchmarks.prints.as_printed --again",
        file="benchmarks/prints/pairs.toml",
        kept=False,
    ),
    "filament": Part(
        "beads of slicers, and how filament feels by profile",
        tuple(
            f"-m benchmarks.prints.{name} --again" for name in ("filament", "filament_guide", "fuzzy_targets")
        ),
    ),
    "first-mile": Part("pictures from outside, by the README alone", ("-m benchmarks.runs.first_mile",)),
    "stability": Part("where the models hold", ("-m benchmarks.stability.sweep --again",)),
    "whole_run": Part("seconds and memory of whole runs", ("-m benchmarks.whole_run --again",)),
    "tutorials": Part(
        "the commands of start page and tutorials, and their figures",
        ("-m benchmarks.docs.tutorials", "-m benchmarks.docs.figures"),
    ),
    "drafts": Part("drafts of the app beside the runs that follow", ("-m benchmarks.docs.drafts --again",)),
    "pages": Part(
        "the tables of docs/evidence and docs/reference, and the numbers of the README",
        ("-m benchmarks.docs.measured", "-m benchmarks.docs.reference"),
    ),
}
"""By name, in the order in which they are made: later parts read what earlier ones left."""


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("parts", nargs="*", metavar="PART", help=f"of: {', '.join(PARTS)}")
    parser.add_argument("--again", action="store_true", help="also what was made for this finger")
    parser.add_argument("--dry-run", action="store_true", help="list the parts and make nothing")
    arguments = parser.parse_args()
    if unknown := [name for name in arguments.parts if name not in PARTS]:
        parser.error(f"{unknown[0]} is not one of {', '.join(PARTS)}")
    wanted = left(arguments.parts or list(PARTS), load("remake").get("parts", {}), arguments.again)
    if arguments.dry_run:
        print(listed(wanted, load("remake").get("parts", {})))
        return
    failed = [name for name in wanted if not make(name)]
    if failed:
        sys.exit(f"not made: {', '.join(failed)}; their logs are in {RUNS}")


def left(names: Sequence[str], done: Mapping[str, Any], again: bool) -> list[str]:
    """The parts that are to be made, of those named."""
    finger = asdict(Skin())
    return [name for name in PARTS if name in names and (again or done.get(name, {}).get("finger") != finger)]


def listed(names: Sequence[str], done: Mapping[str, Any]) -> str:
    """What each part makes, and its CPU seconds where they are known."""
    rows = [(name, PARTS[name].makes, done.get(name, {}).get("cpu_s", "not known")) for name in names]
    return table(("part", "makes", "CPU seconds"), rows)


def make(name: str) -> bool:
    """Make one part, and keep what it took; False if a command failed."""
    part, log = PARTS[name], ROOT / RUNS / f"{name}.log"
    say(f"{name}: {part.makes}")
    log.parent.mkdir(parents=True, exist_ok=True)
    began = cpu_s()
    with log.open("wb") as out:
        for command in part.commands:
            if (status := _run(shlex.split(command.format(runs=RUNS)), out)) not in _ALLOWED:
                say(f"{name}: {command} ended with {status}, see {log.relative_to(ROOT)}")
                return False
            # The documents of studies are committed, and modules that come next read them.
            if part.study is not None and command.startswith(STUDY):
                shutil.copy(ROOT / RUNS / name / FILE, STUDIES / f"{part.study}.json")
    seconds = round(cpu_s() - began)
    done = load("remake").get("parts", {}) | {name: {"finger": asdict(Skin()), "cpu_s": seconds}}
    save("remake", {"parts": done, "machine": machine()})
    say(f"{name}: made, {duration(seconds)} of CPU time")
    return True


_ALLOWED = (0, 3)
"""Exit statuses of what is done: 3 is that of a study some rows of which ended short of their target."""


def _run(words: Sequence[str], log: IO[bytes]) -> int:
    """Exit status of a command of a part."""
    if words[0] == "copy":
        shutil.copy(*(ROOT / word for word in words[1:]))
        return 0
    python = [sys.executable, *(("-m",) if words[0] == "retouch" else ()), *words]
    return subprocess.run(python, cwd=ROOT, stdout=log, stderr=subprocess.STDOUT).returncode


if __name__ == "__main__":
    main()
