"""Settings of a run whose steps are computed with the fast models; the verification stays exact."""

FAST_MODELS = {"touch.model": "quick", "look.model": "auto"}
"""Values by their keys in the run file."""
