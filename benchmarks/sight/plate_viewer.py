"""Speed and error of the moving lamp in pages, drawn by the CPU on 256 x 256 pixels.

python -m benchmarks.sight.plate_viewer      # two minutes; needs Chromium

It is drawn by WebGL 2, and by the 2-D canvas of browsers without that, which does not tilt. A frame takes the
light, the drawing and the reading of a pixel, which waits for both; a tilted one is drawn as while it moves.
Told are the median and the tenth of the times that is undisturbed, as a busy machine disturbs many. The
difference is the mean over four lamps, in % of the mean picture, from the fast look of the same matte plate
without sky.
"""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import numpy as np
import torch
from scipy import ndimage

from benchmarks.shared.browser import Browser
from benchmarks.shared.common import DOCS, machine, parser_of, publish, save, table
from mitsuba_scenes import find_texture
from relief.ground.arrays import Array
from relief.ground.srgb import linear_rgb
from relief.relief import Relief
from relief.surface import Surface
from retouch.pages.plate_viewer.figure import asset, component
from visual.backend import variants
from visual.fast.conversion import fast_renderer
from visual.geometry.halo import rise_of
from visual.lights.parallel import ParallelLights

TEXTURE, SIDES = "gravel-tile", (128, 256)
STAGE = """<div id="stage" style="position: relative; width: 256px; height: 256px">
<div class="plate-view"></div></div>"""
LAMPS = ((10.0, 35.0), (130.0, 35.0), (250.0, 20.0), (60.0, 60.0))
ALBEDO, REPEATS = 0.5, 40
SCRIPT = """(async () => {{
  const began = performance.now(), heights = Float32Array.from({heights});
  const view = window.view = new PlateView(document.querySelector(".plate-view"),
    {{ heights, after: heights, rows: {side}, cols: {side}, size_mm: {size_mm}, repeats: [true, true],
      ambient: 0 }});
  await view.ready;
  const ready = performance.now() - began, pixel = new Uint8Array(4);
  const {{ gl, context }} = view.screen;
  const waited = gl ? () => gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel)
    : () => context.getImageData(0, 0, 1, 1);
  const each = (change) => {{
    const times = [];
    for (let k = 0; k < {repeats}; k += 1) {{
      const since = performance.now();
      change(k);
      view.paint(true);
      waited();
      times.push(performance.now() - since);
    }}
    times.sort((a, b) => a - b);
    return [times[{repeats} / 2], times[{repeats} / 10]];
  }};
  const lamp = (k) => view.setLamp(9 * k, 20 + (k % 40));
  view.setSwipe(100);
  const one = each(lamp);
  view.setSwipe(50);
  const both = each(lamp);
  view.setSwipe(100);
  const tilted = view.tilts ? each((k) => view.setTilt(k - 20, 20)) : null;
  return [ready, one, both, tilted];
}})()"""
SHOWN = """(() => { const { width, height, data } = view.pixels();
  return [width, height, Array.from(data).filter((_, k) => k % 4 === 0)]; })()"""


def main() -> None:
    parser_of(__doc__).parse_args()
    results = [measure(side, webgl) for side in SIDES for webgl in (True, False)]
    save("plate_viewer", {"machine": machine(), "stage_pixels": 256, "texture": TEXTURE, "sizes": results})
    head = (
        "samples",
        "drawn by",
        "lamp, ms",
        "frames a s",
        "two plates, ms",
        "tilt, ms",
        "sky, ms",
        "difference, %",
    )
    rows = [
        [
            result["side"],
            "WebGL 2" if result["webgl"] else "2-D canvas",
            *(_both(result[key]) for key in ("lamp_ms", "frames_a_second", "both_ms", "tilt_ms")),
            round(result["ready_ms"]),
            result["difference_percent"],
        ]
        for result in results
    ]
    text = table(head, rows)
    publish(DOCS / "evidence" / "appearance.md", "plate viewer", "benchmarks.sight.plate_viewer", text)


def _both(values: list[float] | None) -> str:
    """The median and what is undisturbed."""
    return "" if values is None else " / ".join(f"{value:.3g}" for value in values)


def measure(side: int, webgl: bool) -> dict[str, Any]:
    """Times, ms, and the difference from the fast look, of a tile of so many samples a side."""
    tile = Relief.read(find_texture(TEXTURE), repeats=True)
    heights = ndimage.zoom(tile.heights, side / len(tile.heights), order=3, mode="grid-wrap", grid_mode=True)
    with tempfile.TemporaryDirectory() as folder, Browser(webgl=webgl) as browser:
        page = Path(folder) / "page.html"
        style, script = asset("plate_viewer.css"), component()
        page.write_text(f"<!doctype html><style>{style}</style>{STAGE}<script>{script}</script>")
        browser.open(page, 1280)
        script = SCRIPT.format(
            heights=np.round(heights, 6).ravel().tolist(), side=side, size_mm=tile.width_mm, repeats=REPEATS
        )
        ready, one, both, tilted = browser.evaluate(script)
        difference = difference_percent(browser, Surface(heights.shape, tile.width_mm, (True, True)), heights)
    return {
        **{
            "side": side,
            "webgl": webgl,
            "ready_ms": ready,
            "frames_a_second": [1000.0 / each for each in one],
        },
        **{"lamp_ms": one, "both_ms": both, "tilt_ms": tilted, "difference_percent": difference},
    }


def difference_percent(browser: Browser, surface: Surface, heights: Array) -> float:
    """Mean absolute difference of the open page from the fast look, % of the mean picture."""
    up, turn = np.radians([[elevation, azimuth] for azimuth, elevation in LAMPS]).T
    toward = np.stack([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)], axis=1)
    mi = variants.load_mitsuba(colour=False)
    bsdf = mi.load_dict({"type": "diffuse", "reflectance": {"type": "spectrum", "value": ALBEDO}})
    lights = [ParallelLights(each[None], np.full((1, 3), np.pi)) for each in toward]
    look = fast_renderer(surface, rise_of(heights), bsdf, lights, (0.0, 0.0, 0.0))
    browser.evaluate(f"stage.style.width = stage.style.height = '{len(heights)}px'; view.setTilt(0, 0)")
    differences = []
    for (azimuth, elevation), reference in zip(LAMPS, look.pictures(torch.as_tensor(heights)), strict=True):
        width, height, shown = browser.evaluate(f"view.setLamp({azimuth}, {elevation}); {SHOWN}")
        radiance = linear_rgb(np.reshape(shown, (height, width)) / 255.0)
        differences.append(np.abs(radiance - reference.numpy()).mean() / float(reference.mean()))
    return 100.0 * float(np.mean(differences))


if __name__ == "__main__":
    main()
