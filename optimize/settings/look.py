"""Sections `[look]` and `[verify]` of a run file: the pictures that are kept, and the check of the result."""

from typing import Annotated, Literal

from pydantic import Field

from optimize.settings.toml_files import NotNegative, Section, one_of
from relief.ground.limits import EYE_DISTANCE_CM, FARTHEST_EYE_CM, NEAREST_EYE_CM
from tactile.touch_limits import FEM_MESH, MAX_MESH, MIN_MESH
from visual.looks import AUTO, EXACT, LOOKS

Samples = Annotated[int, Field(ge=1, le=65536)]


class Look(Section):
    """`[look]`: the pictures that are kept.

    Attributes:
        model: of the pictures, for the descent; "auto": fast where it can show the scene, else exact.
            To compare with: "shading", without shadows and ambient occlusion; "heights", height differences.
        weight: w1; None: the method's own, 1 for gauss-newton and 0.1 for adam.
        samples: a pixel, of pictures that Mitsuba renders for adam's steps; None: fixed samples, no noise.
        masking: strength of the weights by which gauss-newton keeps smooth parts of the pictures better than
            those of high contrast, in which changes hide; 0, the default: all alike.
        broad: how much more gauss-newton minds a change of brightness over several millimetres than the same
            change of fine detail; 0: no more.
        shape: change of the pictures, in units of their mean, as which gauss-newton counts a change of the
            relief by 1 mm; 0, the default: not at all. Bounds what no camera of the scene looks at: from the
            side, relief that rises moves.
    """

    model: Annotated[str, one_of(LOOKS, AUTO)] = EXACT
    weight: NotNegative | None = None
    samples: Samples | None = None
    masking: Annotated[float, Field(ge=0, le=100)] = 0.0
    broad: Annotated[float, Field(ge=0, le=1000)] = 10.0
    shape: Annotated[float, Field(ge=0, le=1000)] = 0.0


class Verify(Section):
    """`[verify]`: the check of the result.

    Attributes:
        model: of touch that verifies: `fem`, finite elements; `layer`, the elastic layer, pressed on the
            result from a cold start; `none`, no verification.
        resolution: nodes along a side of the finite elements, which are built once for each skin.
        corrections: largest number of times that the goal of the descent is corrected where verification
            finds the target missed.
        samples: a pixel, of the pictures before and after; None: until their change is known.
        distance_cm: from the eye to the plate, for FLIP and JOD.
        baseline: whether the report shows the original scaled in height to the same target.
        jod: whether JOD is computed, which takes two seconds and the package `cvvdp`.
    """

    model: Literal["fem", "layer", "none"] = "fem"
    resolution: Annotated[int, Field(ge=MIN_MESH, le=MAX_MESH, multiple_of=2)] = FEM_MESH
    corrections: Annotated[int, Field(ge=0, le=20)] = 3
    samples: Samples | None = None
    distance_cm: Annotated[float, Field(ge=NEAREST_EYE_CM, le=FARTHEST_EYE_CM)] = EYE_DISTANCE_CM
    baseline: bool = True
    jod: bool = False
