"""Solids: checks whether a printer can make a body, and what has to be repaired."""

import numpy as np

from relief.ground.arrays import Flags
from relief.ground.errors import InputError
from relief.solids.body import Body
from relief.solids.meshes.intersections import MOST, self_intersections
from relief.solids.meshes.neighbourhood import connected, edge_balance, edge_pairs
from relief.solids.meshes.shells import (
    MOST_BOXES,
    body_volumes,
    components,
    crossing_place,
    part_boxes,
    parts_within_others,
    repeats,
    united,
)
from relief.solids.meshes.wedges import separated

THINNEST = 1e-7
"""Least volume of a solid, relative to the cube of its longest side; a sheet has less."""
MEND = "mend it in a slicer or by Blender's 3D Print toolbox"


def volume_mm3(body: Body) -> float:
    """Volume that the faces enclose, mm³; negative if they are turned inside out."""
    return float(body_volumes(body).sum())


def check_closed(body: Body, name: object, *, repeated: bool = False) -> None:
    """Refuse a body that is open, turned inside out, without volume, or has faces twice.

    Args:
        body: with one position per vertex.
        name: of the file, for the message.
        repeated: whether faces may lie there twice.

    Raises:
        InputError: The body encloses nothing; the line says what to do.
    """
    _, count, balance = edge_balance(body.faces)
    if open_edges := np.count_nonzero(count % 2):
        raise InputError(f"{name}: is open: {open_edges} edges border on a hole; {MEND}")
    if twisted := np.count_nonzero((count % 2 == 0) & (balance != 0.0)):
        raise InputError(f"{name}: {twisted} edges lie between faces turned against one another; {MEND}")
    if not repeated and (twice := len(repeats(body.faces))):
        fault = f"{name}: {twice} faces lie there twice; remove the parts that are there twice"
        raise InputError(f"{fault} (unite)", f"{fault} (--unite)")
    volumes, longest = body_volumes(body), float(np.ptp(body.vertices, axis=0).max())
    if abs(volumes.sum()) < THINNEST * longest**3:
        raise InputError(f"{name}: encloses no volume; give the surface a thickness")
    if inside_out(body, name).any():
        raise InputError(f"{name}: is turned inside out; flip the normals (Blender: Mesh, Normals, Flip)")


def check_solid(body: Body, name: object) -> None:
    """Refuse a body that is no solid: as `check_closed`, and one with faces or parts that overlap.

    Args:
        body: with one position per vertex.
        name: of the file, for the message.

    Raises:
        InputError: The body is no solid; the line says what to do.
    """
    check_closed(body, name)
    if line := crossings(body) or _held_parts(body, name):
        raise _overlap(f"{name}: {line}", body)


def check_parts(body: Body, name: object) -> None:
    """Refuse a closed body of which parts lie within others; faces may pass through one another.

    Raises InputError; the line says what to do.
    """
    # Of parts that pass through one another the search cannot tell which lies within which.
    if (line := _held_parts(body, name)) and not self_intersections(body):
        raise _overlap(f"{name}: {line}", body)


def crossings(body: Body) -> str:
    """How many faces pass through one another and near which point, for a person; empty if none do."""
    if not (pairs := self_intersections(body)):
        return ""
    place = ", ".join(f"{value:.4g}" for value in crossing_place(body))
    count = f"{'at least ' * (pairs >= MOST)}{pairs} pairs of faces"
    return f"passes through itself: {count}, some near ({place}) mm"


def _held_parts(body: Body, name: object) -> str:
    """How many parts of a body lie within others, for a person; empty if none do. Raises InputError."""
    within = parts_within_others(body, name)
    return f"{within} of its parts lie within others" if within else ""


def _overlap(fault: str, body: Body) -> InputError:
    """The error that says what mends a body that overlaps itself."""
    advice = overlap_advice(body)
    return InputError(*(f"{fault}; {advice.format(option)}" for option in ("unite", "--unite")))


def overlap_advice(body: Body, united: bool = False) -> str:
    """What mends a body that overlaps itself, with braces for the name of the option that unites parts."""
    if components(body).any() and not united:
        return "unite its parts ({}), or " + MEND
    return f"{'' if united else 'as it is one part, '}remesh it (Blender: Remesh, Voxel), or {MEND}"


def outer_body(body: Body, name: object) -> tuple[Body, tuple[str, ...]]:
    """The body that fingers touch, and warnings about it.

    Args:
        body: With one position per vertex.
        name: Of the file, for messages.

    Returns:
        The same body and no lines if it is a solid. Else its shells as one, without hollows that lie inside,
        and a line with the number of crossing pairs of faces and a place of one, mm.

    Raises:
        InputError: The body is open, turned inside out or without volume.
    """
    check_closed(body, name, repeated=True)
    twice = len(repeats(body.faces))
    line = f"{twice} faces lie there twice" if twice else crossings(body) or _held_parts(body, name)
    return (united(body)[0], (f"{line}; its outside is felt",)) if line else (body, ())


def inside_out(body: Body, name: object) -> Flags:
    """(m,) faces of shells of a closed body that have negative volume and are no hollows.

    Parts that touch are shells of their own; the box of another shell holds a hollow. With a negative
    volume in total all shells are inside out. Raises InputError if there are too many for the search.
    """
    own, origin, _ = separated(body)
    shell = connected(edge_pairs(own.faces) // 3, len(own.faces))
    volumes = np.bincount(shell, body_volumes(own))
    turned = np.full(len(volumes), volumes.sum() < 0.0)
    negative = np.flatnonzero((volumes < 0.0) ^ turned)
    if len(negative) * len(volumes) > MOST_BOXES:
        raise InputError(f"{name}: its {len(volumes)} parts are too many to tell whether they are hollows")
    low, high = part_boxes(own, shell) if len(negative) else (np.zeros((0, 3)),) * 2
    for one in negative:
        holds = (low <= low[one]).all(axis=1) & (high >= high[one]).all(axis=1)
        turned[one] ^= np.count_nonzero(holds) == 1
    faces = np.zeros(len(body.faces), bool)
    faces[origin] = turned[shell]
    return faces
