"""Scans of prints: laid on their design, pressed and rendered, and what they show, for JSON and a person."""

import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import repeat
from pathlib import Path
from typing import Any

import numpy as np

from relief.ground.arrays import Array
from relief.ground.errors import naming
from relief.ground.files import permitted, write_atomically
from relief.ground.progress import Progress, stage
from relief.heightmap import check_heights, save_heights_exr
from relief.relief import Relief
from relief.scans.blurred import samples_mm
from relief.scans.loss import half_kept_mm
from relief.scans.print_summary import PrintScanned, print_scanned
from relief.scans.registration import NORMAL_95, Interval, register
from relief.scans.scan_files import ScanLengths, read_scan
from retouch.pages.compared import Compared
from retouch.pages.scan import PAGE, write_scan_page
from retouch.pages.sentences import interval, smooth_change
from retouch.verbs.comparison import CompareOptions, compared
from retouch.verbs.progress_display import followed
from retouch.verbs.subjects import Subject, read_subject
from tactile.jnd import jnd_unless_smooth
from tactile.measures import measure_touch
from tactile.model import ModelName
from tactile.quantities import ROUGHNESS
from tactile.skin import Skin


@dataclass(frozen=True, eq=False)
class FeltPrint:
    """A print and how it feels.

    Attributes:
        shown: the print as its scan shows it.
        roughness: V of the print; the interval takes in noise of the scan.
        jnd: just-noticeable differences from the design, with the ends of the interval; None if smooth.
        of_design: V of the design.
        flat: V of the print without its bow.
        jnd_flat: just-noticeable differences of the print without its bow from the design.
    """

    shown: PrintScanned
    roughness: Interval
    jnd: tuple[float | None, float | None, float | None]
    of_design: float
    flat: float
    jnd_flat: float | None

    def as_json(self) -> dict[str, Any]:
        """The numbers of the print: where it lies, what was lost, and how it feels."""
        jnd, low, high = self.jnd
        return {
            "file": self.shown.registration.scan.name,
            **self.shown.numbers(),
            **self.roughness.as_json("roughness"),
            **{"jnd_from_design": jnd, "jnd_from_design_low": low, "jnd_from_design_high": high},
            **{"roughness_flat": self.flat, "jnd_from_design_flat": self.jnd_flat},
            "kept": self.shown.kept.as_json(),
            "notes": self.notes(),
        }

    def lines(self) -> Iterator[tuple[str, str]]:
        """A word and a sentence each, for a person."""
        found, blur = self.shown.registration, self.shown.registration.blur_mm
        x, y = found.shift_x_mm.value, found.shift_y_mm.value
        yield "scan", f"{found.scan.name}, {self.shown.covered_percent:.0f} % of the plate"
        turned = _text(found.turned_degrees, ".3f")
        yield "lies", f"turned by {turned} degrees, shifted by {x:.3f}, {y:.3f} mm"
        height = _text(found.height_scale, ".3f")
        yield "size", f"{_text(found.scale, '.4f')} in the plane, {height} in height"
        left = f"half is left of periods of {half_kept_mm(blur).value:.2f} mm"
        yield "blur", f"{_text(blur.times(1000.0), '.1f')} um; {left}"
        if self.jnd[0] is None:
            yield "feel", smooth_change(self.of_design, self.roughness.value)
        else:
            yield "feel", f"{interval(*self.jnd, '+.2f')} JND from the design"
        for note in self.notes():
            yield "note", note

    def notes(self) -> list[str]:
        """Warnings for a person, a line each."""
        lines, sag = self.shown.notes(), self.shown.registration.sag_mm.value
        if self.flat != self.roughness.value:
            flat = "smooth" if self.jnd_flat is None else f"{self.jnd_flat:+.2f} JND from the design"
            lines.append(
                f"the scan is bowed by {sag:.2g} mm; pressed flat, or if the scanner made the bow, the print "
                f"is {flat}"
            )
        return lines


def _text(measured: Interval, form: str) -> str:
    return interval(measured.value, measured.low, measured.high, form)


