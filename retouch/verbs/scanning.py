"""Scans of prints: laid on their design, pressed and rendered; and printers measured by a coupon."""

import json
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.settings.skins import load_skin
from relief.ground.arrays import Array
from relief.ground.errors import InputError, naming
from relief.ground.files import check_file_to_write, permitted, write_atomically
from relief.ground.progress import Progress, stage
from relief.heightmap import save_heights_exr
from relief.printers import Printer, is_printer_file, printer_of
from relief.relief import Relief
from relief.scans import coupon as plates
from relief.scans.blurred import samples_mm
from relief.scans.coupon_reading import CouponNumbers, printer_file, read_coupon
from relief.scans.print_summary import PrintScanned, print_scanned
from relief.scans.registration import NORMAL_95, Interval, register
from relief.scans.scan_files import ScanLengths, read_scan
from retouch.pages.scan import PAGE, write_scan_page
from retouch.verbs.comparison import compare
from retouch.verbs.exporting import Exported, export
from retouch.verbs.progress_display import followed
from retouch.verbs.subjects import Subject, read_subject
from tactile.jnd import jnd_unless_smooth
from tactile.measures import measure_touch
from tactile.model import ModelName
from tactile.quantities import ROUGHNESS
from tactile.skin import Skin

DOCUMENT = "scan.json"
COMPARISON = "comparison.html"
PRINTS = ("print.exr", "other.exr")
"""Files of the folder of a scan beside its page: every number, the page that compares the print with its
design, and the prints as measured, in the frame of the design."""
DRAWS = 3
"""Times that noise like that of the scan is added, to see what noise does to the roughness."""


