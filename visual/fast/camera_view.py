"""Fast pictures by cameras on any side: swept light on faces that view lines carry to the film.

    picture = shares of pixels * sum over lights of  lit share * radiance of the face  +  rest * background

    d picture / d heights = shares of pixels * lit share * d radiance / d slope * d slope / d heights
                          + shares of pixels * radiance * d lit share / d heights
                          + motion of the pieces on the film

Lights are swept once for all cameras (`visual.fast.swept_light`), each camera sees what its lines see
(`visual.fast.view_lines`), and each has its own tables for the radiance of faces: highlights differ from
side to side. All three parts are the derivative of the very pictures.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import scipy.sparse as sp
import torch
from torch import Tensor

from relief.ground.arrays import Array
from relief.surface import Surface
from visual.exact.view import Pictures
from visual.fast.bsdf_table import BsdfTable
from visual.fast.film_pieces import FilmPieces, film_pieces
from visual.fast.jacobian import refinement, slope_matrices
from visual.fast.refinement import face_slopes, refined
from visual.fast.swept_light import Receivers, SweptLight, swept_light
from visual.fast.view_lines import ViewLines

LEAST_CHANGE = 0.03
"""Least derivative by a height that a pixel keeps where many lights move their shadows at once, in units of
the pixel's largest. Two of three are smaller; gradients of gravel change by less than 1 % without them."""
_Linear = TypeVar("_Linear", Array, sp.csr_matrix)
"""Picture or Jacobian: values that add up over lights and are weighted by a film."""


@dataclass(frozen=True, eq=False)
class LightGroup:
    """Parallel lights that shine together.

    Attributes:
        toward: (lights, 3) unit vectors.
        receivers: which the lights reach in shares.
        shadows: whether the lights cast any.
    """

    toward: Array
    receivers: Receivers
    shadows: bool = True

    def swept(self, surface: Surface, rise_mm: float, fine: Tensor, changes: bool) -> SweptLight:
        """Lit shares of a relief's receivers; arguments as of `swept_light`."""
        if self.shadows:
            return swept_light(surface, self.toward, rise_mm, fine, self.receivers, changes)
        return SweptLight(np.ones((len(self.toward), len(self.receivers.face))), None)


@dataclass(frozen=True, eq=False)
class FastCamera:
    """A camera of fast pictures.

    Attributes:
        lines: of the camera, or of one with finer pixels if `film` weighs these.
        tables: radiance of faces under each light, group by group, as seen from each of some places on the
            plate; of these a perspective camera has several.
        nearness: (places, faces) weights of the places for each face, with the sum 1.
        backgrounds: (pixels of `lines`,) radiance beside the plate under each group.
        film: (pixels, pixels of `lines`) weights of the film; None for a box.
        shape: rows and columns of the pictures.
    """

    lines: ViewLines
    tables: tuple[tuple[BsdfTable, ...], ...]
    nearness: Array
    backgrounds: tuple[Array, ...]
    film: sp.csr_matrix | None
    shape: tuple[int, int]


@dataclass(frozen=True)
class _Lit:
    """Radiance of faces toward one camera under one group of lights, and its derivatives.

    Attributes:
        group: that shines.
        light: what it reaches.
        by_light: (lights, receivers) radiance of the receivers where they are lit.
        radiance, by_slope_x, by_slope_y: (receivers,) under all lights, shadows included.
    """

    group: LightGroup
    light: SweptLight
    by_light: Array
    radiance: Array
    by_slope_x: Array
    by_slope_y: Array


