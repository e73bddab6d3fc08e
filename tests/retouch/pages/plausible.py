"""Reports of runs that might have been: every part of the page is filled, and nothing is computed slowly."""

from dataclasses import replace
from typing import Any

import numpy as np

from optimize.verification.verification import Faults, Verification
from relief.printers import PRINTERS
from relief.relief import Relief
from retouch.pages.content import Baseline, Report, Side

SIZE_MM = 10.0
FINGERS = {
    **{"count": 2, "places": 1, "jnd_mean": 2.25, "jnd_min": 1.65, "jnd_max": 2.85, "jnd_std": 0.6},
    "each": [
        {"name": name, "young_modulus_mpa": modulus, "depth_mm": 0.75, "initial_roughness": 0.043}
        | {"roughness": reached, "jnd": jnd}
        for name, modulus, reached, jnd in (
            ("this finger", 0.5, 0.0706, 2.85),
            ("stiffer skin", 1.0, 0.0573, 1.65),
        )
    ],
}
"""The entry `fingers` of result.json, of two fingers."""


CHANGE = {
    "estimate": 2.31,
    "mean": 2.4,
    "mean_error": 0.02,
    "mean_at_least": 2.22,
    "noise_floor": 0.52,
    "rms": 4.35,
    "rms_less_noise": 4.317,
    "rms_error": 0.005,
}


def content(conditions: int = 3) -> dict[str, Any]:
    """A result.json, of pictures whose noise is told of all together."""
    numbers = {
        **dict.fromkeys(("change_percent", "mean_change_percent_of_mean"), 2.31),
        **dict.fromkeys(("change_rms_percent", "rms_change_percent_of_mean"), 4.317),
        **{"change_percent_of_white": 0.9, "change_rms_percent_of_white": 1.7},
    }
    each = {
        **{"plate_share": 1.0, "pixel_change_percent": 1.2, "rms_change_percent": 2.1},
        **{"dssim": 0.012, "flip": 0.031, "pixels_per_degree": 89.4},
    }
    noise = {
        **{"certainty": "known", "message": "Small.", "batches": 4},
        "standard_error_percent": [1.5] * conditions,
        "change_percent_of_mean": CHANGE,
        "change_percent_of_white": CHANGE,
        "conditions_percent_of_white": [CHANGE] * conditions,
    }
    return {
        "stop": {
            "reason": "converged",
            "message": "The target is met and the pictures no longer improve.",
            "steps": 12,
        },
        "touch": {
            **{"target_roughness": 0.07, "initial_roughness": 0.043, "roughness": 0.0699},
            **{"verified_roughness": 0.0706, "verified_by": "fem", "contact_area_mm2": 51.2},
            **{"contact_fraction": 0.48, "jnd_from_original": 2.85, "fingers": FINGERS},
        },
        "look": {
            **numbers,
            **{name: [value] * conditions for name, value in each.items()},
            **{"distance_cm": 40.0, "samples": 256, "noise": noise},
        },
        "heights": {"min_mm": 0.0, "max_mm": 1.31, "lift_mm": 0.002, "rms_change_mm": 0.04},
        "time_s": {"total": 31.0, "touch": 6.1, "look": 19.8, "verify": 3.0},
        "versions": {"retouch": "0.1.0", "mitsuba": "3.9.1", "torch": "2.13.0"},
        "print": None,
        "seed": 0,
    }


def verified(conditions: int = 3, **sections: dict[str, Any]) -> Verification:
    """A verification with other values in some sections of its result.json."""
    whole = content(conditions)
    return Verification.from_json(
        whole | {name: (whole.get(name) or {}) | sections[name] for name in sections}
    )


def of_a_print(design: float, change: float, **sections: dict[str, Any]) -> Verification:
    """The verification of a run with a printer.

    Args:
        design: how far the original's print looks from its design, % of the mean picture.
        change: the same of both prints.
        sections: as of `verified`.
    """
    printer, faults = PRINTERS["filament"], dict.fromkeys(Faults.model_fields, 0.0)
    numbers = {
        **printer.numbers(),
        **{"printer": printer.name, "keep_features": False, "pixels": [25, 25], "acuity_arcmin": 1.0},
        **{"faults_before": faults, "faults_after": faults, "seen_change_percent": change},
        "design": {"jnd_of_print": 1.0, "seen_change_percent": design, "too_steep_percent": 0.0},
    }
    return verified(3, print=numbers, **sections)


