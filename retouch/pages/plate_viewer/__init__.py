"""The plate viewer: a relief before and after under a lamp that the reader moves, without a library.

`plate_viewer.js` is the component, with its interface at its head; it needs `plate_light.js`, which finds the
light, and `plate_screens.js`, which draws by WebGL 2 or on a 2-D canvas, before it. `plate_figures.js` makes
the figures of a page alive. None of them takes a build.
"""

SCRIPTS = ("plate_light.js", "plate_screens.js", "plate_viewer.js")
"""Files of the component `PlateView`, in their order; what embeds it needs no other."""
