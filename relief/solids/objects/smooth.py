"""Smooth objects from implicit functions: starfish, slider, free form, ball."""

import numpy as np

from relief.ground.arrays import Array
from relief.solids.body import Body
from relief.solids.objects.implicit import body_of, round_cone, smooth_union

ARMS = 5
"""Arms of the starfish."""
ARM_MM, HUB_MM, TIP_MM = 34.0, 8.0, 4.2
"""Length of an arm between the middles of hub and tip, mm, and the radii there."""
FILLET_MM = 2.5
"""Fillet between the arms of the starfish, mm."""
SUNK = 0.35
"""Height of the middle of hub and tips above the table, in their radii: what lies below is cut off."""
SLIDER_MM = (60.0, 14.0, 8.0)
"""Length, width and height of the slider, mm."""
SLIDER_EDGE_MM = 4.0
"""Radius of the slider's upper edge, mm."""


def starfish(edge_mm: float = 0.8) -> Body:
    """A starfish about 80 mm wide that lies flat: five tapering arms, thick in the middle."""
    turns = 0.5 * np.pi + 2.0 * np.pi * np.arange(ARMS) / ARMS
    hub = np.array([0.0, 0.0, SUNK * HUB_MM])
    tips = [np.array([ARM_MM * np.cos(turn), ARM_MM * np.sin(turn), SUNK * TIP_MM]) for turn in turns]

    def field(points: Array) -> Array:
        arms = [round_cone(points, hub, tip, HUB_MM, TIP_MM) for tip in tips]
        # Lower in the middle than a ball: the arms join in one slope.
        return smooth_union(np.stack(arms), FILLET_MM)

    reach = ARM_MM + TIP_MM + FILLET_MM
    high = np.array([reach, reach, HUB_MM + 3.0 * FILLET_MM])
    return body_of(field, -high, high, edge_mm, 0.0)


def slider(edge_mm: float = 0.7) -> Body:
    """The cap of a dimmer's slider: a bar with round ends and a round upper edge, flat above and below."""
    length, width, height = SLIDER_MM
    radius, round_mm = 0.5 * width, SLIDER_EDGE_MM
    half = 0.5 * length - radius

    def field(points: Array) -> Array:
        beyond = np.maximum(np.abs(points[:, 0]) - half, 0.0)
        aside = np.hypot(beyond, points[:, 1]) - (radius - round_mm)
        above = np.abs(points[:, 2]) - (height - round_mm)
        outside = np.hypot(np.maximum(aside, 0.0), np.maximum(above, 0.0))
        return outside + np.minimum(np.maximum(aside, above), 0.0) - round_mm

    high = np.array([0.5 * length, radius, height])
    return body_of(field, -high, high, edge_mm, 0.0)


def frog(edge_mm: float = 0.8) -> Body:
    """A free form about 50 mm long that stands flat: body, head, eyes and legs of a frog that sits."""
    parts = [
        ((-8.0, 0.0, 11.0), (8.0, 0.0, 15.0), 13.0, 10.0),
        ((14.0, 0.0, 15.5), (19.0, 0.0, 15.0), 9.0, 7.0),
    ]
    for side in (-1.0, 1.0):
        parts += [
            ((16.0, side * 6.0, 21.5), (16.5, side * 6.3, 22.5), 3.6, 3.2),
            ((-12.0, side * 13.0, 7.0), (-1.0, side * 17.0, 4.5), 7.0, 5.0),
            ((-4.0, side * 19.0, 2.0), (6.0, side * 20.0, 1.5), 4.0, 3.0),
            ((9.0, side * 8.0, 9.0), (13.0, side * 13.0, 2.0), 4.5, 3.2),
        ]

    def field(points: Array) -> Array:
        cones = [
            round_cone(points, np.array(start), np.array(end), start_mm, end_mm)
            for start, end, start_mm, end_mm in parts
        ]
        return smooth_union(np.stack(cones), 1.8)

    return body_of(field, np.array([-28.0, -28.0, -8.0]), np.array([32.0, 28.0, 32.0]), edge_mm, 0.0)


def ball(radius_mm: float = 15.0, edge_mm: float = 0.8) -> Body:
    """A ball with triangles of about one size."""

    def field(points: Array) -> Array:
        return np.asarray(np.linalg.norm(points, axis=1) - radius_mm)

    corner = np.full(3, radius_mm)
    return body_of(field, -corner, corner, edge_mm)
