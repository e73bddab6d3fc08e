"""Verbs about filament: how a sliced part feels, and what a slicer leaves of a texture."""
