"""The first mile: twelve pictures from outside the project, by the commands of the README alone.

python -m benchmarks.runs.first_mile [NAME ...] [--again]

Once all are there, docs/images/first-mile.png is drawn anew.

For each picture `retouch prepare`, `retouch evaluate` and `retouch optimize --jnd 2`, by the real command
line, with one thread. Photographs are those of scikit-image that are not bundled textures; drawings are made
by this module.
"""

from __future__ import annotations

import io
import json
import math
import os
from collections.abc import Callable, Iterator
from functools import partial
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from benchmarks.shared.common import IMAGES, rows_of
from benchmarks.shared.processes import process
from optimize.run_directory.finished_run import read_verification
from relief.ground.files import write_atomically
from relief.ground.limits import PATCH_SIDE_MM
from relief.heightmap import load_heights
from relief.relief_shading import facing, lit

SHEET = IMAGES / "first-mile.png"
WORK = Path("runs/first-mile")
RELIEF_MM, JND = 0.6, 2.0
"""Height of white above black, mm, and just-noticeable differences rougher, of every picture."""
QUALITY = 90
"""Quality of JPEG and WebP files."""
PANEL, GAP, LABEL = 190, 10, 62
"""Pixels of a picture on the sheet, between pictures, and of the lines above them."""
PAPER, INK, FAINT = (250, 248, 244), (38, 38, 42), (128, 124, 118)


def photograph(name: str, suffix: str = "png") -> Callable[[Path], Path]:
    """A function that writes a picture of scikit-image to a folder, as another kind of file if asked for."""

    def write(folder: Path) -> Path:
        with (resources.files("skimage") / "data" / name).open("rb") as file, Image.open(file) as image:
            path = folder / f"{Path(name).stem}.{suffix}"
            image.convert("L" if image.mode == "L" else "RGB").save(path, quality=QUALITY)
        return path

    return write


def scan(folder: Path) -> Path:
    """A scan of 3000 x 2000 pixels: coffee enlarged, with the noise of a sensor, as JPEG."""
    with (resources.files("skimage") / "data" / "coffee.png").open("rb") as file, Image.open(file) as image:
        large = image.convert("RGB").resize((3000, 2000), Image.Resampling.BICUBIC)
    noise = np.random.default_rng(0).normal(0.0, 4.0, (2000, 3000, 3))
    noisy = np.clip(np.asarray(large) + noise, 0, 255).astype(np.uint8)
    Image.fromarray(noisy).save(folder / "scan.jpg", quality=85)
    return folder / "scan.jpg"


def terrain(folder: Path) -> Path:
    """A map of 16 bits, 1024 x 1024: noise whose spectrum falls as the frequency to the power -2.2."""
    wave = np.fft.fftfreq(1024)
    length = np.hypot(*np.meshgrid(wave, wave))
    length[0, 0] = np.inf
    noise = np.fft.fft2(np.random.default_rng(1).normal(size=(1024, 1024)))
    heights = np.fft.ifft2(noise * length**-2.2).real
    grey = (heights - heights.min()) / np.ptp(heights)
    Image.fromarray(np.rint(65535 * grey).astype(np.uint16)).save(folder / "terrain.png")
    return folder / "terrain.png"


def tiles(folder: Path) -> Path:
    """A drawing with a palette: hexagons in four colours with dark joints, not square."""
    y, x = np.mgrid[:420, :600].astype(float)
    centres = [(60 * i, 69.3 * j + 34.6 * (i % 2)) for i in range(12) for j in range(8)]
    far = np.stack([np.hypot(x - col, y - row) for col, row in centres])
    nearest, second = np.sort(far, axis=0)[:2]
    colours = np.array([[196, 120, 84], [222, 184, 135], [160, 82, 45], [205, 133, 63]], np.uint8)
    picture = colours[far.argmin(axis=0) % 4]
    picture[second - nearest < 6] = (60, 50, 45)
    Image.fromarray(picture).quantize(16).save(folder / "tiles.png")
    return folder / "tiles.png"


def rings(folder: Path) -> Path:
    """A drawing with transparency: dark rings on nothing."""
    image = Image.new("RGBA", (500, 500), (0, 0, 0, 0))
    draw = ImageDraw.Draw(image)
    for row in range(5):
        for col in range(5):
            box = (100 * col + 12, 100 * row + 12, 100 * col + 88, 100 * row + 88)
            draw.ellipse(box, outline=(20, 40, 90, 255), width=6 + 4 * ((row + col) % 3))
    image.save(folder / "rings.png")
    return folder / "rings.png"


def weave(folder: Path) -> Path:
    """A drawing in 8-bit grey of threads that go over and under one another."""
    y, x = (np.mgrid[:700, :700] + 0.5) / 35.0
    over = np.sign(np.sin(np.pi * x) * np.sin(np.pi * y))
    along = np.abs(np.sin(np.pi * x)) * (0.75 + 0.25 * over)
    across = np.abs(np.sin(np.pi * y)) * (0.75 - 0.25 * over)
    Image.fromarray(np.rint(255 * np.maximum(along, across)).astype(np.uint8)).save(folder / "weave.png")
    return folder / "weave.png"


