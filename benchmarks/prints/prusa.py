"""PrusaSlicer as a reader of files: what it holds of them, and its layers for filament and for resin."""

from __future__ import annotations

import io
import re
import subprocess
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from relief.ground.arrays import Array
from relief.printers import Printer, find_printer

PRINTER = find_printer("mask-50")
"""The resin printer: pixels and layers of 50 um."""
DISPLAY_PIXELS = 2048
"""Pixels a side of the display that masks the light, if no others are given: 102.4 mm."""
TIME_LIMIT_S = 600.0


def resin_settings(printer: Printer, pixels: int) -> dict[str, Any]:
    """A profile of a resin printer with a square display, without supports, in the slicer's keys."""
    side = pixels * printer.pixel_mm
    bed = ",".join(f"{x:g}x{y:g}" for x, y in ((0, 0), (side, 0), (side, side), (0, side)))
    return {
        "printer_technology": "SLA",
        "printer_model": "SL1",
        "bed_shape": bed,
        "display_width": side,
        "display_height": side,
        "display_pixels_x": pixels,
        "display_pixels_y": pixels,
        "display_orientation": "landscape",
        "display_mirror_x": 0,
        "layer_height": printer.layer_mm,
        "initial_layer_height": printer.layer_mm,
        "supports_enable": 0,
        "pad_enable": 0,
        "elefant_foot_compensation": 0,
        # Pixels are on or off, and gaps are not closed beyond what the maker's own profiles do.
        "gamma_correction": 0,
        "slice_closing_radius": 0.005,
    }


class Slicer:
    """PrusaSlicer by its command line.

    Attributes:
        version: As it tells.
    """

    def __init__(self, program: str, folder: Path, display_pixels: int = DISPLAY_PIXELS) -> None:
        self._program, self._folder, self._pixels = program, folder, display_pixels
        self.version = re.findall(r"PrusaSlicer-[\w.]+", self._run("--help"))[0]
        self._profile = folder / "resin.ini"
        text = "".join(f"{key} = {value}\n" for key, value in resin_settings(PRINTER, display_pixels).items())
        self._profile.write_text(text)

    def info(self, file: Path) -> dict[str, Any]:
        """PrusaSlicer's numbers of a file over all objects: facets, volume, box and repairs."""
        text = self._run("--info", str(file))
        found: dict[str, list[str]] = {}
        for key, value in re.findall(r"^(\w+) = +(\S+)$", text, re.MULTILINE):
            found.setdefault(key, []).append(value)
        numbers = {key: [float(value) for value in found[key]] for key in found if key != "manifold"}
        repaired = ("facets_removed", "edges_fixed", "facets_reversed", "backwards_edges", "open_edges")
        return {
            "objects": len(found["volume"]),
            "manifold": set(found["manifold"]) == {"yes"},
            "repairs": int(sum(sum(numbers.get(key, [])) for key in repaired)),
            "facets": int(sum(numbers["number_of_facets"])),
            "volume_mm3": sum(numbers["volume"]),
            "size_mm": [max(numbers[f"max_{axis}"]) - min(numbers[f"min_{axis}"]) for axis in "xyz"],
        }

    def filament(self, file: Path, raft_layers: int = 0) -> dict[str, Any]:
        """Slice for filament with the default profile, on a raft or none: layers of G-code, and warnings."""
        out = self._folder / f"{file.stem}.gcode"
        raft = ("--raft-layers", str(raft_layers))
        text = self._run("--export-gcode", *raft, "--output", str(out), str(file))
        return {"layers": out.read_text().count(";LAYER_CHANGE"), "warnings": _warnings(text)}

    def resin(self, file: Path) -> tuple[dict[str, Any], NDArray[np.intp]]:
        """Slice for resin.

        Returns:
            Layers, warnings, and pixels that hang over the layer below; and the number of layers that are
            solid at each pixel of the display (rows, cols), row 0 at +y.
        """
        out = self._folder / f"{file.stem}.sl1"
        text = self._run("--export-sla", "--load", str(self._profile), "--output", str(out), str(file))
        solid = np.zeros((self._pixels, self._pixels), dtype=np.intp)
        over, below = 0, np.ones_like(solid, dtype=bool)
        with zipfile.ZipFile(out) as archive:
            names = sorted(name for name in archive.namelist() if re.fullmatch(r"[^/]+\.png", name))
            for name in names:
                layer = np.asarray(Image.open(io.BytesIO(archive.read(name))).convert("L")) >= 128
                over += int(np.count_nonzero(layer & ~below))
                solid += layer
                below = layer
        return {"layers": len(names), "overhanging_pixels": over, "warnings": _warnings(text)}, solid

    def _run(self, *arguments: str) -> str:
        done = subprocess.run(
            [self._program, *arguments], capture_output=True, text=True, timeout=TIME_LIMIT_S, check=True
        )
        return done.stdout + done.stderr


def _warnings(text: str) -> list[str]:
    """Lines of the slicer's output that report a fault."""
    return [line for line in text.splitlines() if re.search(r"warn|error|repair|empty", line, re.IGNORECASE)]


def plate_heights(solid: NDArray[np.intp], base_mm: float) -> Array:
    """Heights of a plate (rows, cols) mm from its numbers of solid layers at each pixel of the display."""
    rows, cols = (np.flatnonzero(solid.any(axis=axis)) for axis in (1, 0))
    plate = solid[rows[0] : rows[-1] + 1, cols[0] : cols[-1] + 1]
    return np.asarray(plate * PRINTER.layer_mm - base_mm)
