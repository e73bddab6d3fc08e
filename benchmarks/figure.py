"""The picture of the README: three textures, made two JND rougher by Retouch and by scaling their height.

python -m benchmarks.figure               # writes docs/images/rougher.png
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont

import tactile
from benchmarks.runs import GAUSS_NEWTON_STEPS, RELIEFS
from optimize.descent.driver import descend
from optimize.descent.gauss_newton import GaussNewton
from optimize.descent.linear_scaling import linear_scaling
from optimize.descent.problem import Problem
from optimize.descent.targets import Targets
from optimize.report.colour_maps import srgb
from optimize.report.metrics import mean_change
from relief.arrays import Array
from visual.scene import Scene, load_scene

JND = 2
RESOLUTION, SAMPLES = 384, 256
CONDITION = 0
GAP, HEAD, FOOT, INK, PAPER = 16, 34, 30, (32, 32, 36), (253, 252, 250)
COLUMNS = ("original", "Retouch: +2 JND", "scaled in height: +2 JND")


def main() -> None:
    tiles: list[list[Array | None]] = []
    captions = []
    for texture, relief_mm in RELIEFS.items():
        reliefs, roughness = optimise(texture, relief_mm)
        scene = _scene(texture, relief_mm)
        pictures = [None if r is None else _picture(scene, r) for r in reliefs]
        before = pictures[0]
        assert before is not None
        exposure = float(np.percentile(before, 99.5))
        tiles.append([None if p is None else np.asarray(srgb(p, exposure)) for p in pictures])
        captions.append(
            [
                "out of reach below 3 mm"
                if p is None
                else f"{texture}, V {v:.4f}"
                if i == 0
                else f"V {v:.4f}, picture changed by {100 * mean_change(before, p) / before.mean():.1f} %"
                for i, (p, v) in enumerate(zip(pictures, roughness, strict=True))
            ]
        )
    path = Path("docs/images/rougher.png")
    path.parent.mkdir(parents=True, exist_ok=True)
    compose(tiles, captions).save(path, optimize=True)
    print(path)


def optimise(texture: str, relief_mm: float) -> tuple[list[Array | None], list[float]]:
    """The original, our result and the scaled relief, with their roughnesses."""
    scene = _scene(texture, relief_mm)
    skin = tactile.Skin()

    def roughness(heights: Array | None) -> float:
        if heights is None:
            return float("nan")
        return float(tactile.roughness(tactile.press(heights, scene.size_mm, skin).strain, scene.size_mm))

    targets = Targets.of(0.01, roughness=tactile.jnd_scaled(roughness(scene.heights), JND))
    problem = Problem(scene.heights, scene.size_mm, skin, targets, scene)
    way = GaussNewton(problem)
    ours = descend(way, targets, way.begin(0, scene.heights, {}), GAUSS_NEWTON_STEPS).best.heights
    reliefs = [scene.heights, ours, linear_scaling(problem)]
    return reliefs, [roughness(r) for r in reliefs]


def compose(tiles: list[list[Array | None]], captions: list[list[str]]) -> Image.Image:
    """Tiles in [0, 1] in rows and columns, with heads and captions."""
    width = GAP + len(COLUMNS) * (RESOLUTION + GAP)
    height = HEAD + len(tiles) * (RESOLUTION + FOOT) + GAP
    sheet = Image.new("RGB", (width, height), PAPER)
    draw = ImageDraw.Draw(sheet)
    large, small = ImageFont.load_default(18), ImageFont.load_default(14)
    for column, name in enumerate(COLUMNS):
        draw.text((GAP + column * (RESOLUTION + GAP), 8), name, INK, font=large)
    for row, (pictures, texts) in enumerate(zip(tiles, captions, strict=True)):
        top = HEAD + row * (RESOLUTION + FOOT)
        for column, (picture, text) in enumerate(zip(pictures, texts, strict=True)):
            left = GAP + column * (RESOLUTION + GAP)
            if picture is not None:
                sheet.paste(Image.fromarray(np.rint(255.0 * picture).astype(np.uint8)), (left, top))
            draw.text((left, top + RESOLUTION + 5), text, INK, font=small)
    return sheet


def _scene(texture: str, relief_mm: float) -> Scene:
    return load_scene(
        "mitsuba_scenes/studio.xml", texture=f"mitsuba_scenes/textures/{texture}.png", relief_mm=relief_mm
    )


def _picture(scene: Scene, heights: Array) -> Array:
    pictures = scene.render(heights, samples=SAMPLES, seed=1, resolution=RESOLUTION)
    return np.asarray(pictures[CONDITION].numpy())


if __name__ == "__main__":
    main()
