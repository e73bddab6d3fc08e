"""The child process that meshes: pytetwild can crash or never return, and must take nobody along.

Run as `python tetwild.py IN.npz OUT.npz`; it stands alone so that the child loads neither torch nor this
package. The arrays of IN are arguments of `pytetwild.tetrahedralize` by name.
"""

import os
import sys

import numpy as np
from pytetwild import tetrahedralize


def main(source: str, target: str) -> None:
    with np.load(source) as given:
        arguments = {name: given[name] if given[name].ndim else given[name].item() for name in given.files}
    vertices, cells = tetrahedralize(**arguments)
    np.savez(target + ".part.npz", vertices=vertices, cells=cells)
    os.replace(target + ".part.npz", target)


if __name__ == "__main__":
    main(*sys.argv[1:])