class CameraView:
    """Pictures by several cameras, one condition for each camera and each light that shines alone.

    Attributes:
        overhead: that the pictures end where the plate ends, as from straight above.
    """

    def __init__(
        self,
        surface: Surface,
        rise_mm: float,
        cameras: Sequence[FastCamera],
        groups: Sequence[LightGroup],
        ambient: bool,
    ) -> None:
        """Keep what does not depend on the heights.

        Args:
            surface: of the plate.
            rise_mm: expected from the lowest to the highest point of its reliefs.
            cameras: take the pictures.
            groups: of lights, one condition of each camera each.
            ambient: whether the last group adds to every condition instead; the only one always does.
        """
        self._surface, self._rise_mm = surface, rise_mm
        self._cameras, self._groups, self._ambient = tuple(cameras), tuple(groups), ambient
        # Ambient light beside other lights adds 3 of 4 entries, and 0.1 to 1 % of a gradient.
        self._followed = range(max(1, len(groups) - ambient))
        self.overhead = all(camera.lines.camera.overhead for camera in cameras)

    def evaluate(self, heights: Array, jacobian: bool = True, edges: bool = True) -> Pictures:
        """Pictures of a relief, and their Jacobians.

        Args:
            heights: (r, c) mm.
            jacobian: whether derivatives are wanted.
            edges: whether the derivatives include the motion of shadow boundaries and of faces.
        """
        field = torch.as_tensor(heights, dtype=torch.float64)
        fine, moving = refined(field, self._surface.repeats), jacobian and edges
        slopes = face_slopes(field, self._surface.width_mm, self._surface.repeats)
        swept = [
            group.swept(self._surface, self._rise_mm, fine, moving and number in self._followed)
            for number, group in enumerate(self._groups)
        ]
        pictures: list[Array] = []
        jacobians: list[sp.csr_matrix] = []
        for camera in self._cameras:
            pieces = film_pieces(camera.lines, fine.numpy(), 8 * heights.size, moving)
            every = [
                _lit(group, light, tables, camera.nearness, slopes)
                for group, light, tables in zip(self._groups, swept, camera.tables, strict=True)
            ]
            shown = [
                _picture(pieces, lit, background)
                for lit, background in zip(every, camera.backgrounds, strict=True)
            ]
            pictures += _filmed(camera, self._conditions(shown))
            if jacobian:
                changes = [
                    self._jacobian(pieces, lit, background, moving)
                    for lit, background in zip(every, camera.backgrounds, strict=True)
                ]
                jacobians += _filmed(camera, self._conditions(changes))
        shape = self._cameras[0].shape
        return Pictures(np.stack([picture.reshape(shape) for picture in pictures]), tuple(jacobians))

    def _conditions(self, of_groups: list[_Linear]) -> list[_Linear]:
        """Values of each condition from the values of each group of lights."""
        if not self._ambient or len(of_groups) == 1:
            return of_groups
        return [alone + of_groups[-1] for alone in of_groups[:-1]]

    def _jacobian(self, pieces: FilmPieces, lit: _Lit, background: Array, moving: bool) -> sp.csr_matrix:
        """(pixels, heights) under one group of lights."""
        receivers, surface = lit.group.receivers, self._surface
        shares = pieces.weights if receivers.means is None else pieces.weights @ receivers.gather
        result = sum(
            _scaled(shares, change) @ receivers.on_faces @ slope
            for change, slope in zip((lit.by_slope_x, lit.by_slope_y), slope_matrices(surface), strict=True)
        )
        if moving:
            moved = pieces.motion(lit.radiance[receivers.of_triangle], background)
            result = result + moved @ refinement(surface)
            if lit.light.changes is not None:
                spread = sp.hstack([_scaled(shares, radiance) for radiance in lit.by_light], format="csr")
                shadows = sp.csr_matrix(spread @ lit.light.changes)
                result = result + (shadows if len(lit.by_light) == 1 else _largest(shadows))
        return sp.csr_matrix(result)


def _lit(
    group: LightGroup,
    light: SweptLight,
    tables: Sequence[BsdfTable],
    nearness: Array,
    slopes: tuple[Tensor, Tensor],
) -> _Lit:
    """Radiance toward a camera of faces with these slopes, lit by a group of lights."""
    face, shares = group.receivers.face, light.shares
    with torch.enable_grad():  # pictures are also taken inside torch functions, where there is none
        x, y = (slope.detach().clone().requires_grad_() for slope in slopes)
        of_faces = torch.zeros(len(shares), x.numel(), dtype=x.dtype)
        for table, near in zip(tables, torch.from_numpy(nearness), strict=True):
            of_faces = of_faces + near * table.to(x.dtype)(x, y).reshape(of_faces.shape)
        # Many lights have one share for each face; of a single light, each triangle has its own.
        lit = of_faces if len(shares) == 1 else of_faces * torch.from_numpy(shares)
        by_slopes = torch.autograd.grad(lit.sum(), (x, y))
    tilted = [change.numpy().ravel()[face] for change in by_slopes]
    if len(shares) == 1:
        tilted = [shares[0] * change for change in tilted]
    by_light = of_faces.detach().numpy()[:, face]
    return _Lit(group, light, by_light, (by_light * shares).sum(0), tilted[0], tilted[1])


def _scaled(shares: sp.csr_matrix, factors: Array) -> sp.csr_matrix:
    """Shares (pixels, receivers) times a factor for each receiver."""
    return sp.csr_matrix((shares.data * factors[shares.indices], shares.indices, shares.indptr), shares.shape)


def _largest(changes: sp.csr_matrix) -> sp.csr_matrix:
    """Derivatives (pixels, heights) without those much smaller than the largest of their pixel."""
    size = np.abs(changes.data)
    row = np.repeat(np.arange(changes.shape[0]), np.diff(changes.indptr))
    most = np.zeros(changes.shape[0])
    np.maximum.at(most, row, size)
    kept = np.flatnonzero(size >= LEAST_CHANGE * most[row])
    entries = changes.data[kept], (row[kept], changes.indices[kept])
    return sp.csr_matrix(entries, shape=changes.shape)


def _picture(pieces: FilmPieces, lit: _Lit, background: Array) -> Array:
    """(pixels,) under one group of lights."""
    rest = 1.0 - np.asarray(pieces.weights.sum(1)).ravel()
    return np.asarray(pieces.weights @ lit.radiance[lit.group.receivers.of_triangle] + rest * background)


def _filmed(camera: FastCamera, finer: list[_Linear]) -> list[_Linear]:
    """Values of the film's pixels from values of the finer pixels that the camera's lines show."""
    return finer if camera.film is None else [camera.film @ values for values in finer]