@dataclass(frozen=True, eq=False)
class ScannedPrint:
    """A print beside its design.

    Attributes:
        design: file of the design.
        prints: the print and, if there is one, a second print of the same design.
        compared: the design and the print, or both prints.
        folder: of the files.
    """

    design: Path
    prints: tuple[FeltPrint, ...]
    compared: Compared
    folder: Path

    @property
    def shown(self) -> PrintScanned:
        """The print as its scan shows it."""
        return self.prints[0].shown

    @property
    def other(self) -> PrintScanned | None:
        """The second print, if there is one."""
        return self.prints[1].shown if len(self.prints) > 1 else None

    @property
    def heights(self) -> Array:
        """(rows, cols) mm of the print in the frame of its design."""
        return self.shown.heights

    @property
    def page(self) -> Path:
        """The page."""
        return self.folder / PAGE

    @property
    def content(self) -> dict[str, Any]:
        """The content of `scan.json`."""
        return self.as_json()

    def as_json(self) -> dict[str, Any]:
        """What `retouch scan --json` prints."""
        first, *others = (each.as_json() for each in self.prints)
        content = {"design": str(self.design), **first}
        for second in others:
            content |= {"other": second, "jnd_between": self.compared.jnd_apart}
        return content | {"compared": self.compared.as_json(), "page": str(self.page)}

    def lines(self) -> Iterator[str | tuple[str, str]]:
        """Lines for a person about each print, both of them and the page."""
        for each in self.prints:
            yield from each.lines()
        if len(self.prints) > 1:
            between = self.compared.jnd_apart
            apart = self.compared.smooth if between is None else f"{between:+.2f} JND from the first"
            yield f"the second print is {apart}"
        if (look := self.compared.look) is not None:
            yield f"pictures: {look.change_percent:.2g} % of the mean picture apart"
        yield f"page: {self.page}"


DOCUMENT = "scan.json"
COMPARISON = "comparison.html"
PRINTS = ("print.exr", "other.exr")
"""Files of the folder of a scan beside its page: every number, the page that compares the print with its
design, and the prints as measured, in the frame of the design."""
DRAWS = 3
"""Times that noise like that of the scan is added, to see what noise does to the roughness."""


