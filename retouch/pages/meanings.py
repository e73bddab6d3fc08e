"""What the numbers of pages mean for a person who has not read the paper, and what was verified by what."""

from tactile.jnd import SMOOTH_BELOW
from tactile.quantities import QUANTITIES

MEANINGS = {
    **{name: quantity.meaning for name, quantity in QUANTITIES.items()},
    "jnd": "One just-noticeable difference (JND) is a ratio of 1.19 in roughness: a person who touches both "
    "plates names the rougher one in 84 of 100 tries. Two are 97 of 100; guessing is 50.",
    "smooth": f"Below a roughness of {SMOOTH_BELOW:g}, the least that people have judged, a ratio is no "
    "number of just-noticeable differences. A sliding finger may feel waves of the skin's surface.",
    "contact_fraction": "The contact fraction is the share of the plate that bears pressure. The contact "
    "area is larger, as it also counts skin close by, at a gap of 0.0125 mm by half.",
    "eye": "How much the radiance of a pixel changes on average, over all pixels that show the plate and all "
    "lights, in percent of the mean picture before. The root mean square (rms) counts few large changes more "
    "than many small ones. White is a white plate that faces the light.",
    "dssim": "Structural dissimilarity, (1 \N{MINUS SIGN} SSIM) / 2: 0 for equal pictures, 1 at most.",
    "flip": "The difference that an eye sees when the two pictures alternate, 0 to 1; details too fine for "
    "the eye at its distance do not count.",
    "jod": "Just-objectionable differences, by ColorVideoVDP: 10 for equal pictures; one less where 75 of "
    "100 people find the second picture worse than the first.",
    "step_bias": "Root mean square difference of the pictures by which steps steer from rendered ones, "
    "without light from face to face, before the first step and free of noise.",
    "time": "From the start of the command to its last file, on the machine of the run.",
}
"""Sentences by the name of the number."""

VERIFIED = {
    "feel": "a second model (finite elements) at held-out contact locations; both models by exact solutions "
    "of contact and by tetrahedra on another mesh",
    "look": "Mitsuba's path tracer, less its noise; gradients by finite differences of converged renders",
    "published findings": "`retouch study published`: of 28 that nothing was fitted to, the default finger "
    "predicts 15",
    "files": "PrusaSlicer and Blender, which open and slice them",
    "analysis of answers": "simulated people, whose differences are known",
}
"""What was verified, by what."""
NOT_VERIFIED = (
    "No person has felt a print of Retouch and no print has been measured; what people feel is predicted."
)
OTHER_FINGERS = (
    "A change of 2 JND that was made for the default finger is 1.5 to 1.9 JND to fingers fitted to "
    "measurements on people (means over ten tiles, by finite elements; single tiles 0.4 to 2.5 JND)."
)
"""What fingers feel for which a tile was not optimised (docs/evidence/touch.md, crossed fingers)."""


def status_lines() -> list[str]:
    """What was verified by what, and what was not, a line each."""
    return [*(f"{what}: verified by {by}" for what, by in VERIFIED.items()), NOT_VERIFIED, OTHER_FINGERS]
