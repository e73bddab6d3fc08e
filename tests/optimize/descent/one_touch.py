"""Values of quantities as one touch gives them."""

import numpy as np


def one_touch(**values: float) -> dict[str, np.ndarray]:
    """(1,) of each quantity by name."""
    return {name: np.array([value]) for name, value in values.items()}
