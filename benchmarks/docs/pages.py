"""Pages in a real browser: whether a page asks for anything, complains, or cuts off what it says.

python -m benchmarks.docs.pages runs/gravel/report.html comparison.html
python -m benchmarks.docs.pages report.html --pictures shown     # pictures of each page at each width as well

Exit status 1 if there is a fault.
"""

from __future__ import annotations

import sys
from pathlib import Path

from benchmarks.shared.browser import Browser
from benchmarks.shared.common import parser_of

WIDTHS = (390, 1280, 1920)
"""Widths of the window, CSS pixels: a phone, a laptop, a desk."""
TALLEST = 4000
"""Longest side of a picture of a page, CSS pixels; a longer page takes several."""

LAYOUT = r"""
(() => {
  const faults = [];
  const wide = document.documentElement.clientWidth;
  const told = (text) => JSON.stringify(text.trim().replace(/\s+/g, " ").slice(0, 60));
  const cuts = (box, frame) => box.left < frame.left - 1 || box.right > frame.right + 1
    || box.top < frame.top - 1 || box.bottom > frame.bottom + 1;
  if (document.documentElement.scrollWidth > wide) faults.push("the page is wider than the window");

  // Every line of text lies inside the window and inside all that hides what reaches beyond it. The table of
  // every step is meant to be scrolled.
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const parent = node.parentElement;
    if (!node.data.trim() || parent.closest("script, style, .record, .sideways")) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    const boxes = [...range.getClientRects()];
    if (!boxes.length || getComputedStyle(parent).visibility === "hidden") continue;
    const beyond = boxes.some((box) => box.left < -1 || box.right > wide + 1);
    if (beyond) faults.push(`beyond the window: ${told(node.data)}`);
    for (let frame = parent; frame; frame = frame.parentElement) {
      if (getComputedStyle(frame).overflowX === "visible") continue;
      if (boxes.some((box) => cuts(box, frame.getBoundingClientRect()))) {
        faults.push(`cut off: ${told(node.data)}`);
        break;
      }
    }
    // A short word of a label or a table stays in one piece.
    if (!parent.closest("th, td, .name, .tick, .tag, .end, .key, .big, button, dt")) continue;
    for (const word of node.data.matchAll(/\S+/g)) {
      if (word[0].length > 18) continue;
      range.setStart(node, word.index);
      range.setEnd(node, word.index + word[0].length);
      const tops = [...range.getClientRects()].map((box) => Math.round(box.top));
      if (tops.some((top) => Math.abs(top - tops[0]) > 3)) faults.push(`broken: ${told(word[0])}`);
    }
  }

  // No two labels of a chart lie on one another.
  for (const chart of document.querySelectorAll(".chart, .dots, .bar, .profile, .pair, .two")) {
    const labels = [...chart.querySelectorAll(".tick, .end, .tag, .track span, .dots .name, .x-name")]
      .filter((label) => label.textContent.trim() && getComputedStyle(label).visibility !== "hidden")
      .map((label) => [label, label.getBoundingClientRect()]);
    labels.forEach(([label, one], place) => labels.slice(place + 1).forEach(([other, two]) => {
      const across = Math.min(one.right, two.right) - Math.max(one.left, two.left);
      const down = Math.min(one.bottom, two.bottom) - Math.max(one.top, two.top);
      const both = `${told(label.textContent)} and ${told(other.textContent)}`;
      if (across > 1 && down > 1) faults.push(`on one another: ${both}`);
    }));
  }
  return [...new Set(faults)];
})()
"""
"""Script that lists what is cut off, broken or covered on the page."""


def faults(browser: Browser, file: Path, width: int) -> list[str]:
    """Faults of a page in a window of this width, a line each."""
    seen = browser.open(file, width)
    found = [f"asks for {address}" for address in seen.asked]
    found += [f"complains: {complaint}" for complaint in seen.complaints]
    found += browser.evaluate(LAYOUT)
    browser.evaluate("document.querySelectorAll('details').forEach((part) => { part.open = true; })")
    return found + [
        f"with all details open, {fault}" for fault in browser.evaluate(LAYOUT) if fault not in found
    ]


def pictures(browser: Browser, file: Path, width: int, folder: Path) -> None:
    """Write pictures of a whole page, `<name>-<width>-<number>.png`."""
    browser.open(file, width)
    height = browser.evaluate("document.documentElement.scrollHeight")
    for number, top in enumerate(range(0, height, TALLEST), start=1):
        clip = (0.0, float(top), float(width), float(min(TALLEST, height - top)))
        browser.picture(folder / f"{file.stem}-{width}-{number}.png", clip)


def main() -> int:
    parser = parser_of(__doc__)
    parser.add_argument("pages", nargs="+", type=Path, metavar="PAGE")
    parser.add_argument("--pictures", type=Path, metavar="DIR", help="folder for pictures of the pages")
    arguments = parser.parse_args()
    wrong = 0
    with Browser(webgl=True) as browser:
        for page in arguments.pages:
            for width in WIDTHS:
                found = faults(browser, page, width)
                print(f"{page}, {width} pixels: {'; '.join(found) or 'nothing wrong'}")
                wrong += len(found)
                if arguments.pictures is not None:
                    arguments.pictures.mkdir(parents=True, exist_ok=True)
                    pictures(browser, page, width, arguments.pictures)
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