def scan(
    design: str | os.PathLike[str],
    file: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    other: str | os.PathLike[str] | None = None,
    units: str | None = None,
    size_mm: float | None = None,
    relief_mm: float | None = None,
    height_scale: float | None = None,
    skin: str | os.PathLike[str] | None = None,
    model: ModelName = "layer",
    scene: str | os.PathLike[str] | None = None,
    defines: Mapping[str, str] | None = None,
    variant: str | None = None,
    samples: int | None = None,
    quiet: bool | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> ScannedPrint:
    """Lay the scan of a print on its design, and say what the printer made of it, to finger and eye.

    Args:
        design: a run directory, whose result was printed, or a height map, whose header has its lengths.
        file: scan of the print: a height map (not finite in holes), a mesh or a text of points x, y, z.
        out: folder of the page, of every number and of the print as measured.
        other: scan of a second print, to be compared with the first.
        units: of meshes and points, or of the heights of a height map that holds numbers; None: mm.
        size_mm, relief_mm: of scans that are height maps.
        height_scale: mm for a height of 1 in a height map that holds numbers, or for a z of 1 of points.
        skin, model: of touch, as in `compare`.
        scene, defines, variant, samples: of the pictures, as in `compare`.
        quiet, progress: as in `optimize`.

    Raises:
        InputError: a file cannot be read, or the scan does not show a print of the design.
        ContactError: a contact does not converge.
    """
    subject, out = _printed_subject(design), Path(out)
    lengths = ScanLengths(units, size_mm, relief_mm, height_scale)
    options = CompareOptions(
        scene=scene, defines=defines or {}, variant=variant, model=model, skin=skin, samples=samples
    )
    files = [Path(each) for each in (file, other) if each is not None]
    pressing = _Pressing(subject, options)
    with followed(progress, quiet), ExitStack() as undone:
        shown = [_shown(each, subject.relief, lengths) for each in files]
        prints = tuple(pressing.felt_print(each) for each in shown)
        saved = [out / name for name in PRINTS[: len(prints)]]
        with permitted(out):
            for path, each in zip(saved, shown, strict=True):
                undone.callback(path.unlink, missing_ok=True)
                save_heights_exr(path, each.heights, subject.relief.width_mm)
        plates = [_design_plate(subject), *map(_print_plate, saved, shown, repeat(subject.relief.width_mm))]
        one, two = plates[-2:]
        pair = replace(one, name="A"), replace(two, name="B")
        scanned = ScannedPrint(subject.file, prints, compared(pair, options, out / COMPARISON), out)
        undone.pop_all()
        content = scanned.as_json()
        with permitted(out):
            write_atomically(out / DOCUMENT, (json.dumps(content, indent=1) + "\n").encode())
            write_scan_page(out, subject.relief, shown, [each.as_json() for each in prints], content)
    return scanned


def _design_plate(subject: Subject) -> Subject:
    """The design as a plate: the rim of the print is one."""
    return replace(subject, relief=replace(subject.relief, repeats=(False, False), printer=None))


def _print_plate(file: Path, shown: PrintScanned, width_mm: float) -> Subject:
    """A print in single precision, in which its file holds the heights. Raises InputError."""
    heights = check_heights(shown.heights.astype(np.float32), file)
    return Subject("print", file, Relief(heights, width_mm, name=str(file)), None)


def _printed_subject(design: str | os.PathLike[str]) -> Subject:
    """What was printed; the result of a run with a printer has flat pixels. Raises InputError."""
    subject = read_subject(Path(design), "design")
    printer = None if subject.run is None else subject.run.print.described
    return replace(subject, relief=replace(subject.relief, printer=printer))


def _shown(file: Path, design: Relief, lengths: ScanLengths) -> PrintScanned:
    """A scan, laid on its design. Raises InputError."""
    measured = read_scan(file, lengths)
    with stage(f"laying {file.name} on its design"):
        return print_scanned(register(measured, design))


@dataclass(frozen=True)
class _Pressing:
    """A finger on prints and on their design."""

    subject: Subject
    options: CompareOptions

    @cached_property
    def finger(self) -> Skin:
        """The one given, that of the run, or the default one. Raises InputError."""
        return self.options.finger(self.subject.run)[0]

    def roughness(self, heights: Array) -> float:
        """Of heights (rows, cols) mm on the plate of the design."""
        relief = replace(
            self.subject.relief, heights=heights - min(0.0, float(heights.min())), repeats=(False, False)
        )
        with naming(self.subject.file):
            touch = measure_touch(relief, self.finger, self.options.model, quantities=(ROUGHNESS,))
        return touch.means[ROUGHNESS.name]

    @cached_property
    def of_design(self) -> float:
        """Roughness of the design, whose rim is one as that of the print."""
        return self.roughness(self.subject.relief.heights)

    def felt_print(self, shown: PrintScanned) -> FeltPrint:
        """A print and how it feels."""
        with stage(f"pressing on {Path(shown.registration.scan.name).name}"):
            felt = self._felt(shown)
            flat = self.roughness(shown.flat) if shown.registration.bow().any() else felt.value
        ends = (felt.value, felt.low, felt.high, flat)
        jnd, low, high, jnd_flat = (jnd_unless_smooth(each, self.of_design) for each in ends)
        return FeltPrint(shown, felt, (jnd, low, high), self.of_design, flat, jnd_flat)

    def _felt(self, shown: PrintScanned) -> Interval:
        """Roughness of a print; the interval takes in what noise adds, and what lies between samples.

        Noise as strong as that of the scan is added once more: as much as the roughness then grows, the
        scan's own noise has made of it. What the samples of the scan cannot show is taken to be as much as
        means over such samples take from the roughness of the design.
        """
        measured = self.roughness(shown.heights)
        noisier = [self.roughness(heights) - measured for heights in _noisier(shown)]
        added, spread = max(0.0, float(np.mean(noisier))), float(np.std(noisier, ddof=1))
        found, relief = shown.registration, self.subject.relief
        x, y = (each.ravel() for each in samples_mm(relief))
        seen = found.surface.at(x, y, found.scan.pitch_mm**2 / 12.0)
        means = seen.heights.reshape(relief.heights.shape) + found.surface.level_mm
        unseen = max(0.0, 1.0 - self.roughness(means) / max(self.of_design, 1e-12))
        error = NORMAL_95 * spread
        return Interval(measured, max(0.0, measured - added - error), measured * (1.0 + unseen) + error)


def _noisier(shown: PrintScanned) -> Iterator[Array]:
    """The print (rows, cols), mm, with noise like that of its scan once more."""
    random, found = np.random.default_rng(0), shown.registration
    # Blocks of samples, and linear interpolation between, average the noise as they did that of the scan.
    for _ in range(DRAWS):
        noise = found.scan.noise_mm * random.standard_normal(found.scan.heights.shape)
        noisy = replace(found, scan=replace(found.scan, heights=found.scan.heights + noise))
        heights = noisy.levelled()[0]
        yield np.where(np.isfinite(heights), heights, shown.flat) + found.bow()
