"""Names that `retouch wrap` takes, of objects and projections; this module imports nothing."""

OBJECTS = ("starfish", "bracelet", "slider", "frog", "curved", "ball", "cylinder")
"""Names of the objects that come with Retouch, in the order of the rows of `relief.solids.objects.table`."""
PROJECTIONS = {
    "auto": "relief.solids.wrapping.coordinates.found:automatic",
    "cylinder": "relief.solids.wrapping.coordinates.found:cylinder",
    "sphere": "relief.solids.wrapping.coordinates.found:sphere",
    "plane": "relief.solids.wrapping.coordinates.found:plane",
    "uv": "relief.solids.wrapping.coordinates.found:texture_coordinates",
    "patches": "relief.solids.wrapping.coordinates.found:patches",
}
"""Functions from a `CoordinateSearch` to `Coordinates`, by the name of the projection."""
