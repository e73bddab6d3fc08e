"""The small case of the descent, for tests of what stands on it."""

from tests.optimize.conftest import (
    _patience,  # noqa: F401
    original,  # noqa: F401
    problem_with,  # noqa: F401
    scene,  # noqa: F401
    studio,  # noqa: F401
    texture,  # noqa: F401
)
