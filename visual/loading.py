"""Loading of light scenes: the plate under one light, or under several together, by Mitsuba.

Lights that can be put out share a Mitsuba scene, which is loaded once and takes new heights once for all of
them: its acceleration structure takes as long as a picture of 16 samples a pixel. Their pictures are the same
bit for bit as those of a scene of each light's own, because a light that is out takes no random numbers.
"""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from visual.backend import variants
from visual.backend.mitsuba import mi
from visual.exact.background import Background, black_background, scene_background
from visual.exact.bounded_paths import bounded_paths
from visual.exact.light_scene import Illumination, LightScene, LitScene
from visual.geometry.film_filter import film_filter
from visual.geometry.projection import Projection, from_above, projection_of
from visual.geometry.topology import PlateTopology
from visual.lights.kind import Light
from visual.lights.quadrature import Quadrature, kind_of, light_obstacle, prepare
from visual.lights.seen import SeenLight, lights_per_flux
from visual.needs import Needs
from visual.scene_file.check import instantiate, light_id
from visual.scene_file.parsed_scene import CheckedScene

Lights = tuple[Light, ...]
"""One light, or several that shine together."""
DIRECTIONS = 8
"""Parallel lights for each extended light, where the gradient of `Scene.render` follows shadows. New lights
are drawn for each gradient, so that few suffice."""


class SceneLoader:
    """Lights and light scenes of a checked scene, in the variant that is set; each loaded on first use."""

    def __init__(
        self,
        checked: CheckedScene,
        needs: Needs,
        heights: NDArray[np.float64],
        plate: PlateTopology,
    ) -> None:
        """Load nothing yet.

        Args:
            checked: the scene.
            needs: what its pictures take.
            heights: (rows, cols) mm.
            plate: triangles of the plate.
        """
        self._checked, self._needs, self._heights, self._plate = checked, needs, heights, plate
        self._variant = str(mi.variant())
        self.groups: tuple[Lights, ...] = *((light,) for light in needs.alone), *filter(None, (needs.around,))
        """Lights that are rendered together: each on its own, then all ambient ones."""
        self._lit: dict[frozenset[int], LitScene] = {}
        self._loaded: dict[tuple[frozenset[int], tuple[int, int]], LightScene] = {}
        self._quadratures: dict[tuple[int, ...], Quadrature] = {}

    def quadrature(self, lights: Lights, count: int) -> Quadrature:
        """Generator of parallel or near lights for some lights, prepared once.

        Args:
            lights: of the scene.
            count: lights for each light that is neither directional nor a point.

        Raises:
            InputError: a light has no gradients, or the picture of an environment map is bad.
        """
        key = (*(light.node for light in lights), count)
        if key not in self._quadratures:
            variants.use(self._variant)
            side_mm = max(self._plate.size_mm, self._plate.height_mm)
            self._quadratures[key] = prepare(lights, side_mm, count)
        return self._quadratures[key]

    def illuminations(self, resolution: tuple[int, int], directions: int) -> list[Illumination]:
        """Fixed lights of each of `groups`, with the background of their pictures.

        Args:
            resolution: (rows, cols) of the pictures.
            directions: lights for each light that is neither directional nor a point.

        Raises:
            InputError: the variant gives no gradients; as `quadrature`.
        """
        variants.use(self._variant)
        variants.require_gradients(self._needs.spectral)
        illuminations = []
        for lights in self.groups:
            fixed, loaded = self.quadrature(lights, directions).lights(), self.light_scene(lights, resolution)
            seen = loaded.seen and replace(loaded.seen, lights_per_flux=lights_per_flux(fixed))
            illuminations.append(Illumination(fixed, loaded.background, seen))
        return illuminations

    def light_scene(self, lights: Lights, resolution: tuple[int, int]) -> LightScene:
        """The plate under some of the lights of a scene.

        Args:
            lights: that shine, one of `groups`.
            resolution: (rows, cols) of the pictures.

        Raises:
            InputError: Mitsuba refuses the scene.
        """
        variants.use(self._variant)  # Another scene may have set its own.
        key = _numbers(lights), resolution
        if key not in self._loaded:
            self._loaded[key] = self._light_scene(lights, resolution)
        return self._loaded[key]

    def _light_scene(self, lights: Lights, resolution: tuple[int, int]) -> LightScene:
        needs, kinds = self._needs, [kind_of(light) for light in lights]
        lit, shining = self._lit_scene(lights), _numbers(lights)
        by_light = _integrator(needs, 0)
        background: Background = black_background
        if any(kind.surrounds for kind in kinds):
            background = _background_lit(lit, shining)
        sensors = lit.scene.sensors()
        return LightScene(
            lit,
            self._plate,
            shining,
            needs.cameras,
            tuple(
                _camera(sensors[number], self._plate.size_mm, resolution, overhead)
                for number, overhead in zip(needs.cameras, needs.top_view, strict=True)
            ),
            _integrator(needs, 1) if any(kind.met_by_chance for kind in kinds) else by_light,
            lambda generator: self.quadrature(lights, DIRECTIONS).lights(generator),
            any(kind.casts_shadows(light) for light, kind in zip(lights, kinds, strict=True)),
            background,
            self._seen(lights, lit),
            needs.direct,
            by_light if needs.direct else bounded_paths(by_light),
        )

    def _seen(self, lights: Lights, lit: LitScene) -> SeenLight | None:
        """What rays see of lights that shine together, of which they meet one; None if they meet none."""
        side_mm, shining = max(self._plate.size_mm, self._plate.height_mm), _numbers(lights)
        met = [light for light in lights if kind_of(light).seen and not light_obstacle(light, side_mm)]
        if not met:
            return None
        kind = kind_of(met[0])
        assert kind.seen is not None
        along, near = kind.seen(met[0], lit.scene), kind.near(met[0], side_mm)

        def shone(points: Any, toward: Any) -> tuple[Any, Any]:
            lit.shine(shining)
            # Parallel lights stand where the origin sees a far light.
            return along(points if near else mi.Vector3f(0.0), toward)

        return SeenLight(shone, kind.surrounds)

    def _lit_scene(self, lights: Lights) -> LitScene:
        """The Mitsuba scene of a group of lights, which others may share."""
        key = _numbers(lights)
        if key not in self._lit:
            sharing = [group for group in self.groups if all(kind_of(light).switch for light in group)]
            if key not in map(_numbers, sharing) or not self._share(sharing):
                self._lit[key] = LitScene(self._instantiate(lights))
        return self._lit[key]

    def _share(self, groups: Sequence[Lights]) -> bool:
        """Load one scene for some groups; False if Mitsuba does not know all their switches."""
        lights = [light for group in groups for light in group]
        scene = self._instantiate(lights)
        switches = {
            light.node: tuple(f"{light_id(light.node)}.{key}" for key in kind_of(light).switch)
            for light in lights
        }
        lit = LitScene(scene, switches if len(groups) > 1 else {})
        if lit.unknown:
            return False
        self._lit |= dict.fromkeys(map(_numbers, groups), lit)
        return True

    def _instantiate(self, lights: Sequence[Light]) -> Any:
        nodes = [light.node for light in lights]
        return instantiate(self._checked, self._heights, lights=nodes, halo=self._plate.halo)


