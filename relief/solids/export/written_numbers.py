"""Numbers as files hold them: rows of arrays as text, and coordinates with the precision of a file."""

from collections.abc import Iterator

import numpy as np

from relief.ground.arrays import AnyArray, Array, in_blocks


def rows_as_text(template: str, rows: AnyArray) -> Iterator[bytes]:
    """Text of the rows of an array (n, k), each by a %-template of k numbers, in blocks."""
    for block in in_blocks(rows):
        yield ((template * len(block)) % tuple(block.ravel().tolist())).encode()


def nine_digits(vertices: Array) -> Array:
    """Coordinates (n, 3) to nine significant digits, which give back every number in single precision."""
    texts = rows_as_text("%.9g %.9g %.9g ", vertices)
    rows = [np.fromstring(text.decode(), sep=" ") for text in texts]
    return np.concatenate([np.empty(0), *rows]).reshape(-1, 3)


def single_precision(vertices: Array) -> Array:
    """Coordinates (n, 3) in single precision."""
    return vertices.astype(np.float32).astype(np.float64)
