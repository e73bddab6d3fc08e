"""Models of touch: their names for a person, and the grids that they take; nothing heavy is imported."""

MIN_SAMPLES, MAX_SAMPLES = 16, 1024
"""Fewest and most samples a side of a relief to press on."""
FEM_MESH = 64
"""Nodes a side of the finite elements: within 0.26 % of V by 128, median 0.04 % (docs/evidence/touch.md)."""
MIN_MESH, MAX_MESH = 8, 160
"""Fewest and most nodes a side; 128 take 45 s and 2.1 GB to assemble, and more take far more."""

MODEL_NAMES = {
    "layer": "elastic layer",
    "quick": "elastic layer, few steps of the solver",
    "net": "elastic layer, learned net",
    "fem": "finite elements",
}
"""Name for a person of each model of touch, by its key in run files."""


def model_name(key: str | None) -> str:
    """The name of a model of touch, or its key if the key is unknown; "verified" for None."""
    return MODEL_NAMES.get(key or "", key or "verified")
