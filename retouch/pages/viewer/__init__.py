"""The 3-D viewer of pages: bodies that the mouse turns, without a network.

`viewer.js` is three.js and the files in `source`, built into one by `make viewer`.
"""
