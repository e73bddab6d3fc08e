"""Wrapping: a body displaced along its normals by a tile that has its size in mm everywhere."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from relief.ground.arrays import Array, Flags, FloatArray, Index
from relief.ground.errors import InputError
from relief.ground.lengths import shown
from relief.ground.options import checked
from relief.ground.progress import say, stage
from relief.solids.body import Body
from relief.solids.wrapping.bare_places import PlaceError
from relief.solids.wrapping.clearance import DRAFT_SAMPLES, MOST_SAMPLES, clearance_factor
from relief.solids.wrapping.displacing import displaced
from relief.solids.wrapping.edges import edge_of
from relief.solids.wrapping.file_surface import FileSurface, Settings
from relief.solids.wrapping.gaps import narrowest_gap
from relief.solids.wrapping.laying import Laid, TexturePlacer, beside, off_size, reach_of
from relief.solids.wrapping.masks import Regions, check_mask
from relief.solids.wrapping.measures import Bending, Lowering, Presence, bending, lowering, presence
from relief.solids.wrapping.placement import Placement
from relief.solids.wrapping.surfaces import BaseSurface, FineSurface
from relief.solids.wrapping.texture_tiles import Covering

MOST_PLACES = 4
"""Places left without texture at most, after each of which the wrapping begins anew."""
FEW_SAMPLES = 4
"""Side of the least square that carries a texture, in its samples."""
MOST_LEFT_BARE = 0.5
"""Largest share of the textured area without relief; beyond, the relief does not fit."""
BARE = 0.1
"""Factor of the heights below which an area counts as without relief."""


@dataclass(frozen=True)
class Wrapped:
    """A wrapped body, and measures of the wrapping.

    Attributes:
        body: The displaced body.
        original: The same triangles before the displacement.
        textured: (vertices,) how much of the texture each vertex carries, 0 to 1.
        seams: (vertices,) whether patches that do not fit are blended there.
        area_mm2: Area that carries texture.
        edge_mm: Longest edge of the textured triangles, mm.
        coordinates: "texture coordinates", "cylinder", "sphere", "plane" or "patches".
        patches: Number of patches, or of charts of a cylinder, sphere or plane.
        off_size: Share of the textured area on which lengths in the texture change by a tenth or more.
        stretch: Largest relative change of a length on 99 % of the area.
        notes: Lines about how the texture was placed, and what was changed so that it fits.
        blended: Part of the textured vertices, about that of the area, at which patches that do not fit are
            blended.
        factor: (vertices,) factors of the heights, below 1 where the relief would intersect itself.
        lowering: Area, factors and places where the relief is lowered.
        bending: Curvatures of the textured surface along the first texture's x and y.
        base: The part with texture, on coarse triangles.
        presence: How much of the relief is there.
        gap: Width and middle (3,), mm, of the narrowest gap between facing walls; None: there is none.
        source: (faces,) the face of the file's body in which each face lies.
        fine: Number of the faces that carry texture or lie beside it, which come first.
    """

    body: Body
    original: Body
    textured: Array
    seams: Flags
    area_mm2: float
    edge_mm: float
    coordinates: str
    patches: int
    off_size: float
    stretch: float
    notes: tuple[str, ...]
    blended: float
    factor: Array
    lowering: Lowering
    bending: tuple[Bending, Bending]
    base: BaseSurface
    presence: Presence
    gap: tuple[float, Array] | None
    source: Index
    fine: int


@stage("wrapping")
def wrap(
    body: Body,
    coverings: Sequence[Covering],
    settings: Settings | None = None,
    uv: Array | None = None,
    regions: Regions | None = None,
    written: Callable[[Body], Body] = lambda body: body,
    placement: Placement | None = None,
    colours: FloatArray | None = None,
    exact: Array | None = None,
) -> Wrapped:
    """Lay tiles over a body.

    Args:
        body: A solid, mm; each vertex once.
        coverings: The first lies everywhere; each later one replaces the earlier ones where its mask is 1.
        settings: How; None: the defaults.
        uv: (faces, 3, 2) texture coordinates of the corners. They place the texture where they keep its size;
            else, and without them, a cylinder does, or patches.
        regions: Regions of the object that masks may name.
        written: Gives a body with the coordinates that the file will hold.
        placement: Where and in what direction textures lie; None: the defaults.
        colours: (faces, 3, 3) of the corners, in sRGB from 0 to 1, for masks; None: the body has none.
        exact: (faces, 3, 3) unit normals of the exact surface at the corners, not finite where unknown; None:
            the surface is guessed from the facets.

    Returns:
        The wrapped body as written: closed as the body was, with every vertex once, and nowhere through
        itself.

    Raises:
        InputError: A mask is none or leaves nothing, a number is out of range, the triangles would be too
            many, the placement does not go with the body, or there is no room for the relief.
    """
    settings, regions = settings or Settings(), regions or {}
    masks = [covering.mask for covering in coverings]
    check_choices(settings, masks, regions, uv is not None, colours is not None)
    tallest = max(float(covering.tile.heights.max()) for covering in coverings)
    check_size(body, tallest)
    file = FileSurface(body, uv, regions, settings, colours, exact, masks)
    left: list[str] = []
    while True:
        try:
            wrapped = _wrapped(file, coverings, placement or Placement(), written)
            return replace(wrapped, notes=(*wrapped.notes, *left))
        except PlaceError as error:
            # A few noisy or crossing triangles stay as they were read, and the rest begins anew.
            if len(left) == MOST_PLACES:
                raise
            left.append(file.leave(error))
            say(left[-1])


def _wrapped(
    file: FileSurface, coverings: Sequence[Covering], placement: Placement, written: Callable[[Body], Body]
) -> Wrapped:
    """The wrapped body. Raises PlaceError where the surface cannot carry texture, and InputError."""
    settings = file.settings
    tallest = max(float(covering.tile.heights.max()) for covering in coverings)
    base, layer, laid = _placed(file, coverings, placement)
    where = base.textured
    edge_mm = edge_of(base.body, where, coverings, settings, len(base.rest.faces))
    with stage("room"):
        out_mm, in_mm = (1.0 - settings.level) * tallest, settings.level * tallest
        whole = base.rest.joined(base.body)
        around = Body(whole.vertices, whole.faces[len(base.body.faces) :])
        samples = DRAFT_SAMPLES if settings.draft else MOST_SAMPLES
        factor = clearance_factor(
            base.mesh, base.carried, out_mm, in_mm, settings.falloff_mm, around, samples
        )
    factor = np.where(base.carried > 0.0, factor, 1.0)
    check_room(base.body, where, factor, tallest)
    with stage("dividing triangles"):
        fine, rest = base.rest.divided(base.body, edge_mm, where)
    with stage("displacing"):
        surface = FineSurface(base, fine, rest, np.any([each.layout.laid() for each in laid], axis=0))
        height, textured = _heights(laid, surface, settings)
        offset = np.minimum((height - settings.level * tallest) * textured, surface.to_bed())
    wrapped, factor = displaced(surface, offset, factor, written)
    check_room(base.body, where, factor, tallest)
    own, original = np.arange(len(wrapped.faces)) < len(fine.parent), rest.joined(surface.fine.body)
    seams = _unfit(*laid[0].layout.at(surface.parent, surface.share))
    off, stretch = off_size(laid[0], base.body.areas, where)
    nearest = fine.corners.mean(axis=1).argmax(axis=1)
    return Wrapped(
        body=wrapped,
        original=original,
        textured=surface.padded(textured),
        seams=surface.padded(seams),
        area_mm2=float(base.body.areas[where].sum()),
        edge_mm=edge_mm,
        coordinates=layer.coordinates,
        patches=laid[0].layout.patches,
        off_size=off,
        stretch=stretch,
        notes=tuple(layer.notes),
        blended=float(seams[textured > 0.0].mean()),
        factor=surface.padded(surface.of_vertices(factor), 1.0),
        lowering=lowering(base.body, where, factor),
        bending=bending(base.body, base.mesh.normals, laid[0].layout, where),
        base=base,
        presence=presence(surface.fine.body, textured),
        gap=None if settings.draft else narrowest_gap(wrapped, original, own),
        source=np.concatenate([base.facets[base.mesh.facet[fine.parent, nearest]], rest.parent]),
        fine=len(fine.parent),
    )


def _placed(
    file: FileSurface, coverings: Sequence[Covering], placement: Placement
) -> tuple[BaseSurface, TexturePlacer, list[Laid]]:
    """The part of the surface that carries texture, and the textures in their places."""
    first, falloff_mm = coverings[0], file.settings.falloff_mm
    base = BaseSurface(file, reach_of(file, coverings, placement))
    layer = TexturePlacer(base, placement, falloff_mm)
    check_area(base.body, base.carried, first.tile.pitch_mm, first.mask)
    laid = layer.laid(coverings)
    if any(covering.once for covering in coverings):
        base.carried = base.carried * _present([each.on_base(base, falloff_mm) for each in laid])
        check_area(base.body, base.carried, first.tile.pitch_mm, first.mask)
    if all(covering.once for covering in coverings):
        # What textures leave bare that are placed once stays as it was read.
        old, base = base, BaseSurface(file, beside(base))
        laid = [each.moved(old, base) for each in laid]
        base.carried = base.carried * _present([each.on_base(base, falloff_mm) for each in laid])
    return base, layer, laid


def _present(shares: Sequence[Array]) -> Array:
    """Share (n,) of any texture, where later textures with shares (n,) cover earlier ones."""
    return np.asarray(1.0 - np.prod([1.0 - share for share in shares], axis=0))


def _heights(laid: Sequence[Laid], surface: FineSurface, settings: Settings) -> tuple[Array, Array]:
    """Heights of the textures at the fine vertices, mm, and their shares, 0 to 1.

    Raises InputError if the mask of a texture leaves nothing of the textured area.
    """
    carried = surface.carried()
    height, present = np.zeros(len(carried)), np.zeros(len(carried))
    for each in laid:
        tile, mask = each.covering.tile, each.covering.mask
        share = each.on_fine(surface, settings.falloff_mm)
        if mask is not None:
            check_area(surface.fine.body, share * carried, tile.pitch_mm, mask)
        height += share * (surface.heights(tile, each.layout, share > 0.0) - height)
        present += share * (1.0 - present)
    return np.divide(height, present, out=height, where=present > 0.0), present * carried


def _unfit(uv: Array, weight: Array) -> Flags:
    """(n,) whether patches with different coordinates share a place, the second with a twentieth at least."""
    if weight.shape[1] < 2:
        return np.zeros(len(weight), bool)
    first, second = np.argsort(-weight, axis=1)[:, :2].T
    rows = np.arange(len(weight))
    apart = np.linalg.norm(uv[rows, first] - uv[rows, second], axis=1)
    return np.asarray((weight[rows, second] > 0.05) & (apart > 0.1))


def check_choices(
    settings: Settings, masks: Sequence[str | None], regions: Regions, with_uv: bool, with_colours: bool
) -> None:
    """Refuse numbers out of range and invalid masks, before the surface is known.

    Args:
        settings: As for `wrap`.
        masks: Of the coverings.
        regions: As for `wrap`.
        with_uv: Whether the mesh has texture coordinates, or may have.
        with_colours: Whether it has colours, or may have.

    Raises:
        InputError: The line names the field.
    """
    checked(settings)
    for mask in (settings.mask, *masks):
        if mask is not None:
            check_mask(mask, regions, with_uv, with_colours)


def check_size(body: Body, tallest: float) -> None:
    """Refuse a body smaller than the height of the relief."""
    longest = float(np.ptp(body.vertices, axis=0).max())
    if longest < tallest:
        fault = f"size: {longest:.3g} mm is less than the {tallest:.3g} mm of the relief"
        raise InputError(
            f"{fault}; state the unit of the mesh (units), or take a lower relief (relief_mm)",
            f"{fault}; state the unit of the mesh (--units), or take a lower relief (--relief-mm)",
        )


def check_area(body: Body, carried: Array, pitch_mm: float, mask: str | None) -> None:
    """Refuse a texture on an area of less than a few samples, by its shares at vertices (n,)."""
    area = float((body.areas * carried[body.faces].mean(axis=1)).sum())
    least = (FEW_SAMPLES * pitch_mm) ** 2
    if area < least:
        named = "mask" if mask is None else f"mask: {shown(mask)}"
        raise InputError(
            f"{named}: leaves nothing of the surface to the texture, or {area:.2g} mm², where it needs "
            f"{least:.2g} mm² at least; take a wider mask or a smaller falloff"
        )


def check_room(body: Body, where: Flags, factor: Array, tallest: float) -> None:
    """Refuse a relief that is lowered to nothing on most of the textured area.

    Args:
        body: The surface.
        where: (faces,) triangles that carry texture.
        factor: (vertices,) factors of the heights.
        tallest: Height of the relief, mm.
    """
    areas, least = body.areas[where], factor[body.faces[where]].min(axis=1)
    bare = float(areas[least < BARE].sum() / areas.sum())
    if bare > MOST_LEFT_BARE:
        raise InputError(
            f"relief: {tallest:.3g} mm is too high for this object: on {100 * bare:.0f} % of the area its "
            "curvature or thickness leaves less than a tenth; take a lower relief (--relief-mm) or a larger "
            "object"
        )
