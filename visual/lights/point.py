"""Point light: near the plate, so that no parallel lights can stand for it."""

from visual.lights.kind import LightKind

POINT = LightKind(lambda light: "point light", "intensity", quadrature=None)
