"""Coupons: a plate whose print and scan measure a printer."""

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from relief.ground.errors import InputError
from relief.ground.files import check_file_to_write, permitted, write_atomically
from relief.ground.progress import Progress, stage
from relief.printers import Printer, is_printer_file, printer_of
from relief.scans import coupon as plates
from relief.scans.coupon_reading import CouponNumbers, printer_file, read_coupon
from relief.scans.scan_files import ScanLengths, read_scan
from retouch.pages.sentences import interval
from retouch.verbs.exporting import Exported, export
from retouch.verbs.progress_display import followed

NUMBERS = ("pixel_um", "layer_um", "min_feature_um", "max_slope_degrees", "scale", "height_scale")
"""Numbers of a coupon on the screen: attributes of `CouponNumbers`."""


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

    def lines(self) -> Iterator[str | tuple[str, str]]:
        """A number of the printer with its interval each, and the file, for a person."""
        for name in NUMBERS:
            measured = getattr(self.coupon, name)
            if measured is not None:
                yield name, interval(measured.value, measured.low, measured.high, ".4g")
        yield f"written: {self.file}; retouch optimize TEXTURE --printer {self.file} takes it"

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
    """Write the coupon, a plate that shows the numbers of a printer when it is printed and scanned.

    Args:
        out: file to write, as in `export`.
        printer: for whose pixels the coupon is scaled; None: 50 um.

    Raises:
        InputError: the file cannot be written.
    """
    return export(plates.coupon(plates.scale_for(printer_of(printer))), out)


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
        printer: the one that `coupon` was given, which decides how large the coupon is.
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
