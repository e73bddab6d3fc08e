"""Scenes of hills under any lights, as the tests of sight have them."""

from tests.visual.conftest import scene_of  # noqa: F401
