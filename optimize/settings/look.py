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
        model: model of the pictures in the steps; "auto" is "fast" where that can show the scene, else
            "exact". To compare with: "shading" has no shadows and no ambient occlusion, "heights" keeps the
            heights.
        weight: w1, the weight of the pictures; by default 1 for gauss-newton and 0.1 for adam.
        samples: samples a pixel, of pictures that Mitsuba renders for the steps of adam; by default fixed
            samples without noise.
        masking: weight of contrast masking: pixels count 1 / (1 + masking c / mean c), with c the local
            contrast of the original, so that smooth parts are kept better.
        broad: low-pass term of the loss: how much more a change of brightness over several millimetres counts
            than the same change of fine detail; the paper's is 0.
        shape: weight of the height change: a change of 1 mm counts as a change of the pictures by so many
            times their mean. It keeps the look from sides that the scene has no camera for.
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
        model: model of touch that verifies: finite elements; the elastic layer, pressed on the result from a
            cold start; or no verification.
        resolution: nodes along a side of the finite elements, which are built once for each skin.
        corrections: largest number of corrections of the surrogate target.
        samples: samples a pixel, of the pictures before and after; by default as many as their change needs,
            up to 256.
        distance_cm: from the eye to the plate, cm, for FLIP and JOD.
        baseline: whether the report shows the original scaled in height to the same target.
        jod: whether JOD is computed, which takes two seconds and the extra `jod`.
    """

    model: Literal["fem", "layer", "none"] = "fem"
    resolution: Annotated[int, Field(ge=MIN_MESH, le=MAX_MESH, multiple_of=2)] = FEM_MESH
    corrections: Annotated[int, Field(ge=0, le=20)] = 3
    samples: Samples | None = None
    distance_cm: Annotated[float, Field(ge=NEAREST_EYE_CM, le=FARTHEST_EYE_CM)] = EYE_DISTANCE_CM
    baseline: bool = True
    jod: bool = False
