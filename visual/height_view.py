"""Height differences in place of pictures: a look to compare with, for descents that see no light.

    value of a sample = LEVEL (1 + PER_MM (height - height of the original))

All conditions are alike. Unit and level make the squares comparable with those of pictures.
"""

from typing import ClassVar

import numpy as np
import scipy.sparse as sp
import torch
from torch import Tensor

from relief.ground.arrays import Array
from visual.exact.view import Pictures
from visual.looks import FixedSamples, Rendering, StepView
from visual.scene import Scene

LEVEL = 0.2
"""Value of a height that has not changed. Mean pictures of gravel, grass and brick in the studio are 0.14 to
0.26 of white."""
PER_MM = 20.0
"""Relative change of a value by a millimetre of its height. Pictures of the same textures change by 18 to 28
times their mean for a millimetre of one height (root of the sum of squares over the pixels)."""


class HeightsLook:
    """No pictures of a scene but height differences, which are their own view.

    Attributes:
        overhead: that the picture ends where the plate ends, as from straight above.
    """

    overhead: ClassVar[bool] = True

    def __init__(self, scene: Scene) -> None:
        self._original, self._conditions = scene.heights, len(scene.conditions)

    def check(self) -> None:
        """Every scene has heights."""

    def pictures(self, heights: Tensor, rendering: Rendering | None = None) -> Tensor:
        """Values (..., conditions, rows, cols) of heights (..., rows, cols) in mm, differentiable."""
        difference = heights - torch.as_tensor(self._original, dtype=heights.dtype)
        return torch.stack([LEVEL * (1.0 + PER_MM * difference)] * self._conditions, dim=-3)

    def views(self, samples: FixedSamples) -> tuple[StepView, ...]:
        """The look itself; see the protocol."""
        return (self,)

    def evaluate(self, heights: Array, jacobian: bool = True, edges: bool = True) -> Pictures:
        """Values of a relief, and their Jacobians.

        Args:
            heights: (rows, cols) mm.
            jacobian: whether derivatives are wanted.
            edges: without meaning; as of a view.
        """
        identity = LEVEL * PER_MM * sp.identity(heights.size, format="csr")
        values = self.pictures(torch.as_tensor(heights, dtype=torch.float64)).numpy()
        return Pictures(np.asarray(values), (identity,) * self._conditions if jacobian else ())

    def plate_weights(self, pictures: Array) -> Array:
        """1, because every sample is of the plate; see the protocol."""
        return np.ones_like(pictures)
