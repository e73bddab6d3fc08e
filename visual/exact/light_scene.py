"""Light scenes: the plate under one light each (or under all that shine together), as Mitsuba renders it."""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from relief.ground.arrays import Array
from visual.backend import buffers, variants
from visual.backend.mitsuba import dr, mi
from visual.backend.plate_shape import plate_shape
from visual.exact.background import Background, black_background
from visual.geometry.projection import Projection
from visual.geometry.topology import PlateTopology
from visual.lights.near import LightSet
from visual.lights.seen import SeenLight


class LitScene:
    """A Mitsuba scene with some lights, of which not all need shine.

    Attributes:
        scene, params: `mi.Scene` and its `mi.traverse`.
        unknown: names of switches that are no parameters of the scene.
    """

    def __init__(self, scene: Any, switches: Mapping[int, Collection[str]] | None = None) -> None:
        """All lights shine.

        Args:
            scene: `mi.Scene`.
            switches: for each light, by its number, parameters that put it out when they are 0. Lights
                without any shine always.
        """
        self.scene, self.params = scene, mi.traverse(scene)
        self.variant = str(mi.variant())
        switches = switches or {}
        self.unknown = sorted({key for keys in switches.values() for key in keys} - set(self.params.keys()))
        # Copies: Mitsuba gives references, which a later write would change.
        self._values = {
            light: {key: type(self.params[key])(self.params[key]) for key in keys}
            for light, keys in ({} if self.unknown else switches).items()
        }
        self._shining = frozenset(self._values)

    def shine(self, lights: frozenset[int]) -> None:
        """Put out every light with a switch but these, whose numbers are given."""
        if not self._values or lights == self._shining:
            return
        for light, values in self._values.items():
            for key, value in values.items():
                self.params[key] = value if light in lights else 0.0 * value
        self.params.update()
        self._shining = lights


@dataclass(frozen=True)
class Illumination:
    """Lights that shine together.

    Attributes:
        lights: parallel or near ones.
        background: of pictures under these lights.
        seen: the one light that these stand for, as rays see it; None if rays cannot meet the light.
    """

    lights: LightSet
    background: Background = black_background
    seen: SeenLight | None = None


@dataclass(frozen=True)
class LightScene:
    """One light (or all that shine together) over the plate in a Mitsuba scene, which others may share.

    Attributes:
        lit: the Mitsuba scene.
        plate: triangles of its plate.
        shining: numbers of the lights in it that shine.
        sensors, cameras: numbers of the scene's sensors that take pictures, and their projections.
        integrator: renders the scene.
        lights: draws the parallel or near lights that represent it where gradients follow moving edges.
        shadows: whether the light casts any, on some relief.
        background: of the pictures.
        seen: the light as rays see it; None if no ray meets it.
        direct: whether light goes from lamp to plate to camera only.
        gradient_integrator: gives radiance by slope, if not `integrator`. Its directions must not turn with
            the surface, as those drawn from a material do: the shadows would move along.
    """

    lit: LitScene
    plate: PlateTopology
    shining: frozenset[int]
    sensors: tuple[int, ...]
    cameras: tuple[Projection, ...]
    integrator: Any
    lights: Callable[[np.random.Generator], LightSet]
    shadows: bool = True
    background: Background = black_background
    seen: SeenLight | None = None
    direct: bool = True
    gradient_integrator: Any = None

    @property
    def scene(self) -> Any:
        """The `mi.Scene`; what it holds besides the shining light may change."""
        return self.lit.scene

    @property
    def params(self) -> Any:
        """The `mi.traverse` of `scene`."""
        return self.lit.params

    @property
    def bsdf(self) -> Any:
        """The plate's material."""
        return plate_shape(self.scene).bsdf()

    def set_heights(self, heights: Array) -> None:
        """Put (rows, cols) mm into the scene; from here on the scene's own variant is set.

        Heights that the scene already holds are left: a new acceleration structure takes longer than a few
        samples.
        """
        variants.use(self.lit.variant)
        wanted = np.array(heights, dtype=np.float32).ravel()
        held = self.params[buffers.heights_key(self.params)]
        if dr.grad_enabled(held) or not np.array_equal(np.asarray(held), wanted):
            buffers.set_heights(self.params, wanted)

    def prepare(self, camera: int) -> None:
        """Let this light alone shine, and give the film of one of `sensors` the size of its camera."""
        variants.use(self.lit.variant)
        self.lit.shine(self.shining)
        film = self.scene.sensors()[self.sensors[camera]].film()
        size = [self.cameras[camera].cols, self.cameras[camera].rows]
        if list(film.crop_size()) != size:
            params = mi.traverse(film)
            params["size"], params["crop_size"] = size, size
            params.update()
