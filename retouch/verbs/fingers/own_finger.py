"""A finger of one's own: skin of any shape, from a print file, pressed on height maps.

A check without gradients: quadratic tetrahedra (`tactile.unstructured`), beside the round finger of the same
thickness, modulus and force whose radii are fitted to the lower face. Both press at the same contact
locations on the same samples.
"""

from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from torch.nn.functional import pad

from relief.ground.errors import InputError, naming, option_error
from relief.ground.formatting import about, number
from relief.ground.progress import say, stage
from relief.relief import Relief
from relief.solids.body import Body
from relief.solids.files.mesh import Mesh
from relief.solids.meshes.shells import components
from tactile.contact import TIGHT, solve_contact
from tactile.measures import TouchMeasures, measure_touch
from tactile.model import NARROWEST_MM
from tactile.pressing import OUT_OF_REACH_MM
from tactile.skin import LARGEST_RADIUS_MM, Skin
from tactile.touch import Touch
from tactile.unstructured.meshing import MeshingError, Sizing, tetrahedralise
from tactile.unstructured.surface import ClosedSurface, height_over, locate
from tactile.unstructured.tetrahedra import TetrahedralOperator, press_tetrahedra, tetrahedral_operator

PER_MM = 4
"""Samples, and facets of the tetrahedra, per mm: those of the measured error (`ERROR`)."""
WIDEST_MM, LEAST_SQUARE_MM = 12.0, 7.0
"""Largest and least side, mm, of the square that is pressed. Contacts at 1 N are 4 to 9 mm wide."""
MOST_FACES = 200_000
"""Most triangles of a fingertip, whose edges of 0.1 mm are as many."""
SIDES_MM = 6.0, 45.0
"""Least and greatest longest side of a fingertip, mm: a child's, and an adult thumb's to its joint."""
FLAT_MM, FLAT_SHARE = 1e-3, 0.5
"""Distance, mm, from the highest plane up to which the top is flat, above rounding; and the least
share that the flat top has of the fingertip as seen from above."""
LOW_MM, FIT_MM = 0.1, 3.0
"""Height, mm, up to which the lower face is its lowest place; and the distance from there, mm, up to which
radii are fitted, half the width of a usual contact."""
FIRST_S, PER_MM3_S, MOST_MM3 = 25.0, 0.095, 6000.0
"""CPU seconds before the first press, and more of them for each mm³, as measured from 335 to 686 mm³; and the
largest volume, mm³, which by extrapolation takes ten minutes and some 10 GB."""
ERROR = (
    "A check without gradients: on spheres of 8 to 15 mm, 4 mm thick, with a force over modulus of 20 mm² "
    "(1 N on 0.05 MPa, or the default skin) on gravel, brick and knit, V is 4 % below to 7 % above the round "
    "finger's (layered skin: 8 to 20 % above), contact area 1 to 9 % below, JND within 0.3; halved facets "
    "change V by up to 4 %. Stiffer skins were not measured."
)
"""What `benchmarks.touch.own_finger` measured, for a person."""


