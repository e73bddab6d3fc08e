"""Sight: what a relief looks like, with gradients. Importing this loads neither Mitsuba nor Dr.Jit."""

from visual.errors import InputError as InputError
from visual.heightmap import load_heights as load_heights
from visual.scene import Scene as Scene
from visual.scene import load_scene as load_scene
