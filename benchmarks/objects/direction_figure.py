"""Pictures of wrapped parts for `benchmarks.objects.direction`: each from the front and above, on a sheet."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from benchmarks.objects.views import image_of, perspective
from relief.ground.srgb import srgb
from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts
from visual.backend.variants import choose_variant

PIXELS, SAMPLES, COLOURS = 300, 32, 48
"""Sides of a picture, its rays, and the greys that are kept."""


def shown(body: Body) -> Image.Image:
    """A body from the front and above, under a low sun from the left and a weak sky."""
    import mitsuba as mi

    mi.set_variant(choose_variant(colour=False).name)
    low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
    middle, radius = 0.5 * (low + high), 0.5 * float(np.linalg.norm(high - low))
    towards = np.array([-0.3, -1.0, 0.6]) / np.linalg.norm([-0.3, -1.0, 0.6])
    origin = middle + towards * radius / np.sin(np.radians(11.4))
    with tempfile.TemporaryDirectory() as folder:
        path = write_parts(Path(folder) / "part.ply", [Part("part", body)])
        scene = mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": "path", "max_depth": 3, "hide_emitters": True},
                "sensor": perspective(origin, middle, 24.0, (PIXELS, PIXELS), "luminance_alpha", SAMPLES),
                "sun": {"type": "directional", "direction": [0.8, 0.35, -0.4], "irradiance": 2.2},
                "sky": {"type": "constant", "radiance": 0.15},
                "part": {
                    "type": "ply",
                    "filename": str(path),
                    "face_normals": True,
                    "bsdf": {"type": "diffuse", "reflectance": 0.6},
                },
            }
        )
        pixels = np.array(mi.render(scene), dtype=np.float64)
    alpha = np.clip(pixels[..., 1], 0.0, 1.0)
    grey = srgb(pixels[..., 0], 0.8) * alpha + 1.0 - alpha
    return image_of(grey)


def sheet(pictures: dict[str, list[Image.Image]]) -> Image.Image:
    """A column for each part: as before, along, across."""
    names, margin = list(pictures), 24
    picture = Image.new("L", (margin + PIXELS * len(names), margin + 3 * PIXELS), 255)
    draw, font = ImageDraw.Draw(picture), ImageFont.load_default(16)
    for column, name in enumerate(names):
        draw.text((margin + (column + 0.5) * PIXELS, 2), name, 0, font, anchor="ma")
        for row, part in enumerate(pictures[name][:3]):
            picture.paste(part, (margin + column * PIXELS, margin + row * PIXELS))
    for row, name in enumerate(("no direction", "along", "across")):
        label = Image.new("L", (PIXELS, margin), 255)
        ImageDraw.Draw(label).text((PIXELS / 2, 2), name, 0, font, anchor="ma")
        picture.paste(label.rotate(90, expand=True), (0, margin + row * PIXELS))
    return picture.quantize(COLOURS)
