"""Public scenes of Mitsuba 3 with a plate: what Retouch says of them, and whether it renders as Mitsuba does.

python -m benchmarks.sight.public_scenes FOLDER           # what is not in the results yet, a minute a scene
python -m benchmarks.sight.public_scenes FOLDER --again

FOLDER holds the repositories of `EXAMPLES` at the commits of `COMMITS`, as FOLDER/owner/name; nothing of them
is committed here. Each scene is tried as it is, then with the plate in place of one of its shapes, then with
one edit more at a time, so that every refusal is seen. In all of them includes are written out, and the
longer side of the film has `PIXELS` pixels. The first and the last scene that Retouch accepts are rendered by
Retouch, light by light, and by `mi.load_file` with the height field's plugin, all lights at once.
"""

from __future__ import annotations

import re
import shutil
import tempfile
import xml.etree.ElementTree as ElementTree
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.shared.common import DOCS, kept, load, parser_of, publish, table
from benchmarks.sight.public_examples import COMMITS, EXAMPLES, RELIEF, Example
from benchmarks.sight.step_bias import bias_percent, digits, of_steps, rendered, waves
from relief.ground.arrays import Array
from relief.ground.errors import InputError
from visual.backend import heightfield, variants
from visual.exact.render import RenderSettings, light_pictures
from visual.explain import GRADIENTS, NO_GRADIENTS, explain_scene
from visual.scene import Scene, load_scene

NAME, COMMAND = "public_scenes", "benchmarks.sight.public_scenes"
PIXELS, SAMPLES, SEEDS, STRIDE = 64, 64, (1, 2, 3, 4), 3
"""Longer side of the films; samples a pixel; seeds; pixels from one that is compared to the
next where a filter makes the noise of neighbours alike."""
SIGMAS = 4.0
"""Standard errors of the mean product of differences within which two sets of pictures are called equal."""
STEEPNESS = 0.1
"""Height of the relief over the height of the plate."""
HIGHEST_MM = 20.0
"""Largest height of a relief that Retouch reads from a file, mm."""


def measure(example: Example, downloads: Path) -> dict[str, Any]:
    """What Retouch says of an example, edit by edit, and how it renders what it accepts."""
    steps: list[dict[str, Any]] = []
    source = downloads / example.repository / example.path
    root = read(source)
    with tempfile.TemporaryDirectory() as folder:
        for number, (words, edit) in enumerate((("as it is", None), *example.edits)):
            if edit is not None:
                edit(root)
            scene = write(root, source, example, Path(folder) / f"{number}")
            steps.append({"changed": words} | said(scene, example))
        accepted = [number for number, step in enumerate(steps) if "refused" not in step]
        for number in sorted({*accepted[:1], *accepted[-1:]}):
            scene = Path(folder) / f"{number}" / source.name
            steps[number] |= against_mitsuba(scene, example)
            if number == accepted[-1] and steps[number]["gradients"] == "there":
                steps[number] |= bias_of_steps(scene, example)
    return {"commit": COMMITS[example.repository], "steps": steps}


def read(path: Path) -> ElementTree.Element:
    """The tree of a scene file, with its includes written out."""
    root = ElementTree.parse(path).getroot()
    for include in root.findall("include"):
        place = list(root).index(include)
        root.remove(include)
        for number, child in enumerate(read(path.parent / include.attrib["filename"])):
            root.insert(place + number, child)
    return root


def write(root: ElementTree.Element, source: Path, example: Example, folder: Path) -> Path:
    """The scene, the files that it names and its relief, in a folder of their own; the scene's path."""
    folder.mkdir()
    named = {element.attrib["value"] for element in root.iter("string") if element.get("name") == "filename"}
    places = [source.parent, *(source.parent / each.attrib["value"] for each in root.iter("path"))]
    # A path may be gone from the scene; its files are beside the scene from then on.
    places += [source.parents[level] / "common" for level in (1, 2, 3, 4) if level < len(source.parents)]
    for name in named - {RELIEF}:
        found = next((place / name for place in places if (place / name).is_file()), None)
        if found is not None and ".." not in name:
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy(found, folder / name)
    rows, cols = example.samples
    np.save(folder / RELIEF, waves(rows, cols) * min(STEEPNESS * example.size_mm * rows / cols, HIGHEST_MM))
    _limit_film(root)
    ElementTree.ElementTree(root).write(folder / source.name)
    return folder / source.name


