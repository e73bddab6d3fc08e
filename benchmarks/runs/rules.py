"""What each rule of `visual.needs` saves: seconds of pictures with every rule and without one of them."""

from __future__ import annotations

import re
import shutil
import statistics
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

from mitsuba_scenes import FOLDER
from visual import loading
from visual import scene as scenes
from visual.scene import Scene, load_scene

MATTE = '<bsdf type="diffuse"><rgb name="reflectance" value="0.5"/></bsdf>'
SUN_DISK = """<shape type="disk">
<transform name="to_world">
    <scale value="60"/><lookat origin="0, 800, 600" target="0, 0, 0" up="0, 0, 1"/>
</transform>
<emitter type="area" id="disk"><rgb name="radiance" value="200"/></emitter>
</shape>"""
RULES: Mapping[str, Mapping[str, Any]] = {
    "one bounce": {"direct": False},
    "one channel": {"colour": True},
    "random rays": {},
    "view from straight above": {"top_view": (False,)},
}
"""Rule of `visual.needs` -> needs that replace those of the rule. Random rays, sent off the plate to meet a
light by chance, are a setting of the integrator."""


def rules() -> list[dict[str, Any]]:
    """CPU seconds of pictures (64 samples) and of a step's Jacobians, with and without each rule."""
    rows = []
    with tempfile.TemporaryDirectory() as folder:
        for name, path in rule_scenes(Path(folder)).items():
            for rule in ("", *RULES):
                if rule == "view from straight above" and name == "five views":
                    continue
                with without(rule):
                    row = {"scene": name, "without": rule or "-", **picture_seconds(load_scene(path))}
                rows.append(row)
                print(row, flush=True)
    return rows


def picture_seconds(scene: Scene) -> dict[str, float]:
    """CPU seconds of all pictures, and of all with their Jacobians as in a step."""
    views = scene.views(2 * max(scene.resolution), strata=2)
    return {
        "render_cpu_s": median_cpu(lambda: scene.render(samples=64)),
        "step_cpu_s": median_cpu(lambda: [view.evaluate(scene.heights) for view in views]),
    }


def median_cpu(work: Callable[[], object]) -> float:
    """Median CPU seconds of three calls, after one to warm up."""
    work()
    seconds = []
    for _ in range(3):
        began = time.process_time()
        work()
        seconds.append(time.process_time() - began)
    return statistics.median(seconds)


@contextmanager
def without(rule: str) -> Iterator[None]:
    """Load scenes as if a rule did not exist."""
    needs_of, integrator = scenes.needs_of, loading._integrator
    if rule == "random rays":
        loading._integrator = lambda needs, bsdf_samples: integrator(needs, 1)
    elif rule:
        scenes.needs_of = lambda *scene: replace(needs_of(*scene), **RULES[rule])
    try:
        yield
    finally:
        scenes.needs_of, loading._integrator = needs_of, integrator


def rule_scenes(folder: Path) -> dict[str, Path]:
    """Scene files: the studio, and what differs from it in one respect."""
    studio = (FOLDER / "studio.xml").read_text()
    shutil.copytree(FOLDER / "textures", folder / "textures")
    suns = re.findall(r'<emitter type="directional".*?</emitter>', studio, re.DOTALL)
    (ambient,) = re.findall(r'<emitter type="constant".*?</emitter>', studio, re.DOTALL)
    (material,) = re.findall(r"<bsdf .*?</bsdf>", studio, re.DOTALL)
    one_sun = studio.replace(suns[1], "").replace(suns[2], "")
    light = np.random.default_rng(0).uniform(0.05, 0.4, (16, 32, 3)).astype(np.float32)
    OpenEXR.File({"compression": OpenEXR.ZIP_COMPRESSION}, {"RGB": light}).write(str(folder / "map.exr"))
    envmap = '<emitter type="envmap"><string name="filename" value="map.exr"/></emitter>'
    texts = {
        "studio": studio,
        "one sun": one_sun,
        "environment map": studio.replace(ambient, envmap),
        "matte": studio.replace(material, MATTE),
        "no ambient light": studio.replace(ambient, ""),
        "area light only": one_sun.replace(suns[0], "")
        .replace(ambient, "")
        .replace("</scene>", f"{SUN_DISK}</scene>"),
    }
    paths = {name: folder / f"{name.replace(' ', '-')}.xml" for name in texts}
    for name, text in texts.items():
        paths[name].write_text(text)
    return {**paths, "five views": FOLDER / "five_views.xml"}