PICTURES: dict[str, Callable[[Path], Path]] = {
    "coffee, a colour JPEG": photograph("coffee.png", "jpg"),
    "cat, a colour PNG": photograph("chelsea.png"),
    "galaxies, a colour JPEG": photograph("hubble_deep_field.jpg", "jpg"),
    "retina, a colour WebP": photograph("retina.jpg", "webp"),
    "coins, 8-bit grey": photograph("coins.png"),
    "moon, 8-bit grey": photograph("moon.png"),
    "printed page, 8-bit grey": photograph("page.png"),
    "tiles, drawn with a palette": tiles,
    "rings, drawn with transparency": rings,
    "weave, drawn in 8-bit grey": weave,
    "scan of 3000 x 2000": scan,
    "terrain, 16 bits, 1024 x 1024": terrain,
}


def main() -> None:
    os.environ["OMP_NUM_THREADS"] = "1"
    measures = {name: partial(travel, make) for name, make in PICTURES.items()}
    rows = rows_of(__doc__, "first-mile", "rows", measures)
    if all((WORK / row["file"]).is_file() for row in rows.values()):
        write_atomically(SHEET, sheet(rows))


def travel(make: Callable[[Path], Path]) -> dict[str, Any]:
    """What becomes of one picture."""
    WORK.mkdir(parents=True, exist_ok=True)
    picture = make(WORK).name
    texture, run = f"{Path(picture).stem}-heights.png", Path("out") / f"{Path(picture).stem}-heights"
    row: dict[str, Any] = {"file": picture, "heights": texture, "load": os.getloadavg()[0], "seconds": {}}
    for verb, options in (
        ("prepare", (picture, "-o", texture, "--relief-mm", str(RELIEF_MM), "--json")),
        ("evaluate", (texture, "--json")),
        ("optimize", (texture, "--jnd", f"{JND:g}", "-o", str(run), "--force", "-q")),
    ):
        ended = process(["-m", "retouch", verb, *options], folder=WORK)
        row["seconds"][verb] = ended.wall_s
        if ended.status not in (0, 3):
            return row | {"outcome": ended.err.strip()}
        if verb == "evaluate":
            (felt,) = json.loads(ended.out)
            row |= {"roughness": felt["roughness"], "contact_fraction": felt["contact_fraction"]}
    result = read_verification(WORK / run)
    assert result is not None
    touch, look = result.touch, result.look
    verified, target = (values["roughness"] or math.nan for values in (touch.verified, touch.target))
    return row | {
        "outcome": result.stop.message,
        "steps": result.stop.steps,
        "jnd": touch.jnd_from_original,
        "off_target_percent": 100.0 * (verified / target - 1.0),
        "change_percent_of_mean": look.change_percent,
        "run": str(run),
    }


def panels(row: dict[str, Any]) -> Iterator[Image.Image]:
    """Picture, relief before and relief after, as far as there are any."""
    with Image.open(WORK / row["file"]) as image:
        grey = image.mode.startswith("I")
        rgb = np.asarray(image) // 257 if grey else np.asarray(flat(image))
        yield Image.fromarray(rgb.astype(np.uint8)).convert("RGB")
    for path in (WORK / row["heights"], WORK / row.get("run", "-") / "heights.exr"):
        if path.is_file():
            yield shaded(load_heights(path))


def flat(image: Image.Image) -> Image.Image:
    """The picture in colour on white."""
    image = image.convert("RGBA")
    return Image.alpha_composite(Image.new("RGBA", image.size, "white"), image).convert("RGB")


def shaded(heights: np.ndarray) -> Image.Image:
    """A relief under raking light."""
    light = np.clip(facing(heights, PATCH_SIDE_MM, 135.0, 25.0), 0.0, 1.0)
    light *= lit(heights, PATCH_SIDE_MM, 135.0, 25.0, 0.15)
    level = (0.15 + 0.85 * np.clip(light / np.percentile(light, 99.0), 0.0, 1.0)) ** 0.6
    return Image.fromarray(np.rint(255 * level).astype(np.uint8)).convert("RGB")


def sheet(rows: dict[str, dict[str, Any]]) -> bytes:
    """All pictures, two to a line: picture, relief before, relief after, and the numbers."""
    across, down = 2, -(-len(rows) // 2)
    cell = 3 * PANEL + 2 * GAP + 4 * GAP, PANEL + LABEL + 3 * GAP
    canvas = Image.new("RGB", (across * cell[0] + 2 * GAP, down * cell[1] + 2 * GAP), PAPER)
    draw = ImageDraw.Draw(canvas)
    for place, (name, row) in enumerate(rows.items()):
        x, y = 3 * GAP + place % across * cell[0], 2 * GAP + place // across * cell[1]
        draw.text((x, y), name, INK, ImageFont.load_default(19))
        if "jnd" in row:
            change = f"{row['change_percent_of_mean']:.1f} % of the mean"
            said = f"{row['jnd']:+.2f} JND, pictures changed by {change}"
        else:
            said = row["outcome"]
        draw.text((x, y + 27), said[:80], FAINT, ImageFont.load_default(15))
        for column, panel in enumerate(panels(row)):
            panel.thumbnail((PANEL, PANEL), Image.Resampling.LANCZOS)
            if panel.width < PANEL and panel.height < PANEL:
                panel = panel.resize((PANEL, PANEL), Image.Resampling.BICUBIC)
            at = x + column * (PANEL + GAP) + (PANEL - panel.width) // 2
            canvas.paste(panel, (at, y + LABEL + (PANEL - panel.height) // 2))
    content = io.BytesIO()
    canvas.quantize(256).save(content, "PNG", optimize=True)
    return content.getvalue()


if __name__ == "__main__":
    main()
