"""A stimulus set from its request: rows by the engine of studies, plates to print, tables and the page."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from optimize.run_directory.finished_run import read_result
from relief.ground.files import only_writer, write_atomically
from relief.ground.formatting import duration
from relief.ground.progress import say, stage
from retouch.laboratory.stimulus_sets import document as documents
from retouch.laboratory.stimulus_sets.controls import check_sources, make_controls
from retouch.laboratory.stimulus_sets.levels import plate_rows, write_study_file
from retouch.laboratory.stimulus_sets.page import page
from retouch.laboratory.stimulus_sets.plate_set import claim
from retouch.laboratory.stimulus_sets.plates import FOLDER, check_labels, write_plates
from retouch.laboratory.stimulus_sets.stimulus_set import StimulusSet
from retouch.laboratory.studies import engine
from retouch.laboratory.studies.document import document
from retouch.laboratory.studies.page import page as study_page
from retouch.laboratory.studies.page import write_files
from retouch.laboratory.studies.rows import expand
from retouch.pages.sentences import TextTable
from tactile.jnd import smooth_clause

PAGE, STUDY_PAGE = "index.html", "study.html"
"""The page of a set, and that of its study."""


@dataclass(frozen=True)
class StimulusPlates:
    """What became of a set.

    Attributes:
        folder: of the set.
        numbers: of the set.
        files: to print.
        missing: number of plates that are neither done nor failed.
        experiment: page that shows the trials and takes answers; None where no two plates can be compared.
    """

    folder: Path
    numbers: documents.SetNumbers
    files: tuple[Path, ...]
    missing: int
    experiment: Path | None = None

    @property
    def page(self) -> Path:
        """The page."""
        return self.folder / PAGE

    @property
    def content(self) -> dict[str, Any]:
        """The content of `stimuli.json`, with all digits."""
        return asdict(self.numbers)

    def as_json(self) -> dict[str, Any]:
        """What `retouch stimuli --json` prints."""
        files = [*map(str, (self.page, *self.files))]
        experiment = None if self.experiment is None else str(self.experiment)
        return {"folder": str(self.folder), **self.content, "files": files, "experiment": experiment}

    def lines(self, seconds: float | None = None) -> Iterator[str | TextTable]:
        """Lines and the table of the plates for a person; `seconds` that the set took, if it was computed."""
        headings = ["plate", "kind", "felt, JND", "over places", "contact, mm²", "pictures, %"]
        if any(plate.jod is not None for plate in self.numbers.plates):
            headings.append("JOD")
        rows = [_cells(plate)[: len(headings)] for plate in self.numbers.plates]
        yield TextTable([(heading, "") for heading in headings], rows, gap=1)
        if smooth := [plate.roughness for plate in self.numbers.plates if plate.jnd is None]:
            yield smooth_clause(min(roughness or 0.0 for roughness in smooth))
        summary = self.numbers.summary
        if summary.neighbours_percent is not None:
            yield (
                f"neighbouring levels should be told right in {summary.neighbours_percent:.0f} % of tries "
                f"(the paper's participants: {summary.paper_neighbours_percent:.0f} %), whole sets in "
                f"{summary.sorted_percent:.0f} %"
            )
        yield from self.numbers.failures
        if self.experiment is not None:
            yield f"trials and answers: {self.experiment}"
        missing = f"; {self.missing} plates not computed yet" if self.missing else ""
        took = "" if seconds is None else f", {duration(seconds)}"
        yield f"{self.page}: {summary.plates} plates{missing}{took}"
        for file in self.files:
            yield f"to print: {file}"


def _cells(plate: documents.PlateNumbers) -> list[str]:
    """Cells of a plate; what it lacks is empty."""
    ends = (plate.jnd_least, plate.jnd_most)
    cells = (
        ("smooth" if plate.jnd is None else f"{plate.jnd:+.2f}", "s"),
        (None if None in ends else " to ".join(f"{end:+.2f}" for end in ends), "s"),
        (plate.contact_area_mm2, ".3g"),
        (plate.picture_change_percent, ".2g"),
        (plate.jod, ".2f"),
    )
    return [plate.label, plate.kind, *("" if value is None else format(value, form) for value, form in cells)]


def make(stimuli: StimulusSet, out: Path, make_runner: engine.MakeRunner | None) -> StimulusPlates:
    """Make a set, or what of it is missing, and write every file.

    Args:
        stimuli: the set.
        out: its folder.
        make_runner: of the runner of rows; None computes nothing and draws what is there.

    Raises:
        InputError: a texture is no tile, a source is too small, a label or a plate does not fit, or the
            folder holds something else, or another command writes into it.
        OSError, KeyboardInterrupt: rows that are done stay; the same call goes on.
    """
    stimuli.check_textures()
    check_sources(stimuli)
    with only_writer(out):
        claim(out, stimuli)
        (out / engine.ROWS).mkdir(exist_ok=True)
        study = write_study_file(stimuli, make_controls(stimuli, out), out)
        expanded = expand(study)
        plates = list(plate_rows(stimuli, expanded))
        check_labels([plate.on_back for plate in plates], stimuli.print)
        if make_runner is None:
            rows = engine.known(expanded, out, study.measures)
        else:
            rows = engine.compute(expanded, out, make_runner, study.measures, what="plates")
        of_study = document(study, expanded, rows, quick=False)
        write_files(out, of_study, study_page(of_study, out), STUDY_PAGE)
        done = documents.plates_done(plates, rows, out)
        textures, files = [], list[Path]()
        for name in stimuli.names:
            own = [plate for plate in done if plate.plan.texture == name]
            tiles = {plate.plan.on_back: read_result(plate.folder, repeats=False) for plate in own}
            printed = write_plates(out, name, tiles, stimuli) if tiles else []
            files += printed
            with stage(f"pairs of {name}"):
                paths = [path.relative_to(out).as_posix() for path in printed]
                textures.append(documents.texture_numbers(name, own, paths))
        if stimuli.label_advice is not None:
            say(stimuli.label_advice)
        for old in set((out / FOLDER).glob("*.3mf")) - set(files):
            old.unlink()
        numbers = documents.SetNumbers(
            textures=textures,
            summary=documents.summary_of(textures),
            failures=[*expanded.faults, *(f"{key[:12]}: {why}" for key, why in rows.failures.items())],
        )
        write_atomically(out / documents.DOCUMENT, documents.document_bytes(asdict(numbers)))
        for file, spread in documents.spreadsheets(numbers).items():
            write_atomically(out / file, spread)
        write_atomically(out / PAGE, page(numbers, stimuli, out))
        missing = len(expanded.rows) - len(rows.records) - len(rows.failures)
        return StimulusPlates(out, numbers, tuple(files), missing)
