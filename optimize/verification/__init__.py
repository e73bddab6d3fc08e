"""Verification of a result: how it feels and looks, measured by the best models, and how sure that is."""