def relief(n: int, seed: int, wavelength_mm: float = 1.5) -> np.ndarray:
    """A Gaussian random relief (n, n), 0 to 1.2 mm, with waves of about the given length."""
    noise = np.fft.fft2(np.random.default_rng(seed).normal(size=(n, n)))
    k = np.hypot(*np.meshgrid(*[np.fft.fftfreq(n, SIZE_MM / n)] * 2))
    field = np.fft.ifft2(noise * np.exp(-0.5 * (k * wavelength_mm / 1.2) ** 2)).real
    return 1.2 * (field - field.min()) / np.ptp(field)


def lambert(heights: np.ndarray, azimuth: float) -> np.ndarray:
    """Pictures (n, n) of a matte plate under a light 35 degrees up and some sky, in radiance."""
    down, right = np.gradient(heights, SIZE_MM / len(heights))
    flat, up = np.cos(np.radians(35)), np.sin(np.radians(35))
    light = np.array([flat * np.cos(np.radians(azimuth)), flat * np.sin(np.radians(azimuth)), up])
    facing = (light[2] - light[0] * right + light[1] * down) / np.sqrt(1 + right**2 + down**2)
    return 0.5 / np.pi * (np.clip(facing, 0, None) + 0.23)


def plausible(n: int = 64, azimuths: tuple[int, ...] = (10, 130, 250)) -> Report:
    before = relief(n, 1)
    after = np.clip(before + 0.09 * (relief(n, 2, 2.2) - 0.5) + 0.05 * (before - before.mean()), 0, None)
    pictures = [np.stack([lambert(h, a) for a in azimuths]) for h in (before, after, 1.5 * before)]
    strains = [-0.35 * (h - h.mean()) / 1.2 - 0.02 for h in (before, 1.35 * after)]
    pressures = [
        np.clip(h - np.quantile(h, 1 - part), 0, None) * 0.6 for h, part in ((before, 0.55), (after, 0.48))
    ]
    steps = range(13)
    history = [
        {
            "step": k,
            "roughness": 0.0700 - 0.027 * 0.62**k,
            "target_roughness": 0.07,
            "contact_area_mm2": 55 - 4 * (1 - 0.6**k),
            "picture_rms_percent": 2.9 * (1 - 0.55**k) + 0.5 * 0.7**k * (k > 0),
            "picture_mean_percent": 1.6 * (1 - 0.55**k) + 0.3 * 0.7**k * (k > 0),
            "seconds": 0.8 * k,
        }
        for k in steps
    ]
    before_side, after_side = (
        Side(
            name=name,
            relief=Relief(heights, SIZE_MM),
            strain=strain,
            pressure=pressure,
            pictures=shown,
        )
        for name, heights, strain, pressure, shown in zip(
            ("before", "after"), (before, after), strains, pressures, pictures[:2], strict=True
        )
    )
    return Report(
        title="Gravel, rougher",
        before=before_side,
        after=after_side,
        verification=Verification.from_json(content(len(azimuths))),
        conditions=[f"light from {a} degrees" for a in azimuths],
        white=0.5 / np.pi * 1.23,
        history=history,
        heights_png_mm=(0.0, 3.0),
        settings={"touch": {"roughness": 0.07, "model": "layer"}, "look": {"model": "exact", "weight": 1.0}},
        baseline=Baseline("linear scaling", pictures[2], 0.0697),
    )


def with_sides(report: Report, **both: Any) -> Report:
    """A report whose sides have other values, each a pair; `heights` are those of the same plates."""
    if "heights" in both:
        pairs = zip(report.sides, both.pop("heights"), strict=True)
        both["relief"] = [replace(side.relief, heights=heights) for side, heights in pairs]
    before, after = (
        replace(side, **{name: pair[number] for name, pair in both.items()})
        for number, side in enumerate(report.sides)
    )
    return replace(report, before=before, after=after)


def noisy(certainty: str, message: str) -> Report:
    """A report of pictures whose noise is told."""
    noise = {
        **content()["look"]["noise"],
        **{"certainty": certainty, "message": message},
        "standard_error_percent": [1.4, 1.5, 1.6],
        "conditions_percent_of_white": [CHANGE | {"rms_error": 0.01 * n} for n in (3, 4, 5)],
    }
    return replace(plausible(), verification=verified(look={"noise": noise}))
