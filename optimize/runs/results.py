"""The run directory (design: result.json, heights, printable files, pictures, history, report)."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

import tactile
from optimize.descent.correction import Round
from optimize.descent.driver import Descent, Iterate
from optimize.descent.problem import Problem, Targets
from optimize.descent.verification import TouchMeasured
from optimize.report import metrics
from optimize.report.content import Baseline, Report
from optimize.report.page import write_report
from optimize.report.pictures import write_pictures
from optimize.runs.config import Run, dump_resolved
from relief.export import export_plate
from relief.files import write_atomically
from relief.heightmap import save_heights_exr, save_heights_png
from visual.noise import Batches

Array = NDArray[np.float64]

SETTINGS = "run.toml"
HISTORY = "history.jsonl"
WRITTEN = (
    *(SETTINGS, HISTORY, "checkpoint", "renders", "heights.exr", "heights.png"),
    *("plate.stl", "plate.3mf", "result.json", "report.html"),
)
"""What a run leaves in its directory."""
PACKAGES = ("retouch", "mitsuba", "drjit", "torch", "numpy", "scipy")


@dataclass(frozen=True)
class Outcome:
    """What was measured of a finished descent.

    Attributes:
        initial_roughness, initial_contact_area_mm2: of the original, by the model that steered the descent.
        touch_before, touch_after: of the original and of the best relief; by the verification, if any.
        rounds: of descent and verification; none if verification was not wanted.
        pictures_before, pictures_after: converged, with the same random numbers batch by batch.
        baseline_pictures: (conditions, rows, cols) radiance, converged; None where linear scaling cannot
            reach the target.
    """

    descent: Descent
    initial_roughness: float
    initial_contact_area_mm2: float
    touch_before: TouchMeasured
    touch_after: TouchMeasured
    rounds: tuple[Round, ...]
    pictures_before: Batches
    pictures_after: Batches
    baseline_heights: Array | None
    baseline_pictures: Array | None


class History:
    """history.jsonl: one line a step, appended, read back on resuming up to the step `after`.

    `aim` and `round` are those of the current round.
    """

    def __init__(self, run_dir: Path, aim: Targets, round_number: int, after: int) -> None:
        self._path, self.aim, self.round_number = run_dir / HISTORY, aim, round_number
        self.rows: list[dict[str, Any]] = []
        if self._path.is_file():
            # A kill may have cut the last line short; its step is not in the checkpoint, written after it.
            lines = self._path.read_text(encoding="utf-8").splitlines(keepends=True)
            rows = [json.loads(line) for line in lines if line.endswith("\n")]
            self.rows = [row for row in rows if row["step"] <= after]
            write_atomically(self._path, "".join(json.dumps(row) + "\n" for row in self.rows).encode())

    def trace(self) -> list[tuple[float, float]]:
        """Miss of the aim and picture change of every step of this round."""
        return [
            (self.aim.miss(row["roughness"], row["contact_area_mm2"]), row["picture_rms_percent"])
            for row in self.rows
            if row["step"] > 0 and row["round"] == self.round_number
        ]

    def add(self, iterate: Iterate, seconds: float) -> None:
        """Append an iterate."""
        row: dict[str, float | None] = {
            "step": iterate.step,
            "round": self.round_number,
            "roughness": iterate.roughness,
            "target_roughness": self.aim.roughness,
            "contact_area_mm2": iterate.contact_area_mm2,
            "picture_mean_percent": iterate.picture_mean,
            "picture_rms_percent": iterate.picture_rms,
            "seconds": seconds,
        }
        self.rows.append(row)
        with self._path.open("a", encoding="utf-8") as file:
            file.write(json.dumps(row) + "\n")


def write_settings(run_dir: Path, settings: Run) -> None:
    """run.toml: the run with every default written out."""
    write_atomically(run_dir / SETTINGS, dump_resolved(settings).encode())


def write(
    run_dir: Path,
    settings: Run,
    problem: Problem,
    outcome: Outcome,
    times: dict[str, float],
    history: list[dict[str, float | None]],
) -> dict[str, Any]:
    """Everything but run.toml, history and checkpoint, which are there; returns result.json's content."""
    heights = outcome.descent.best.heights
    save_heights_exr(run_dir / "heights.exr", heights)
    relief = float(heights.max()) or 1.0
    save_heights_png(run_dir / "heights.png", heights, relief)
    for suffix in (".stl", ".3mf"):
        export_plate(run_dir / f"plate{suffix}", heights, problem.size_mm)
    conditions = problem.scene.conditions
    before, after = outcome.pictures_before.mean, outcome.pictures_after.mean
    for stage, pictures in (("before", before), ("after", after)):
        write_pictures(run_dir / "renders", conditions, pictures, problem.scene.white, suffix=stage)
    summary = summarise(settings, problem, outcome, times)
    write_atomically(run_dir / "result.json", (json.dumps(summary, indent=2) + "\n").encode())
    baseline = None
    if outcome.baseline_pictures is not None:
        baseline = Baseline("linear scaling", outcome.baseline_pictures, problem.targets.roughness)
    write_report(
        run_dir,
        Report(
            title=settings.texture.stem,
            result=summary,
            conditions=conditions,
            pictures_before=before,
            pictures_after=after,
            white=problem.scene.white,
            strain_before=outcome.touch_before.strain,
            strain_after=outcome.touch_after.strain,
            heights_before=problem.heights,
            heights_after=heights,
            size_mm=problem.size_mm,
            history=history,
            heights_png_mm=(0.0, relief),
            pressure_before=outcome.touch_before.pressure,
            pressure_after=outcome.touch_after.pressure,
            tolerance=problem.targets.tolerance,
            settings=settings.model_dump(mode="json", exclude_none=True),
            baseline=baseline,
        ),
    )
    return summary


