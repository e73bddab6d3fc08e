"""The numbers of a registered scan, as `scan.json` and the screen show them."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from relief.ground.arrays import Array
from relief.scans.loss import Kept, detail_kept, half_kept_mm
from relief.scans.registration import Registration

LITTLE_COVERED = 50.0
"""Percentage of the plate that is measured, below which a note warns: touch then depends on the design."""
COARSE_DEGREES = 5.0
"""Tilt from which heights that are taken along the axis of the scanner are off by 0.4 % and more."""
NUMBERS = {
    "turn": "turn",
    "log_scale": "scale",
    "shift_x_mm": "shift along x",
    "shift_y_mm": "shift along y",
    "variance_mm2": "blur",
    "height_scale": "height scale",
}
"""Numbers that a scan may leave open, in words."""
POOR = 0.9
"""Correlation with the design as blurred below which a note warns. Simulated prints of the shipped textures,
10 mm wide, reach 0.997 (resin), 0.94 (fine filament) and 0.83 to 0.99 (filament of 0.4 mm)."""
BLURRED_UM = 300.0
"""Blur from which a note warns: filament of 0.4 mm blurs by 200."""
USUAL_HEIGHTS = (0.67, 1.5)
"""Heights over those of the design that prints have; beyond, the whole interval of a height has a note."""
STRETCHED_PERCENT = 0.5
"""Stretch from which a note warns."""


@dataclass(frozen=True, eq=False)
class PrintScanned:
    """A print as its scan shows it.

    Attributes:
        registration: of the scan to the design.
        heights: (rows, cols) mm on the samples of the design, bowed as in the scan, from 0; where nothing
            was measured the design as blurred.
        flat: the heights without the bow, at the level of the design.
        deviations: (rows, cols) mm from the design as blurred; NaN where nothing was measured.
        kept: what of the design's detail is in the print.
    """

    registration: Registration
    heights: Array
    flat: Array
    deviations: Array
    kept: Kept

    @property
    def covered_percent(self) -> float:
        """Part of the plate that was measured."""
        return 100.0 * float(np.isfinite(self.deviations).mean())

    def numbers(self) -> dict[str, Any]:
        """Lengths, angles and shares by name, with the ends of intervals of 95 %."""
        found, scan = self.registration, self.registration.scan
        x, y, blur = found.shift_x_mm, found.shift_y_mm, found.blur_mm
        left = self.deviations[np.isfinite(self.deviations)]
        outliers = float(found.fitted.outliers.sum() / max(1, found.working.measured.sum()))
        return {
            **found.turned_degrees.as_json("turned_degrees"),
            "shifted_mm": [x.value, y.value],
            "shifted_mm_low": [x.low, y.low],
            "shifted_mm_high": [x.high, y.high],
            **found.scale.as_json("scale"),
            **found.stretch_percent.as_json("stretch_percent"),
            "stretch_degrees": found.distorted.pose.longest_degrees,
            **found.sag_mm.as_json("sag_mm"),
            **found.height_scale.as_json("height_scale"),
            **blur.times(1000.0).as_json("blur_um"),
            **half_kept_mm(blur).as_json("half_kept_mm"),
            "tilted_degrees": found.tilted_degrees,
            "correlation": found.fitted.correlation,
            "deviation_rms_um": 1000.0 * float(np.sqrt(np.mean(left**2))) if left.size else None,
            "pitch_um": 1000.0 * scan.pitch_mm,
            "noise_um": 1000.0 * scan.noise_mm,
            "holes_percent": 100.0 * scan.hole_share,
            "outliers_percent": 100.0 * outliers,
            "covered_percent": self.covered_percent,
        }

    def notes(self) -> list[str]:
        """Warnings about the numbers for a person, a line each."""
        found = self.registration
        lines = [*found.left_out]
        if (percent := 100.0 * found.fitted.stretch[0]) > STRETCHED_PERCENT:
            on_design = found.pose.longest_degrees
            on_scan = on_design + np.degrees(found.pose.turn)
            lines.append(
                f"printer or scanner stretches by {percent:.2g} %, along a line at {round(on_design) % 180} "
                f"degrees in the design and {round(on_scan) % 180} degrees in the scan"
            )
        if (correlation := found.fitted.correlation) < POOR:
            lines.append(
                f"scan and design correlate by {correlation:.2f}, most prints by 0.94 and more: "
                "the scan is noisy or distorted, the printer too coarse, or the plate another one"
            )
        if (blur_um := 1000.0 * found.blur_mm.value) > BLURRED_UM:
            lines.append(f"blurred by {blur_um:.0f} um, most prints by 20 to 200: is the scan in focus?")
        height, (least, most) = found.height_scale, USUAL_HEIGHTS
        if height.high < least or height.low > most:
            lines.append(f"heights are {height.value:.2g} times those of the design: is the unit of z right?")
        if self.covered_percent < LITTLE_COVERED:
            measured = f"{self.covered_percent:.0f} % of the plate is measured"
            lines.append(f"{measured}; elsewhere its design is pressed")
        if found.rivals:
            as_well = f"the scan fits its design as well {', '.join(found.rivals)}"
            lines.append(f"{as_well}; it cannot tell which is right")
        if found.fitted.undetermined:
            names = ", ".join(NUMBERS[name] for name in found.fitted.undetermined)
            why = "it shows one wavelength, or is alike along a line"
            lines.append(f"the scan does not determine {names}: {why}")
        if found.tilted_degrees > COARSE_DEGREES:
            tilted = f"the scan is tilted by {found.tilted_degrees:.0f} degrees"
            lines.append(f"{tilted}, which falsifies heights; level it")
        if found.scan.pitch_mm > 2.0 * found.design.pitch_mm:
            lines.append(
                f"the scan has a sample each {1000.0 * found.scan.pitch_mm:.0f} um, its design each "
                f"{1000.0 * found.design.pitch_mm:.0f} um; what is finer is lost in the scan"
            )
        return lines


def print_scanned(registration: Registration) -> PrintScanned:
    """The print of a registered scan: heights, deviations and the detail that is kept."""
    heights, deviations = registration.levelled()
    flat = np.where(np.isfinite(deviations), heights, registration.model())
    bowed = flat + registration.bow()
    heights = bowed - min(0.0, float(bowed.min()))
    return PrintScanned(registration, heights, flat, deviations, detail_kept(registration))