@dataclass(frozen=True, eq=False)
class OwnFinger:
    """A fingertip of a print file.

    Attributes:
        file: the print file.
        surface: its skin, mm, whose lowest place is the origin; the flat top is bonded to the bone.
        skin: round finger with the radii of the lower face and the thickness at the lowest place.
        square_mm: side of the square around the middle that the lower face covers, at most `WIDEST_MM`.
    """

    file: Path
    surface: ClosedSurface
    skin: Skin
    square_mm: float

    @property
    def line(self) -> str:
        """A sentence for a person."""
        along, across = self.skin.radii_mm or (0.0, 0.0)
        return (
            f"{self.file}: {number(self.skin.thickness_mm)} mm from the lowest place to the bone, "
            f"{number(self.square_mm)} mm of the lower face pressed; radii of {number(along)} mm along y and "
            f"{number(across)} mm along x are fitted within {FIT_MM:g} mm for the round finger. {ERROR}"
        )

    def feel(self, relief: Relief) -> tuple[TouchMeasures, TouchMeasures]:
        """What this finger and the round one feel of a relief; see `measure_touch`. Raises InputError."""
        most = round(PER_MM * (self.skin.patch_mm or 0.0))
        own = measure_touch(relief, self.skin, "fem", most=most, by=self.press)
        return own, measure_touch(relief, self.skin, "layer", most=most)

    def press(self, fields: Tensor, size_mm: float) -> Touch:
        """The touch of patches (..., n, n), nothing beyond the square. Raises InputError."""
        n = fields.shape[-1]
        beside = int(np.ceil(0.5 * (1.0 - self.square_mm / size_mm) * n - 1e-6))
        inner = slice(beside, n - beside)
        with naming(self.file):
            operator, receptors = _operator(self, n - 2 * beside, (1.0 - 2.0 * beside / n) * size_mm)
        heights = torch.maximum(fields, fields.amax((-2, -1), keepdim=True) - OUT_OF_REACH_MM)
        felt = press_tetrahedra(heights[..., inner, inner], self.skin, operator)
        if float(felt.pressure[..., 1:-1, 1:-1].sum()) < (1.0 - 1e-12) * float(felt.pressure.sum()):
            say(f"{self.file}: contact reaches the rim of the {operator.size_mm:.3g} mm that are pressed")
        beyond = {"strain": 0.0, "gap": 1.0, "pressure": 0.0}
        maps = {name: pad(getattr(felt, name), (beside,) * 4, value=far) for name, far in beyond.items()}
        counted = pad(receptors, (beside,) * 4) * torch.isfinite(fields)
        share = felt.contact_fraction * (operator.samples / n) ** 2
        return replace(felt, **maps, contact_fraction=share, size_mm=size_mm, receptors=counted)


def own_finger(mesh: Mesh, skin: Skin) -> OwnFinger:
    """The fingertip of a mesh, with the modulus, force and receptors of a skin. Raises InputError."""
    with naming(mesh.path):
        if len(mesh.body.faces) > MOST_FACES:
            fault = f"has {len(mesh.body.faces)} triangles, more than {MOST_FACES}: decimate the mesh"
            raise InputError(fault)
        if skin.curved_x_mm or skin.curved_y_mm:
            raise InputError("curved_x_mm, curved_y_mm: a finger of one's own presses on flat objects")
        return _placed(mesh.body.vertices.tobytes(), mesh.body.faces.tobytes(), mesh.path, skin)


@lru_cache(maxsize=1)
def _placed(vertices: bytes, faces: bytes, file: Path, skin: Skin) -> OwnFinger:
    """`own_finger`; the last fingertip is kept for the next texture, and its operator with it."""
    surface = _surface(
        Body(np.frombuffer(vertices).reshape(-1, 3), np.frombuffer(faces, "i8").reshape(-1, 3))
    )
    line = (np.arange(PER_MM * WIDEST_MM) + 0.5) / PER_MM - 0.5 * WIDEST_MM
    points = np.stack(np.meshgrid(line, line), axis=-1).reshape(-1, 2)
    face = surface.contact_face()
    corners = surface.vertices[face][..., :2]
    where = locate(corners, points)[0]
    above = np.delete(corners, where[where >= 0], axis=0)
    if len(above) and (locate(above, points)[1].min(axis=1) > 1e-3).any():  # More than rounding on an edge.
        raise InputError("its lower face lies over itself; close bores, and cut off what hangs over")
    uncovered = np.abs(points[where < 0]).max(axis=1)
    square = 2.0 * float(uncovered.min(initial=0.5 * (WIDEST_MM + 1.0 / PER_MM))) - 1.0 / PER_MM
    if square < LEAST_SQUARE_MM:
        raise InputError(
            f"its lower face covers a square of {square:g} mm around its lowest place; at least "
            f"{LEAST_SQUARE_MM:g} are needed"
        )
    x, y = points[np.hypot(*points.T) < FIT_MM].T
    z = height_over(surface.vertices, face, x, y)
    # Exact on a sphere, whose z = (x² + y² + z²) / (2 R).
    terms = np.stack((np.ones_like(x), x, y, y**2 + 0.5 * z**2, x**2 + 0.5 * z**2), axis=1)
    curvatures = 2.0 * np.linalg.lstsq(terms, z, rcond=None)[0][3:]
    along, across = np.round(1.0 / np.maximum(curvatures, 1.0 / LARGEST_RADIUS_MM), 2).tolist()
    fitted = {"shape": "round", "radius_mm": along, "across_mm": across, "thickness_mm": surface.top_mm}
    return OwnFinger(file, surface, replace(skin, **fitted), square)


