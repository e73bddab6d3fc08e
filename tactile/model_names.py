"""Names of the models of touch for a person; nothing heavy is imported."""

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
