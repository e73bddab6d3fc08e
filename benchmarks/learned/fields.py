"""What a texture of a data set costs, and how near its pictures are to converged ones.

python -m benchmarks.learned.fields

One thread. Textures: of a corpus of seed 7. Times: of the parts of a shard's work, a texture. Pictures: of
three textures, rms error in % of the mean picture, under a light of the studio and under ambient light,
against four renders of 256 samples a pixel together; beside them Mitsuba's own at fewer samples. Under
ambient light about 1 % is the error of the render that they are compared with.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import drjit as dr
import numpy as np
import torch

import tactile
from benchmarks.shared.common import machine, save, table
from relief.ground.arrays import Array
from relief.relief import Relief
from retouch.laboratory.training.fields import STUDIO, VARIANT, light_directions, touch_fields
from surrogate.corpus.photographs import bundled
from surrogate.corpus.recipes import heights, recipes
from visual.exact.light_scene import LightScene
from visual.exact.render import RenderSettings, pictures
from visual.reference.reference_renderer import ReferenceRenderer
from visual.scene import Scene
from visual.scene_file.check import check_scene

SEED, TEXTURES, SIDE, SIZE_MM = 7, 32, 128, 10.0
SEEN_RELIEF_MM, SEEN = 0.4, 3
STRATA = (8, 12, 20)
AZIMUTHS = (4, 8, 16)
SAMPLES = (16, 64)
AMBIENT = 0.22943058
"""Radiance of the studio's ambient light."""
CONVERGED, RENDERS = 256, 4


def main() -> None:
    torch.set_num_threads(1)
    dr.set_thread_count(1)
    corpus = list(recipes(SEED, TEXTURES, bundled()))
    began = time.perf_counter()
    reliefs = np.stack([heights(texture) for texture in corpus])
    spent = {"heights": _each(began)}
    for model in ("layer", "fem"):
        touch_fields(reliefs[:1], SIZE_MM, tactile.Skin(), model)
        began = time.perf_counter()
        touch_fields(reliefs, SIZE_MM, tactile.Skin(), model)
        spent[model] = _each(began)
    seen = [relief.astype(np.float64) for relief in reliefs if relief.max() > SEEN_RELIEF_MM][:SEEN]
    rows = _pictures(seen)
    print(table(("part", "ms a texture"), [(name, f"{ms:.0f}") for name, ms in spent.items()]))
    print(
        table(
            ("pictures", "ms", "rms error, %"),
            [(row["way"], f"{row['ms']:.0f}", f"{row['rms_percent']:.2f}") for row in rows],
        )
    )
    print(save("fields", {"machine": machine(), "ms_a_texture": spent, "pictures": rows}))


def _each(began: float) -> float:
    return 1e3 * (time.perf_counter() - began) / TEXTURES


def _pictures(seen: list[Array]) -> list[dict[str, Any]]:
    scene = Scene(check_scene(STUDIO, {"resolution": str(SIDE)}), Relief(np.zeros((SIDE, SIDE))), VARIANT)
    sun, *_, sky = scene.light_scenes()
    toward = light_directions("studio", 3, 0)[:1]

    def rendered(light: LightScene, relief: Array, samples: int, seed: int) -> Array:
        suns, ambient, strength = ((sun,), None, 1.0) if light is sun else ((), sky, AMBIENT)
        settings = RenderSettings(samples, seed, False)
        found = pictures(suns, ambient, torch.as_tensor(relief), scene.plate, settings)[0]
        return np.asarray(found.numpy() / strength)

    def converged(light: LightScene, relief: Array) -> Array:
        return np.mean([rendered(light, relief, CONVERGED, seed) for seed in range(RENDERS)], axis=0)

    suns, skies = ([converged(light, relief) for relief in seen] for light in (sun, sky))
    rows = []
    for strata in STRATA:
        renderer = ReferenceRenderer(scene, strata, seed=1)

        def parallel(relief: Array, renderer: ReferenceRenderer = renderer) -> Array:
            return renderer.parallel_pictures(relief, toward)[0]

        rows.append(_row(f"light, {strata} x {strata} shadow rays", parallel, seen, suns))
    for samples in SAMPLES:

        def by_mitsuba(relief: Array, samples: int = samples) -> Array:
            return rendered(sun, relief, samples, 99)

        rows.append(_row(f"light, Mitsuba, {samples} samples", by_mitsuba, seen, suns))
    for azimuths in AZIMUTHS:

        def ambient(relief: Array, azimuths: int = azimuths) -> Array:
            return renderer.ambient_picture(relief, 0, azimuths)

        rows.append(_row(f"ambient, {azimuths} azimuths", ambient, seen, skies))
    for samples in (*SAMPLES, CONVERGED):

        def sky_by_mitsuba(relief: Array, samples: int = samples) -> Array:
            return rendered(sky, relief, samples, 99)

        rows.append(_row(f"ambient, Mitsuba, {samples} samples", sky_by_mitsuba, seen, skies))
    return rows


def _row(
    way: str, picture: Callable[[Array], Array], seen: list[Array], truths: list[Array]
) -> dict[str, Any]:
    errors, spent = [], []
    picture(seen[-1])
    for relief, truth in zip(seen, truths, strict=True):
        began = time.perf_counter()
        found = picture(relief)
        spent.append(1e3 * (time.perf_counter() - began))
        errors.append(100.0 * np.sqrt(np.mean((found - truth) ** 2)) / truth.mean())
    return {"way": way, "ms": float(np.mean(spent)), "rms_percent": float(np.mean(errors))}


if __name__ == "__main__":
    main()
