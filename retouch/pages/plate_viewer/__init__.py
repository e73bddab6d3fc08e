"""The plate viewer: a relief before and after under a lamp that the reader moves, in plain WebGL.

`plate_viewer.js` is the component, with its interface at its head; it needs `plate_light.js` before it.
`plate_figures.js` makes the figures of a page alive. None of them takes a build.
"""