def _limit_film(root: ElementTree.Element) -> None:
    """Give the film at most `PIXELS` along its longer side; 768 x 576 are Mitsuba's usual ones."""
    defaults = {each.attrib["name"]: each.attrib["value"] for each in root.iter("default")}
    for film in root.iter("film"):
        sides = {side: film.find(f"integer[@name='{side}']") for side in ("width", "height")}
        pixels = {"width": 768, "height": 576}
        for side, element in sides.items():
            if element is not None:
                value = element.attrib["value"]
                pixels[side] = int(defaults[value[1:]] if value.startswith("$") else value)
        for side, element in sides.items():
            if element is None:
                element = ElementTree.SubElement(film, "integer", name=side)
            element.set("value", f"{round(pixels[side] * min(1.0, PIXELS / max(pixels.values())))}")


def said(scene: Path, example: Example) -> dict[str, Any]:
    """What `retouch render --explain` says of a scene: its refusal, or its gradients and its lights."""
    try:
        lines = dict(explain_scene(scene, example.defines if "$alpha" in scene.read_text() else None))
    except InputError as refusal:
        return {"refused": str(refusal).replace(f"{scene.parent}/", "")}
    except Exception as error:  # An error that is no refusal is a fault of Retouch, which the table shows.
        return {"refused": f"internal error: {type(error).__name__}: {error}"}
    gradients = lines["gradients"]
    return {
        "gradients": "there" if gradients == GRADIENTS else gradients.removeprefix(NO_GRADIENTS),
    }


def against_mitsuba(path: Path, example: Example) -> dict[str, Any]:
    """Pictures of an accepted scene by Retouch and by Mitsuba alone."""
    import mitsuba

    mi: Any = mitsuba
    defines = example.defines if "$alpha" in path.read_text() else {}
    try:
        scene = load_scene(path, defines)
        ours = np.stack([everything(scene, seed) for seed in SEEDS])
    except InputError as refusal:
        return {"refused at render": str(refusal)}
    variants.use(scene.variant)
    heightfield.register()
    mi.file_resolver().prepend(str(path.parent))
    plain = mi.load_file(str(path), **defines)
    theirs = np.stack([_channels(np.array(mi.render(plain, spp=SAMPLES, seed=100 + seed))) for seed in SEEDS])
    filtered = any(camera.filter is not None for camera in scene.light_scenes()[0].cameras)
    some = slice(None, None, STRIDE if filtered else 1)
    bias, noise = bias_percent(ours[..., some, some], theirs[..., some, some])
    return {
        "variant": scene.variant,
        "differs_percent": [float(f"{b:.3g}") for b in bias],
        "noise_percent": [float(f"{n:.3g}") for n in noise],
        "sigmas": float(f"{np.max(np.sign(bias) * (bias / np.where(noise > 0.0, noise, 1.0)) ** 2):.3g}"),
        "mean_ratio": float(f"{ours.mean() / theirs.mean():.5g}"),
    }


def everything(scene: Scene, seed: int) -> Array:
    """Picture (channels, rows, cols) of all lights of a scene together, by its first camera."""
    variants.use(scene.variant)
    settings = RenderSettings(SAMPLES, seed, shadow_edges=False, colour=scene.colour)
    each = [light_pictures(of, scene.heights, settings, i) for i, of in enumerate(scene.light_scenes())]
    total = np.sum(each, axis=0)
    return np.asarray(total[:, 0] if scene.colour else total[:1])


def _channels(picture: Array) -> Array:
    """A picture of Mitsuba's as (channels, rows, cols), without alpha."""
    return np.moveaxis(picture[..., : 3 if picture.shape[2] >= 3 else 1], 2, 0).astype(np.float64)