def _surface(body: Body) -> ClosedSurface:
    """The surface of a fingertip with its lowest place at the origin. Raises InputError."""
    vertices, faces, upward = body.vertices.copy(), body.faces, body.normals[:, 2]
    sides = np.ptp(vertices, axis=0)
    if not SIDES_MM[0] <= sides.max() <= SIDES_MM[1]:
        size = " x ".join(map(number, sides))
        fault = f"measures {size} mm, no fingertip of {SIDES_MM[0]:g} to {SIDES_MM[1]:g} mm; cut it"
        raise InputError(*(f"{fault}, or state its unit ({option})" for option in ("units", "--units")))
    z = vertices[:, 2]
    at_top = z > z.max() - FLAT_MM
    top, bottom = (abs(upward[at[faces].all(axis=1)].sum()) for at in (at_top, z < z.min() + FLAT_MM))
    least = FLAT_SHARE * 0.5 * np.abs(upward).sum()
    volume = ClosedSurface(vertices, faces).volume_mm3
    faults = {
        f"has {volume:.0f} mm³, more than {MOST_MM3:g}: cut off what lies far from the contact": volume
        > MOST_MM3,
        "has several parts or a closed hollow; a fingertip is one part": components(body).any(),
        "is upside down: its flat face is below; turn it over, the bone is above": bottom >= least > top,
        "has no flat top to bond to the bone: cut it by a plane, and turn the cut to +z": top < least,
    }
    for fault, true in faults.items():
        if true:
            raise InputError(fault)
    z[at_top] = z.max()
    low = vertices[z < z.min() + LOW_MM, :2]
    return ClosedSurface(vertices - [*(0.5 * (low.min(axis=0) + low.max(axis=0))), z.min()], faces)


@lru_cache(maxsize=1)
def _operator(finger: OwnFinger, samples: int, size_mm: float) -> tuple[TetrahedralOperator, Tensor]:
    """Operator on a square, and the receptors under a flat plate (n, n). Raises InputError."""
    pitch = size_mm / samples
    time = " ".join(about(FIRST_S + PER_MM3_S * finger.surface.volume_mm3))
    say(f"{finger.file}: the fingertip is meshed and condensed in about {time}, and then kept")
    try:
        with stage("meshing the fingertip"):
            mesh = tetrahedralise(finger.surface, Sizing(min(pitch, 0.8), 0.8, 0.5 * size_mm))
    except MeshingError as error:
        raise InputError(str(error)) from error
    with stage("condensing the fingertip"):
        operator = tetrahedral_operator(finger.skin, mesh, samples, size_mm)
    load = finger.skin.mean_pressure_mpa(size_mm) / finger.skin.young_modulus_mpa
    touched = solve_contact(operator, -operator.rise_mm, load, stop=TIGHT).pressure > 0.0
    wide = pitch * max(int(touched.any(axis).sum()) for axis in (0, 1))
    if not NARROWEST_MM <= wide <= size_mm - 2.0 * pitch:
        fault = f"{finger.skin.force_n:g} N touch {wide:.3g} mm of a flat plate, which must be at least "
        raise option_error("force_n", f"{fault}{NARROWEST_MM:g} and less than the {size_mm:.3g} mm pressed")
    return operator, touched.double()
