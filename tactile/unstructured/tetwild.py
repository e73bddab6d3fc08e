"""Child process that meshes, because pytetwild can crash or never return.

The child runs as `python tetwild.py IN.npz OUT.npz`, and imports neither torch nor this package. The arrays
of IN are arguments of `pytetwild.tetrahedralize` by name.
"""

import os
import sys

import numpy as np
from pytetwild import tetrahedralize


def main(source: str, target: str) -> None:
    with np.load(source) as file:
        arguments = {name: file[name] if file[name].ndim else file[name].item() for name in file.files}
    vertices, cells = tetrahedralize(**arguments)
    np.savez(target + ".part.npz", vertices=vertices, cells=cells)
    os.replace(target + ".part.npz", target)


if __name__ == "__main__":
    main(*sys.argv[1:])
