"""Feel of a mesh: roughness and contact area at places evenly over its surface."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch

import tactile
from optimize.descent.targets import QUANTITIES, means
from optimize.descent.touch_measures import BATCH_SAMPLES, each
from relief.arrays import Array
from relief.body import Body
from relief.limits import PATCH_SIDE_MM
from relief.meshes.crops import Crop, Cropper
from relief.meshes.mesh import Mesh
from relief.meshes.places import frames, spread, surface_points
from relief.progress import stage
from tactile.model import ModelName

MOST_PLACES = 300
"""Most places that are pressed."""
MOST_TRIED = 450
"""Most places whose surroundings are looked at, many of which may lie on edges."""


@dataclass(frozen=True)
class MeshFeel:
    """What fingers get from a mesh.

    Attributes:
        body: That was touched, mm.
        crops: Of the k places, all on edges or none.
        values: (k,) of quantities by name, in their units.
        contact_fractions: (k,) share of the patch in contact.
        edges: Number of places left out because they lie on edges.
        area_mm2: Of the surface without the side on the printer's bed.
        curvature_out: Whether the object's own curvature was taken out.
    """

    body: Body
    crops: Sequence[Crop]
    values: dict[str, Array]
    contact_fractions: Array
    edges: int
    area_mm2: float
    curvature_out: bool = False

    @property
    def means(self) -> dict[str, float]:
        """Means of the values over the places."""
        return means(self.values)

    @property
    def contact_fraction(self) -> float:
        """Mean share of the patch in contact over the places."""
        return float(self.contact_fractions.mean())

    @property
    def ends(self) -> dict[str, float]:
        """The `count` of places, and the least, largest and standard deviation of each quantity."""
        ends: dict[str, float] = {"count": len(self.crops)}
        for name, values in self.values.items():
            ends |= {f"{name}_min": float(values.min()), f"{name}_max": float(values.max())}
            ends[f"{name}_std"] = float(values.std())
        return ends

    def details(self) -> dict[str, Any]:
        """What is told of a mesh beside the numbers of a texture: edges, curvature, sides, every touch."""
        return {
            "on_edge": self.edges,
            "all_on_edge": self.crops[0].on_edge,
            "curvature": "taken out" if self.curvature_out else "part of the roughness",
            "surface_mm2": self.area_mm2,
            "sides_mm": np.ptp(self.body.vertices, axis=0).tolist(),
            "touches": [
                {
                    "at_mm": crop.frame.at.tolist(),
                    "axis": crop.frame.axes[2].tolist(),
                    **{name: float(values[number]) for name, values in self.values.items()},
                }
                for number, crop in enumerate(self.crops)
            ],
        }


def feel_of(mesh: Mesh, skin: tactile.Skin, model: ModelName = "layer", most: int = MOST_PLACES) -> MeshFeel:
    """Press the skin on places 2.5 mm apart, or as many as there may be, all over a mesh.

    The finger presses along the outward axis of the surroundings of a place, on a patch of 10 mm a side. The
    side that lies on the printer's bed, flat and lowest, is left out. Where the patch reaches over an edge
    the finger meets the shape and not a texture: such places are left out too, unless there are no others, as
    on the rim of a coin.

    Args:
        mesh: A solid.
        skin: The finger.
        model: Of touch.
        most: Most places that are pressed.

    Raises:
        ContactError: A contact does not converge.
    """
    points = surface_points(mesh.body)
    candidates = frames(points, spread(points.at, MOST_TRIED))
    cropper = Cropper(mesh.body)
    crops: list[Crop] = []
    with stage("looking at places", len(candidates), at_most=True) as advance:
        for frame in candidates:
            crops.append(cropper.crop(frame))
            advance()
            if sum(not crop.on_edge for crop in crops) >= most:
                break
    chosen = [crop for crop in crops if not crop.on_edge] or crops[:most]
    values, fractions = pressed(np.stack([crop.heights for crop in chosen]), skin, model)
    return MeshFeel(mesh.body, chosen, values, fractions, len(crops) - len(chosen), points.area_mm2)


def pressed(heights: Array, skin: tactile.Skin, model: ModelName) -> tuple[dict[str, Array], Array]:
    """Values (k,) of quantities and share (k,) in contact of patches (k, n, n) mm of 10 mm a side."""
    size = max(1, BATCH_SAMPLES // heights[0].size)
    values: dict[str, list[Array]] = {name: [] for name in QUANTITIES}
    fractions = []
    with stage("pressing on places", len(heights)) as advance:
        for start in range(0, len(heights), size):
            part = torch.as_tensor(heights[start : start + size])
            touch = tactile.press(part, PATCH_SIDE_MM, skin, model)
            for name, quantity in QUANTITIES.items():
                values[name].append(each(quantity.value(touch, PATCH_SIDE_MM)))
            fractions.append(each(touch.contact_fraction))
            advance(len(part))
    return {name: np.concatenate(parts) for name, parts in values.items()}, np.concatenate(fractions)
