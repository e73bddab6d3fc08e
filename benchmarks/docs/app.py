"""The app in headless Chromium: how fast it answers, and a picture of every stage for docs/tutorials/app.md.

python -m benchmarks.docs.app                 # both: four minutes; needs Chromium
python -m benchmarks.docs.app times           # or one of the two
python -m benchmarks.docs.app pictures

The browser draws without a graphics card. The pictures show a photograph of scikit-image that no other part
of Retouch uses.
"""

from __future__ import annotations

import json
import statistics
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
import skimage.data
from PIL import Image

from benchmarks.docs import drafts
from benchmarks.shared.app_window import COMMAND, FELT, SHOWN, App, Window
from benchmarks.shared.common import DOCS, machine, parser_of, publish, save, table

STARTS, MOVES = 5, 8
LARGE_SIDE = 8192
"""Side of the large picture, pixels: 201 MB without compression."""
REACH = "document.querySelector('.jnd-cost .curve')"
MOVED = """(async () => {{
  const input = document.querySelector("input.range"), stale = () => document.querySelector(".number.stale");
  const text = () => document.querySelector(".number .value").innerText;
  const before = text(), since = performance.now();
  const until = async (sure) => {{ while (!sure()) await new Promise((done) => setTimeout(done, 5)); }};
  input.value = {relief_mm};
  input.dispatchEvent(new Event("input"));
  await until(() => text() !== before);
  const here = performance.now() - since;
  await until(() => !stale());
  return [here / 1000, (performance.now() - since) / 1000];
}})()"""
"""Script: seconds from a move of the slider of the relief to the feel at one place, and all over."""
IDLE = "!document.querySelector('.busy').innerText"
DRAFTED = """(() => {{
  const state = document.querySelector(".draft .state")?.innerText.replace("\u2212", "-") ?? "";
  const reached = Number(state.match(/^Draft: ([+-][0-9.]+) JND/)?.[1]);
  const [before, after] = document.querySelector(".relief-stage")?.dataset.shown?.split(" ") ?? [];
  return Math.abs(reached - {jnd}) < 0.12 && after && before !== after;
}})()"""
"""Script: whether a draft of this many JND is lit, beside the original."""
SLID = """(async () => {{
  const input = document.querySelector(".jnd-slider input"), since = performance.now();
  const shown = () => document.querySelector(".relief-stage").dataset.shown, before = shown();
  input.value = {jnd};
  input.dispatchEvent(new Event("input"));
  while (shown() === before || !{drafted}) await new Promise((done) => setTimeout(done, 5));
  return (performance.now() - since) / 1000;
}})()"""
"""Script: seconds from a move of the slider of the feel to a draft of this many JND."""
NEAR_JND = (2.3, 2.6, 2.9, 3.2, 1.7, 1.4, 1.1, 0.8)
"""Moves of the slider after the usual +2 JND, each 0.3 JND from a result that is known by then."""
COLD = 5
FRAMES = """(async () => {
  const stage = document.querySelector(".relief-stage"), box = stage.getBoundingClientRect();
  const at = (k) => ({
    clientX: box.left + box.width * (0.5 + 0.3 * Math.cos(k / 9)),
    clientY: box.top + box.height * (0.5 + 0.3 * Math.sin(k / 9)),
    pointerId: 1, button: 0, buttons: 1, bubbles: true,
  });
  stage.setPointerCapture = () => {};
  stage.dispatchEvent(new PointerEvent("pointerdown", at(0)));
  const since = performance.now();
  let frames = 0;
  while (performance.now() - since < 3000) {
    stage.dispatchEvent(new PointerEvent("pointermove", at(frames)));
    await new Promise(requestAnimationFrame);
    frames += 1;
  }
  stage.dispatchEvent(new PointerEvent("pointerup", at(frames)));
  return [frames / 3, Math.round(box.width)];
})()"""
"""Script: frames a second while the lamp is dragged over the stage, and its width in pixels."""


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("part", nargs="?", choices=("times", "pictures"))
    part = parser.parse_args().part
    with tempfile.TemporaryDirectory() as folder, Window(webgl=True) as window:
        if part != "pictures":
            _tell(times(window, Path(folder)))
        if part != "times":
            pictures(window, Path(folder), DOCS / "images")