def summarise(settings: Run, problem: Problem, outcome: Outcome, times: dict[str, float]) -> dict[str, Any]:
    """The content of result.json."""
    best, reason = outcome.descent.best, outcome.descent.reason
    first, felt = outcome.touch_before, outcome.touch_after
    verified = felt if outcome.rounds else None
    jnd = None
    if first.roughness > 0.0 and felt.roughness > 0.0:
        jnd = tactile.jnd_apart(felt.roughness, first.roughness)
    change = best.heights - problem.heights
    return {
        "stop": {
            "reason": reason.name.lower(),
            "message": reason.value,
            "steps": outcome.descent.last.step,
            "best_step": best.step,
        },
        "touch": {
            "target_roughness": problem.targets.roughness,
            "initial_roughness": first.roughness,
            "roughness": best.roughness,
            "verified_roughness": None if verified is None else verified.roughness,
            "verified_by": None if verified is None else verified.by,
            "target_contact_area_mm2": problem.targets.contact_area_mm2,
            "initial_contact_area_mm2": first.contact_area_mm2,
            "contact_area_mm2": best.contact_area_mm2,
            "verified_contact_area_mm2": None if verified is None else verified.contact_area_mm2,
            "contact_fraction": felt.contact_fraction,
            "jnd_from_original": jnd,
        },
        "verification": {
            "resolution": None if verified is None else verified.mesh,
            "miss_percent": None
            if verified is None
            else 100.0 * problem.targets.miss(verified.roughness, verified.contact_area_mm2),
            "believed_initial_roughness": outcome.initial_roughness,
            "believed_initial_contact_area_mm2": outcome.initial_contact_area_mm2,
            "rounds": [asdict(r) for r in outcome.rounds],
        },
        "look": {
            "conditions": list(problem.scene.conditions),
            **metrics.look(outcome.pictures_before, outcome.pictures_after, problem.scene.white),
        },
        "heights": {
            "min_mm": float(best.heights.min()),
            "max_mm": float(best.heights.max()),
            "rms_change_mm": float(np.sqrt(np.square(change - change.mean()).mean())),
        },
        "time_s": times,
        "skin": {
            "young_modulus_mpa": problem.skin.young_modulus_mpa,
            "poisson_ratio": problem.skin.poisson_ratio,
            "force_n": problem.skin.force_n,
        },
        "versions": {name: version(name) for name in PACKAGES},
        "variant": problem.scene.variant,
        "seed": settings.seed,
    }
