"""Point light: near the plate, so that no parallel lights can stand for it."""

from visual.lights.kind import UNSAMPLED, LightKind

POINT = LightKind(lambda light: "point light", "intensity", quadrature=None, switch=UNSAMPLED)