def times(window: Window, folder: Path) -> dict[str, Any]:
    """Seconds of what a person waits for."""
    result: dict[str, Any] = {"machine": machine()}
    starts = []
    for number in range(STARTS):
        (own := folder / f"start-{number}").mkdir()
        begun = time.monotonic()
        with App(own) as app:
            window.visit(app.address)
            window.wait(SHOWN)
            starts.append(time.monotonic() - begun)
    result["first_relit_s"] = starts
    for name, texture in (("plate", "gravel"), ("tile", "gravel-tile")):
        (own := folder / name).mkdir()
        with App(own, texture) as app:
            window.visit(app.address)
            window.wait(f"{SHOWN} && {FELT}")
            # The scale of the textures is pressed once, after which nothing is under way.
            window.wait("document.querySelectorAll('.scale-mark').length > 11")
            # A moment later the models of drafts are loaded.
            time.sleep(2.0)
            window.wait(IDLE)
            if name == "plate":
                result["frames"] = window.evaluate(FRAMES)
            moves = [window.evaluate(MOVED.format(relief_mm=0.5 + 0.15 * k)) for k in range(MOVES)]
            result[f"{name}_one_place_s"] = [one for one, _ in moves]
            result[f"{name}_all_over_s"] = [whole for _, whole in moves]
            cold = [_from_nothing(window, 0.55 + 0.2 * k) for k in range(COLD)]
            result["draft_cold_s" if name == "plate" else "draft_tiles_s"] = _median_and_worst(cold)
            begun = time.monotonic()
            window.wait(REACH, 120)
            result[f"{name}_reach_s"] = time.monotonic() - begun
            if name == "plate":
                near = []
                for jnd in NEAR_JND:
                    window.wait(IDLE)
                    near.append(window.evaluate(SLID.format(jnd=jnd, drafted=DRAFTED.format(jnd=jnd))))
                result["draft_near_s"] = _median_and_worst(near)
    noise = np.random.default_rng(0).integers(0, 256, (LARGE_SIDE, LARGE_SIDE, 3), dtype=np.uint8)
    Image.fromarray(noise).save(folder / "large.png", compress_level=0)
    (own := folder / "large").mkdir()
    with App(own, "gravel") as app:
        window.visit(app.address)
        window.wait(f"{SHOWN} && {FELT}")
        begun, before = time.monotonic(), window.evaluate(SHOWN)
        window.choose_file(".drop-zone input[type=file]", folder / "large.png")
        window.wait(f"{SHOWN} != {json.dumps(before)}")
        result["large_shown_s"] = time.monotonic() - begun
        window.wait(FELT)
        result["large_felt_s"] = time.monotonic() - begun
        result["large_bytes"] = (folder / "large.png").stat().st_size
    return result


def _from_nothing(window: Window, relief_mm: float) -> float:
    """Seconds from turning to the feel of another relief to the draft of the usual +2 JND."""
    window.click_text("nav button", "Picture")
    window.wait("document.querySelector('input.range') && document.querySelector('.number .value')")
    window.evaluate(MOVED.format(relief_mm=relief_mm))
    window.wait(IDLE)
    window.click_text("nav button", "Feel")
    begun = time.monotonic()
    window.wait(f"document.querySelector('.draft') && {DRAFTED.format(jnd=2.0)}")
    return time.monotonic() - begun


def _median_and_worst(seconds: list[float]) -> dict[str, Any]:
    return {"median": statistics.median(seconds), "worst": max(seconds), "each": seconds}