def bias_of_steps(path: Path, example: Example) -> dict[str, Any]:
    """Bias of the pictures of a step, against pictures of direct light."""
    text = path.read_text()
    direct = '<integrator type="path"><integer name="max_depth" value="2"/></integrator>'
    changed = re.sub(r"<integrator.*?(/>|</integrator>)", direct, text, count=1, flags=re.DOTALL)
    if "</integrator>" in text:
        changed = re.sub(r"<integrator.*</integrator>", direct, text, count=1, flags=re.DOTALL)
    beside = path.with_name("direct.xml")
    beside.write_text(changed)
    try:
        scene = load_scene(beside, example.defines if "$alpha" in text else None)
        steps = np.stack([of_steps(scene, seed) for seed in SEEDS])
        jacobians = [j for view in scene.views() for j in view.evaluate(scene.heights).jacobians]
        pictures = np.stack([rendered(scene, seed) for seed in SEEDS])
    except InputError as refusal:
        return {"steps refused": str(refusal).replace(f"{path.parent}/", "")}
    except Exception as error:  # As above.
        return {"steps refused": f"internal error: {type(error).__name__}: {error}"}
    values, noise = bias_percent(steps, pictures)
    names = scene.conditions
    return {
        "bias_percent": {name: float(f"{value:.3g}") for name, value in zip(names, values, strict=True)},
        "jacobians are finite": all(bool(np.isfinite(jacobian.data).all()) for jacobian in jacobians),
        "jacobians of zeros": sum(not jacobian.nnz or not jacobian.data.any() for jacobian in jacobians),
        "bias_noise_percent": {name: float(f"{value:.3g}") for name, value in zip(names, noise, strict=True)},
    }


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("folder", type=Path, metavar="FOLDER")
    parser.add_argument("--again", action="store_true")
    arguments = parser.parse_args()
    for example in EXAMPLES:
        kept(NAME, "scenes", example.name, partial(measure, example, arguments.folder), arguments.again)
    publish(DOCS / "evidence" / "appearance.md", NAME, COMMAND, as_table(load(NAME)))


def as_table(results: dict[str, Any]) -> str:
    """A row for each scene as Markdown."""
    rows = []
    for example in EXAMPLES:
        steps = results["scenes"][example.name]["steps"]
        accepted = next(number for number, step in enumerate(steps) if "refused" not in step)
        measured = [step for step in steps if "differs_percent" in step]
        rows.append(
            [
                example.path,
                "; ".join(changes(steps[: accepted + 1], "refused", f"{Path(example.path).name}: ")),
                "; ".join(dict.fromkeys(map(equality, measured))),
                "; ".join(changes(steps[accepted:], "gradients")) or "at once",
                *(bias(step) for step in (results["before"].get(example.name, {}), measured[-1])),
            ]
        )
    head = ("scene", "refused, and changed for it", "beside Mitsuba", "no gradients, and changed for it")
    return table((*head, "bias of steps before, %", "now, %"), rows)


def changes(steps: list[dict[str, Any]], key: str, before: str = "") -> list[str]:
    """Each refusal of some steps with the edits after which it is gone."""
    found, edits = [], []
    for step, following in pairwise(steps):
        edits.append(following["changed"])
        if step.get(key) != following.get(key) and step.get(key) != "there":
            reason = str(step[key]).removeprefix(before).replace("|", "\\|")
            found.append(f"`{reason}`: {', '.join(edits)}")
            edits = []
    return found


def equality(step: dict[str, Any]) -> str:
    """Whether pictures are those of Mitsuba, within their noise."""
    ratio = step["mean_ratio"]
    if step["sigmas"] > SIGMAS:
        return f"**{ratio:.3g} times as bright**, {step['sigmas']:.0f} standard errors"
    return f"equal ({step['sigmas']:+.1f})"


def bias(step: dict[str, Any]) -> str:
    """The largest bias of the conditions of a step, or why there is none."""
    if "bias_percent" not in step:
        return str(step.get("steps refused", "-"))
    pairs = zip(step["bias_percent"].values(), step["bias_noise_percent"].values(), strict=True)
    value, noise = max(pairs)
    return f"below {digits(2.0 * noise)}" if value <= 1.4 * noise else digits(value)


if __name__ == "__main__":
    main()
