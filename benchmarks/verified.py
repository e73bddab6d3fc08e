"""Whole runs verified by finite elements: roughness, contact area, both together.

python -m benchmarks.verified             # every case that is not in the results yet
python -m benchmarks.verified area        # one group: roughness, area, joint
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

import optimize
from benchmarks.common import load, machine, save, table
from benchmarks.reliefs import SIZE_MM, further, twelve
from benchmarks.runs import RELIEFS
from optimize.runs.config import Run, load_run, run_from_scene
from relief.heightmap import save_heights_exr

STUDIO = "mitsuba_scenes/studio.xml"
AREA_SCALES = (0.7, 1.4)
"""The paper's, of the original contact area."""
FULL = 0.95
"""Share of the plate above which a contact area is out of reach."""
JOINT = ((2.0, 0.8), (-2.0, 1.2))
"""JND and scale of the contact area, asked for together."""


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("groups", nargs="*", default=["roughness", "area", "joint"])
    parser.add_argument("--again", action="store_true")
    arguments = parser.parse_args()
    results = load("verified") or {"rows": {}}
    results["machine"] = machine()
    with tempfile.TemporaryDirectory() as folder:
        for name, group, run in cases(Path(folder)):
            if group in arguments.groups and (arguments.again or name not in results["rows"]):
                results["rows"][name] = {"group": group} | measure(run, Path(folder) / "out")
                save("verified", results)
                print(name, results["rows"][name], flush=True)
    print(as_table(results["rows"]))


def cases(folder: Path) -> list[tuple[str, str, Run]]:
    """(name, group, run)."""
    found = []
    for texture in RELIEFS:
        for jnd in (-2, 2):
            run = load_run(f"mitsuba_scenes/{texture}.toml", [f"touch.jnd={jnd}"])
            found.append((f"{texture} {jnd:+d} JND", "roughness", run))
        for both, scale in JOINT:
            overrides = [f"touch.jnd={both}", f"touch.contact_area_scale={scale}"]
            run = load_run(f"mitsuba_scenes/{texture}.toml", overrides)
            found.append((f"{texture} {both:+.0f} JND, area x {scale:g}", "joint", run))
    for name, heights in (twelve() | further()).items():
        path = folder / f"{name.replace(' ', '-')}.exr"
        save_heights_exr(path, heights)
        for scale in AREA_SCALES:
            run = run_from_scene(STUDIO, path, [f"touch.contact_area_scale={scale}"])
            found.append((f"{name}, area x {scale:g}", "area", run))
    return found


def measure(run: Run, out: Path) -> dict[str, Any]:
    """One run; misses in % of the target, by the truth; picture changes in % of the mean picture."""
    result = optimize.run(run, out, force=True)
    told = result.summary
    touch, look = told["touch"], told["look"]

    def miss(kind: str) -> float | None:
        target = touch[f"target_{kind}"]
        return None if target is None else 100.0 * (touch[f"verified_{kind}"] / target - 1.0)

    rounds = told["verification"]["rounds"]
    return {
        "target_area_mm2": touch["target_contact_area_mm2"],
        "reason": told["stop"]["reason"],
        "steps": told["stop"]["steps"],
        "rounds": len(rounds),
        "roughness_miss_percent": miss("roughness"),
        "area_miss_percent": miss("contact_area_mm2"),
        "first_miss_percent": 100.0 * rounds[0]["miss"],
        "picture_mean_percent": look["change_percent"],
        "picture_rms_percent": look["change_rms_percent"],
        "max_mm": told["heights"]["max_mm"],
        "seconds": told["time_s"],
    }


def as_table(rows: dict[str, dict[str, Any]]) -> str:
    """Markdown, with the mean and the largest error below."""
    head = (
        *(
            "texture and target",
            "stop",
            "outer iterations",
            "steps",
            "V off, %",
            "A off, %",
            "off at first, %",
        ),
        *("pictures mean, %", "rms, %"),
    )
    lines = [
        [
            *(name, row["reason"], row["rounds"], row["steps"]),
            *(row["roughness_miss_percent"], row["area_miss_percent"], row["first_miss_percent"]),
            *(row["picture_mean_percent"], row["picture_rms_percent"]),
        ]
        for name, row in rows.items()
    ]
    text = table(head, lines)
    for group, key in (("roughness", "roughness_miss_percent"), ("area", "area_miss_percent")):
        misses = [abs(r[key]) for r in rows.values() if r["group"] == group and not beyond(r)]
        if misses:
            text += (
                f"\n\n{group}, {len(misses)} targets: off by {np.mean(misses):.2f} % on average, "
                f"{np.max(misses):.2f} % at most"
            )
    return text


def beyond(row: dict[str, Any]) -> bool:
    """Whether nearly the whole plate would have to be touched: no relief that looks like the original is."""
    return (row["target_area_mm2"] or 0.0) > FULL * SIZE_MM**2


if __name__ == "__main__":
    main()
