"""Appearance of plates in the viewer: matte, under one lamp and an even sky, as in the pictures of a page."""

from dataclasses import asdict, dataclass
from typing import Any, Self

import numpy as np

from relief.ground.arrays import FloatArray
from visual.lights.kind import RGB
from visual.lights.parallel import LUMINANCE
from visual.matte import Lamp, MatteScene


@dataclass(frozen=True)
class Appearance:
    """A matte plate and its light; radiance is in units of that of the scene's white.

    Attributes:
        albedo: share of the light that the surface reflects, red, green and blue.
        lamps: where the lamp can be put by name; it begins at the first.
        exposure: factor of the radiance before the sRGB curve.
        note: sentences on how this differs from the pictures of the page.
    """

    albedo: RGB
    lamps: tuple[Lamp, ...]
    exposure: float
    note: str

    @classmethod
    def of(cls, scene: MatteScene, exposure: float, colours: FloatArray | None = None) -> Self:
        """The appearance of a scene.

        Args:
            scene: approximated by a matte plate.
            exposure: of the page's pictures, a factor of their radiance over that of white.
            colours: pictures (..., 3) in linear RGB, whose mean colour the plate takes; grey without.
        """
        tint = np.ones(3)
        if colours is not None and float(mean := (colours.reshape(-1, 3).mean(axis=0) @ LUMINANCE)) > 0.0:
            tint = colours.reshape(-1, 3).mean(axis=0) / mean
        red, green, blue = (scene.albedo * tint).tolist()
        return cls((red, green, blue), scene.lamps, exposure, _note(scene))

    def options(self) -> dict[str, Any]:
        """The options of `plate_viewer.js` that are not of the plate, and `lamps` for the buttons."""
        first = self.lamps[0]
        return {
            **{"albedo": list(self.albedo), "ambient": first.ambient, "exposure": self.exposure},
            **{"lamp": asdict(first), "lamps": [asdict(lamp) for lamp in self.lamps]},
        }


def _note(scene: MatteScene) -> str:
    sentences = ["The surface is shown matte"]
    if scene.glossy:
        sentences[0] += ", without the gloss of the pictures' material"
    if scene.textured:
        sentences[0] += ", in the mean of its texture"
    if scene.simplified:
        sentences.append(
            "Of the scene's light, the lamp is the mean direction, the rest comes evenly from above"
        )
    return ". ".join(sentences) + "."


STUDIO = Appearance(
    albedo=(0.436, 0.436, 0.436),
    lamps=tuple(Lamp(f"light-{azimuth}", float(azimuth), 35.0, 1.0, 0.23) for azimuth in (10, 130, 250)),
    exposure=1.0,
    note="The surface is shown matte and grey, under the lamps of the bundled studio.",
)
"""The bundled scene `studio` by `visual.matte.matte_scene`, as bright as the pictures of a run."""
