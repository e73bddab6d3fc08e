"""What a scan shows of a print, as JSON and as lines for a person."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from relief.ground.arrays import Array
from relief.scans.loss import half_kept_mm
from relief.scans.print_summary import PrintScanned
from relief.scans.registration import Interval
from retouch.pages.compared import Compared
from retouch.pages.scan import PAGE
from retouch.pages.sentences import interval, smooth_change


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
        yield (
            "lies",
            f"turned by {_text(found.turned_degrees, '.3f')} degrees, shifted by {x:.3f}, {y:.3f} mm",
        )
        yield (
            "size",
            f"{_text(found.scale, '.4f')} in the plane, {_text(found.height_scale, '.3f')} in height",
        )
        blur_um = Interval(1000.0 * blur.value, 1000.0 * blur.low, 1000.0 * blur.high)
        yield (
            "blur",
            f"{_text(blur_um, '.1f')} um; half is left of periods of {half_kept_mm(blur).value:.2f} mm",
        )
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