def _numbers(lights: Lights) -> frozenset[int]:
    return frozenset(light.node for light in lights)


def _background_lit(lit: LitScene, shining: frozenset[int]) -> Background:
    """The background of a scene while some of its lights shine."""
    radiance = scene_background(lit.scene)

    def background(directions: NDArray[np.float64]) -> NDArray[np.float64]:
        lit.shine(shining)
        return radiance(directions)

    return background


def _camera(sensor: Any, size_mm: float, resolution: tuple[int, int], overhead: bool) -> Projection:
    """Projection of a sensor for pictures of so many pixels (rows, cols)."""
    rows, cols = resolution
    camera = from_above(size_mm, rows, cols) if overhead else projection_of(sensor, rows, cols)
    return replace(camera, filter=film_filter(sensor.film()))


def _integrator(needs: Needs, bsdf_samples: int) -> Any:
    """The integrator of a scene.

    Args:
        needs: of the scene; one bounce takes no path tracer.
        bsdf_samples: rays that leave the material at random to meet a light, for each sample.
    """
    if needs.direct:
        return mi.load_dict({"type": "direct", "emitter_samples": 1, "bsdf_samples": bsdf_samples})
    # Not "prb", which divides by the cosine at which light leaves for the next face. In the furrows of a
    # relief this cosine is small: gradients of gravel by two bounces are 150 to 700 % off, "path"'s 4 to 7.
    return mi.load_dict({"type": "path", "max_depth": -1 if needs.max_depth is None else needs.max_depth})