def _tell(result: dict[str, Any]) -> None:
    save("app", result | drafts.agreement())

    def spread(name: str) -> str:
        values = result[name]
        return f"{statistics.median(values):.2f} ({min(values):.2f} to {max(values):.2f})"

    rows = [["from the command to the first relit picture", spread("first_relit_s")]]
    for name, words in (("plate", "a plate, one place"), ("tile", "a tile, 16 places")):
        rows += [
            [f"a move of the relief to the feel at one place: {words}", spread(f"{name}_one_place_s")],
            [f"to the feel all over: {words}", spread(f"{name}_all_over_s")],
            [f"how far the look is kept: {words}", f"{result[f'{name}_reach_s']:.1f}"],
        ]
    for name, words in (
        ("near", "a move of 0.3 JND to its draft: a plate"),
        ("cold", "a draft from nothing: a plate"),
        ("tiles", "a draft from nothing: a tile, 4 contact locations"),
    ):
        values = result[f"draft_{name}_s"]["each"]
        spread_of = f"{statistics.median(values):.2f} ({min(values):.2f} to {max(values):.2f})"
        rows.append([words, spread_of])
    megabytes = f"{result['large_bytes'] / 1e6:.0f} MB"
    rows.append([f"a picture of {megabytes} to its relief", f"{result['large_shown_s']:.1f}"])
    rows.append([f"a picture of {megabytes} to its feel", f"{result['large_felt_s']:.1f}"])
    frames, width = result["frames"]
    rows.append([f"frames a second while the lamp is dragged, {width} × {width} pixels", f"{frames:.0f}"])
    text = table(("what is waited for", "seconds: median (least to most)"), rows)
    publish("speed", "app", text)


def pictures(window: Window, folder: Path, images: Path) -> None:
    """A picture of every stage, on the way from a photograph to a print and an object."""
    photograph = folder / "coffee.jpg"
    Image.fromarray(skimage.data.coffee()).save(photograph, quality=92)
    (own := folder / "pictures").mkdir()

    def stage(name: str) -> None:
        window.click_text("nav button", name)
        window.wait(f"document.querySelector('nav [aria-current=page]').innerText == '{name}'")
        time.sleep(0.5)

    def shot(name: str) -> None:
        # Light and fonts settle.
        time.sleep(1.5)
        window.shot(images / f"app-{name}.png")

    with App(own) as app:
        window.visit(app.address)
        window.wait(SHOWN)
        window.choose_file(".drop-zone input[type=file]", photograph)
        window.wait(f"{COMMAND}.includes('coffee')")
        window.wait("document.querySelector('.crop-box img')?.complete")
        left, top, width, height = window.place(".crop-box")
        corners = [(0.46, 0.3), (0.6, 0.5), (0.74, 0.72)]
        window.drag([(left + right * width, top + down * height) for right, down in corners])
        window.wait(f"{COMMAND}.includes('--crop=')")
        window.click_text(".q-toggle__label", "Make a tile that repeats")
        window.wait(f"{COMMAND}.includes('--tile')")
        window.wait(FELT)
        window.wait("document.querySelectorAll('.scale-mark').length > 11")
        window.evaluate("document.querySelector('.side').scrollTop = 0")
        shot("picture")
        stage("Feel")
        window.wait(REACH, 120)
        shot("feel")
        stage("Run")
        window.click_text(".side button", "Run")
        window.wait("/-1: (done|ended)/.test(document.querySelector('.state')?.innerText)", 300)
        stage("Compare")
        window.wait("document.querySelector('.side').innerText.includes('verified by')")
        shot("compare")
        window.click_text(".ways button", "Feel")
        shot("places")
        stage("Object")
        window.click_text(".side button", "Show")
        window.wait("document.querySelector('iframe').src.includes('page')", 120)
        time.sleep(5)
        shot("object")
        stage("Feel")
        window.click(".side .q-toggle")
        window.wait("document.querySelector('.brush')?.offsetParent")
        left, top, width, height = window.place(".brush")
        window.click_text(".side .choice button", "large")
        window.click_text(".q-toggle__label", "Soft edge")
        time.sleep(0.5)
        way = [(0.15 + 0.07 * k, 0.5 + 0.25 * np.sin(0.6 * k)) for k in range(11)]
        window.drag([(left + right * width, top + down * height) for right, down in way])
        window.wait(f"{COMMAND}.includes('graded')")
        shot("paint")
        if faults := window.faults():
            raise RuntimeError("; ".join(faults))


if __name__ == "__main__":
    main()