@dataclass(frozen=True, eq=False)
class ScannedPrint:
    """A print beside its design.

    Attributes:
        shown: the print as its scan shows it.
        other: a second print of the same design, if there is one.
        content: of `scan.json`.
        folder: of the files.
    """

    shown: PrintScanned
    other: PrintScanned | None
    content: dict[str, Any]
    folder: Path

    @property
    def heights(self) -> Array:
        """(rows, cols) mm of the print in the frame of its design."""
        return self.shown.heights

    @property
    def page(self) -> Path:
        """The page."""
        return self.folder / PAGE

    def as_json(self) -> dict[str, Any]:
        """What `retouch scan --json` prints."""
        return self.content


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
        units: of meshes and points; None: mm.
        size_mm, relief_mm, height_scale: of scans that are height maps.
        skin, model: of touch, as in `compare`.
        scene, defines, variant, samples: of the pictures, as in `compare`.
        quiet, progress: as in `optimize`.

    Raises:
        InputError: a file cannot be read, or the scan does not show a print of the design.
        ContactError: a contact does not converge.
    """
    subject, out = _printed_subject(design), Path(out)
    lengths = ScanLengths(units, size_mm, relief_mm, height_scale)
    files = [Path(each) for each in (file, other) if each is not None]
    settings: dict[str, Any] = {"scene": scene, "defines": defines, "variant": variant, "samples": samples}
    settings |= {"skin": skin, "model": model, "repeats": False, "quiet": True}
    pressing = _Pressing(subject, skin, model)
    with followed(progress, quiet), ExitStack() as undone:
        prints = [_shown(each, subject.relief, lengths) for each in files]
        sides = [pressing.side(each) for each in prints]
        saved = [out / name for name in PRINTS[: len(prints)]]
        with permitted(out):
            for path, each in zip(saved, prints, strict=True):
                undone.callback(path.unlink, missing_ok=True)
                save_heights_exr(path, each.heights, subject.relief.width_mm)
        one, two = (subject.file.parent if subject.run else subject.file, *saved)[-2:]
        compared = compare(one, two, out / COMPARISON, **settings)
        undone.pop_all()
        content = _content(subject, sides, compared)
        with permitted(out):
            content["page"] = str(out / PAGE)
            write_atomically(out / DOCUMENT, (json.dumps(content, indent=1) + "\n").encode())
            write_scan_page(out, subject.relief, prints, content)
    return ScannedPrint(prints[0], prints[1] if other is not None else None, content, out)


@dataclass(frozen=True, eq=False)
class MeasuredPrinter:
    """A printer, measured by the scan of its coupon.

    Attributes:
        printer: as runs take it.
        coupon: what was measured, with intervals.
        file: of the printer.
    """

    printer: Printer
    coupon: CouponNumbers
    file: Path

    def as_json(self) -> dict[str, Any]:
        """What `retouch scan --coupon --json` prints."""
        grating = {f"{1000.0 * pitch:.0f}": each.value for pitch, each in self.coupon.contrasts.items()}
        return {
            "printer": str(self.file),
            **self.printer.numbers(),
            "measured": self.coupon.numbers(),
            "grating_kept": grating,
        }


def coupon(out: str | os.PathLike[str], *, printer: str | Printer | None = None) -> Exported:
    """Write the coupon, a plate that tells the numbers of a printer when it is printed and scanned.

    Args:
        out: file to write, as in `export`.
        printer: for whose pixels the coupon is scaled; None: 50 um.

    Raises:
        InputError: the file cannot be written.
    """
    made_by = printer_of(printer)
    return export(plates.coupon(plates.scale_for(made_by)), out)


def scan_coupon(
    file: str | os.PathLike[str],
    out: str | os.PathLike[str],
    *,
    printer: str | Printer | None = None,
    layer_um: float | None = None,
    units: str | None = None,
    size_mm: float | None = None,
    relief_mm: float | None = None,
    height_scale: float | None = None,
    quiet: bool | None = None,
    progress: Callable[[Progress], None] | None = None,
) -> MeasuredPrinter:
    """Measure a printer by the scan of its coupon, and write a printer file.

    Args:
        file: scan of the coupon, as of `scan`.
        out: printer file to write (.toml), which runs take as their printer.
        printer: the one that `coupon` was given, which tells how large the coupon is.
        layer_um: thickness of layers; None: as the scan shows them.
        units, size_mm, relief_mm, height_scale, quiet, progress: as in `scan`.

    Raises:
        InputError: the file cannot be read, shows no such coupon, or shows no layers.
    """
    out = Path(out)
    if not is_printer_file(out.name):
        raise InputError(f"{out}: a printer file ends in .toml", f"{out}: -o: a printer file ends in .toml")
    check_file_to_write(out)
    made_by = printer_of(printer)
    lengths = ScanLengths(units, size_mm, relief_mm, height_scale)
    with followed(progress, quiet), stage("measuring the coupon"):
        numbers = read_coupon(read_scan(file, lengths), plates.scale_for(made_by))
        measured = numbers.printer(out.stem, layer_um)
        with permitted(out):
            write_atomically(out, printer_file(measured, numbers, Path(file)).encode())
    return MeasuredPrinter(measured, numbers, out)


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


def _content(subject: Subject, sides: list[dict[str, Any]], compared: dict[str, Any]) -> dict[str, Any]:
    """What `scan.json` holds."""
    content = {"design": str(subject.file), **sides[0]}
    if len(sides) > 1:
        content |= {"other": sides[1], "jnd_between": compared["jnd_apart"]}
    return content | {"compared": compared}


@dataclass(frozen=True)
class _Pressing:
    """A finger on prints and on their design."""

    subject: Subject
    skin: str | os.PathLike[str] | None
    model: ModelName

    @cached_property
    def finger(self) -> Skin:
        """The one given, that of the run, or the default one. Raises InputError."""
        if self.skin is None and self.subject.run is not None:
            return self.subject.run.touch.finger
        return load_skin(DEFAULT_SKIN if self.skin is None else self.skin)

    def roughness(self, heights: Array) -> float:
        """Of heights (rows, cols) mm on the plate of the design."""
        relief = replace(
            self.subject.relief, heights=heights - min(0.0, float(heights.min())), repeats=(False, False)
        )
        with naming(self.subject.file):
            return measure_touch(relief, self.finger, self.model, quantities=(ROUGHNESS,)).means[
                ROUGHNESS.name
            ]

    @cached_property
    def of_design(self) -> float:
        """Roughness of the design, whose rim is one as that of the print."""
        return self.roughness(self.subject.relief.heights)

    def side(self, shown: PrintScanned) -> dict[str, Any]:
        """The numbers of a print: where it lies, what was lost, and how it feels."""
        with stage(f"pressing on {Path(shown.registration.scan.name).name}"):
            felt = self._felt(shown)
        jnds = [jnd_unless_smooth(each, self.of_design) for each in (felt.value, felt.low, felt.high)]
        return {
            "file": shown.registration.scan.name,
            **shown.numbers(),
            **felt.as_json("roughness"),
            **dict(
                zip(("jnd_from_design", "jnd_from_design_low", "jnd_from_design_high"), jnds, strict=True)
            ),
            "kept": shown.kept.as_json(),
            "notes": shown.notes(),
        }

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
        yield np.where(np.isfinite(heights), heights, shown.heights)
