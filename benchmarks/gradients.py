"""Gradients of the picture loss against finite differences of converged renders, by the light's elevation.

python -m benchmarks.gradients            # everything, about a quarter of an hour on two cores
python -m benchmarks.gradients --quick    # fewer samples and directions
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter

from benchmarks.common import machine, save, table
from visual.heightmap import load_heights
from visual.lights import ParallelLights, ambient_lights
from visual.variants import load_mitsuba

Array = NDArray[np.float64]

SIZE_MM, SAMPLES_A_SIDE, RELIEF_MM = 10.0, 128, 1.5
ELEVATIONS = (10, 20, 35, 50, 70)
AMBIENT_RADIANCE = 0.3
AZIMUTH = 10
STEP_MM = 0.01

NOTES = """\
The loss is 1/2 mean (I - I_target)^2 of one picture (128 pixels, 1.5 mm relief), the target that of the
relief scaled to 85 % plus a little other relief. Truth: central differences of Mitsuba renders (576
samples a pixel, common random numbers, two seeds, whose spread gives its own error) along the relief
itself and four smooth random fields. Error: norm of the difference over norm of the truth, median of
three seeds. Wrong signs: of five, where the truth is over three standard errors from 0. Our explicit
gradient takes 4 x 4 samples a pixel, the renderers 64. Seconds are of one loss gradient, all of them on
the same cores."""
SMOOTHNESS = 4.0


@dataclass(frozen=True)
class Effort:
    """How much is spent on the truth and on each estimate."""

    truth_samples: int
    seeds: int
    directions: int
    repeats: int


FULL, QUICK = Effort(576, 2, 5, 3), Effort(256, 2, 3, 1)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true")
    effort = QUICK if parser.parse_args().quick else FULL
    mi = load_mitsuba(colour=False)
    mi.set_log_level(mi.LogLevel.Error)
    from visual.heightfield import register

    register()
    rows = []
    for relief_name, heights in reliefs().items():
        for light in (*ELEVATIONS, "ambient"):
            found = measure(heights, light, effort)
            rows += [{"relief": relief_name, "light": light, **row} for row in found]
            save("gradients", {"machine": machine(), "effort": vars(effort), "rows": rows})
            print(
                as_table([r for r in rows if r["relief"] == relief_name and r["light"] == light]), flush=True
            )
    print(as_table(rows))


def reliefs() -> dict[str, Array]:
    """A smooth relief and the gravel of the demo, both 1.5 mm high."""
    smooth = gaussian_filter(np.random.default_rng(3).standard_normal((SAMPLES_A_SIDE,) * 2), SMOOTHNESS)
    smooth = RELIEF_MM * (smooth - smooth.min()) / np.ptp(smooth)
    gravel = load_heights("mitsuba_scenes/textures/gravel.png", relief_mm=RELIEF_MM)
    return {"smooth": smooth, "gravel": gravel}


def measure(heights: Array, light: int | str, effort: Effort) -> list[dict[str, Any]]:
    """All methods for one light over one relief."""
    view = View(heights, light)
    other = gaussian_filter(np.random.default_rng(5).standard_normal(heights.shape), SMOOTHNESS)
    target = view.render(0.85 * heights + 0.05 * other / np.abs(other).max(), effort.truth_samples, 77)
    adjoint = (view.render(heights, effort.truth_samples, 78) - target) / target.size
    ways = directions(heights, effort.directions)
    truths = []
    for seed in range(effort.seeds):
        ends = [
            [view.render(heights + s * STEP_MM * d, effort.truth_samples, seed) for s in (1, -1)]
            for d in ways
        ]
        # The chain rule's outer factor is held, so that the truth is the derivative that an adjoint asks for.
        truths.append([float((adjoint * (up - down)).sum() / (2 * STEP_MM)) for up, down in ends])
    truth, error = np.mean(truths, axis=0), np.std(truths, axis=0, ddof=1) / np.sqrt(effort.seeds)
    rows: list[dict[str, Any]] = []
    for name, method in view.methods().items():
        try:
            estimates, seconds = [], []
            for repeat in range(effort.repeats):
                began = time.perf_counter()
                gradient = method(heights, adjoint, repeat)
                seconds.append(time.perf_counter() - began)
                estimates.append([float((gradient * d).sum()) for d in ways])
        except Exception as problem:  # Mitsuba raises no narrower class where an integrator cannot run
            rows.append({"method": name, "error": None, "note": str(problem).splitlines()[0][:80]})
            continue
        significant = np.abs(truth) > 3.0 * error
        wrong = np.sign(estimates[0]) != np.sign(truth)
        rows.append(
            {
                "method": name,
                "error": float(
                    np.median([np.linalg.norm(e - truth) / np.linalg.norm(truth) for e in estimates])
                ),
                "signs": int((wrong & significant).sum()),
                "truth_error": float(np.linalg.norm(error) / np.linalg.norm(truth)),
                "seconds": float(np.median(seconds)),
            }
        )
    return rows


def directions(heights: Array, count: int) -> list[Array]:
    """The relief itself, and smooth random fields of largest value 1."""
    found = [heights / np.abs(heights).max()]
    for number in range(count - 1):
        field = gaussian_filter(
            np.random.default_rng(100 + number).standard_normal(heights.shape), SMOOTHNESS
        )
        found.append(field / np.abs(field).max())
    return found


class View:
    """A plate under one light (or ambient light) and a camera straight above."""

    def __init__(self, heights: Array, light: int | str) -> None:
        import mitsuba as mi

        from visual.exact import LightScene

        edges: ParallelLights | None
        nothing = ParallelLights(np.zeros((0, 3)), np.zeros(0))
        if light == "ambient":
            emitter: dict[str, Any] = {
                "type": "constant",
                "radiance": {"type": "spectrum", "value": AMBIENT_RADIANCE},
            }
            self._suns, edges = nothing, None
            self._around: ParallelLights | None = ambient_lights(AMBIENT_RADIANCE, 16)
        else:
            up, turn = np.radians(float(light)), np.radians(AZIMUTH)
            toward = np.array([np.cos(up) * np.cos(turn), np.cos(up) * np.sin(turn), np.sin(up)])
            emitter = {
                "type": "directional",
                "direction": [float(-c) for c in toward],
                "irradiance": {"type": "spectrum", "value": float(np.pi)},
            }
            edges = ParallelLights(toward[None], np.array([np.pi]))
            self._suns, self._around = edges, None
        transform = mi.ScalarTransform4f()
        self._sun = light != "ambient"
        resolution = heights.shape[0]
        self._scene = mi.load_dict(
            {
                "type": "scene",
                "plate": {
                    "type": "heightfield",
                    "heights": mi.TensorXf(heights.astype(np.float32)),
                    "size_mm": SIZE_MM,
                    "bsdf": {
                        "type": "roughplastic",
                        "diffuse_reflectance": {"type": "spectrum", "value": 0.5},
                        "alpha": 0.3,
                        "int_ior": 1.5,
                    },
                },
                "light": emitter,
                "camera": {
                    "type": "orthographic",
                    "to_world": transform.look_at(origin=[0, 0, 20], target=[0, 0, 0], up=[0, 1, 0])
                    @ transform.scale([SIZE_MM / 2, SIZE_MM / 2, 1]),
                    "film": {
                        "type": "hdrfilm",
                        "width": resolution,
                        "height": resolution,
                        "pixel_format": "luminance",
                        "component_format": "float32",
                        "rfilter": {"type": "box"},
                    },
                    "sampler": {"type": "multijitter"},
                },
            }
        )
        self._params = mi.traverse(self._scene)
        self._shape = heights.shape
        self._camera = from_above(SIZE_MM, resolution)
        direct = self._integrator("direct")
        self._light = LightScene(
            self._scene,
            self._params,
            (0,),
            (self._camera,),
            direct,
            self._drawn,
        )

    def _drawn(self, generator: np.random.Generator) -> ParallelLights:
        return self._suns if self._sun else ambient_lights(AMBIENT_RADIANCE, AMBIENT_DIRECTIONS, generator)

    def _integrator(self, kind: str) -> Any:
        import mitsuba as mi

        if kind == "direct":
            return mi.load_dict(
                {"type": "direct", "emitter_samples": 1, "bsdf_samples": 0 if self._sun else 1}
            )
        if kind == "prb":
            return mi.load_dict({"type": "prb", "max_depth": 2})
        if kind == "direct_projective":
            return mi.load_dict({"type": "direct_projective"})
        return mi.load_dict({"type": "prb_projective", "max_depth": 2})

    def render(self, heights: Array, samples: int, seed: int) -> Array:
        """(rows, cols) radiance by Mitsuba."""
        import mitsuba as mi

        self._light.set_heights(heights)
        picture = mi.render(self._scene, integrator=self._light.integrator, spp=samples, seed=mi.UInt32(seed))
        return np.array(picture, dtype=np.float64).reshape(self._shape)

    def methods(self) -> dict[str, Callable[[Array, Array, int], Array]]:
        """Every way to a gradient (rows, cols) from heights, adjoint picture and seed."""
        from visual.exact import Exposure, Shot, edge_gradient, interior_gradient, plate_bsdf
        from visual.view import View as Explicit

        def explicit(edges: bool) -> Callable[[Array, Array, int], Array]:
            def gradient(heights: Array, adjoint: Array, seed: int) -> Array:
                view = Explicit(
                    self._scene,
                    plate_bsdf(self._scene),
                    self._light.set_heights,
                    self._shape,
                    SIZE_MM,
                    self._camera,
                    self._suns,
                    self._around,
                    seed=seed,
                )
                jacobian = view.evaluate(heights, edges=edges).jacobians[0]
                return np.asarray(jacobian.T @ adjoint.ravel()).reshape(self._shape)

            return gradient

        def renderer(kind: str, edges: bool) -> Callable[[Array, Array, int], Array]:
            def gradient(heights: Array, adjoint: Array, seed: int) -> Array:
                from dataclasses import replace

                light = replace(self._light, gradient_integrator=self._integrator(kind))
                exposure = Exposure(64, seed, edges)
                found = interior_gradient(light, heights, adjoint, exposure, Shot(0, 0))
                if edges:
                    found = found + edge_gradient(light, heights, adjoint, SIZE_MM, exposure, Shot(0, 0))
                return found

            return gradient

        return {
            "ours, explicit": explicit(True),
            "ours, explicit, no edges": explicit(False),
            "ours, Mitsuba + edges": renderer("direct" if self._sun else "prb", True),
            "Mitsuba direct": renderer("direct", False),
            "Mitsuba prb": renderer("prb", False),
            "Mitsuba direct_projective": renderer("direct_projective", False),
            "Mitsuba prb_projective": renderer("prb_projective", False),
        }


def as_table(rows: list[dict[str, Any]]) -> str:
    """Rows as Markdown."""
    head = ("relief", "light", "method", "error %", "wrong signs", "truth's own error %", "s")
    return table(
        head,
        [
            (
                r["relief"],
                r["light"],
                r["method"],
                r.get("note", "-") if r["error"] is None else 100.0 * r["error"],
                r.get("signs"),
                None if r["error"] is None else 100.0 * r["truth_error"],
                r.get("seconds"),
            )
            for r in rows
        ],
    )


if __name__ == "__main__":
    main()
