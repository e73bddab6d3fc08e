"""Roughness as colours on a mesh: a GLB with a colour at each vertex, a picture, and a page to turn it on."""

from pathlib import Path

import numpy as np
from markupsafe import Markup
from scipy.spatial import cKDTree

from optimize.verification.solids.mesh_feel import MeshFeel
from relief.ground.arrays import Array
from relief.ground.files import write_atomically
from relief.ground.progress import stage
from relief.solids.body import Part
from relief.solids.export.parts import write_parts
from relief.solids.meshes.mesh_places import vertex_normals
from retouch.pages.colour_maps import NO_VALUE, VIRIDIS
from retouch.pages.rendering import render_page
from retouch.pages.svg import colour_bar, nice_axis
from retouch.pages.viewer.figure import key, viewer_figure
from retouch.pages.viewer.lighter import lighter
from retouch.pages.viewer.models import ColourLayer, ViewerModel
from retouch.pages.viewer.still import still_png
from tactile.jnd import ROUGHNESS_JND, jnd_unless_smooth, smooth_clause
from tactile.quantities import CONTACT_AREA, ROUGHNESS

LAYER = "Roughness"
"""Name of the layer of colours."""

NEIGHBOURS, WIDTH_MM = 8, 2.5
"""Places whose roughness goes into the colour of a vertex, and the width of their weights, mm."""
FARTHEST_MM = 5.0
"""Distance from the next place beyond which a vertex is grey, mm: half a finger's patch."""
FACING = 0.1
"""Least cosine between the normal of a vertex and the axis of the place next to it; others are grey."""


def vertex_colours(feel: MeshFeel) -> tuple[Array, tuple[float, float]]:
    """Colours (n, 3) in sRGB of the vertices, and the roughness of both ends of the colours.

    The ends are at least one just-noticeable difference from the mean each, so that what nobody feels is one
    colour. Surfaces beyond the reach of the places are grey.
    """
    roughness = feel.values[ROUGHNESS.name]
    mean = float(roughness.mean())
    ends = (
        min(float(roughness.min()), mean / ROUGHNESS_JND),
        max(float(roughness.max()), mean * ROUGHNESS_JND),
    )
    frames = [crop.frame for crop in feel.crops]
    at, axes = np.array([frame.at for frame in frames]), np.array([frame.axes[2] for frame in frames])
    vertices = feel.body.vertices
    count = min(NEIGHBOURS, len(frames))
    distance, near = (found.reshape(len(vertices), -1) for found in cKDTree(at).query(vertices, k=count))
    facing = np.einsum("nki,ni->nk", axes[near], vertex_normals(feel.body))
    weights = np.where(facing > FACING, np.exp(-0.5 * (distance / WIDTH_MM) ** 2), 0.0)
    reached = (weights * (distance < FARTHEST_MM)).sum(axis=1) > 0.0
    total = np.where(reached, weights.sum(axis=1), 1.0)
    felt = (weights * roughness[near]).sum(axis=1) / total
    share = (felt - ends[0]) / max(ends[1] - ends[0], 1e-12)
    colours = VIRIDIS[np.clip(255.0 * share, 0, 255).astype(np.int64)] / 255.0
    colours[~reached] = np.array(NO_VALUE) / 255.0
    return colours, ends


@stage("colouring a mesh")
def write_coloured(folder: Path, stem: str, feel: MeshFeel, skin: str) -> tuple[Path, Path, Path]:
    """Write ``STEM-roughness.glb``, ``STEM-roughness.png`` and a page, ``STEM-roughness.html``.

    Args:
        folder: Made if missing.
        stem: Of the mesh's file.
        feel: Of the mesh.
        skin: Its name, for the legend.

    Returns:
        The three files.

    Raises:
        OSError: A file cannot be written.
    """
    colours, ends = vertex_colours(feel)
    solid, picture, page = (folder / f"{stem}-roughness.{suffix}" for suffix in ("glb", "png", "html"))
    write_parts(solid, [Part(stem, feel.body, colours=colours)])
    grey = "#" + "".join(f"{channel:02x}" for channel in NO_VALUE)
    bar = colour_bar(VIRIDIS, nice_axis(*ends, tight=True), "Roughness, no unit")
    legend = Markup("{}<span>{}</span>").format(bar, key((grey, "beyond the reach of the places")))
    model = ViewerModel(stem, feel.body, [ColourLayer(LAYER, colours, legend)])
    write_atomically(picture, still_png(model, LAYER))
    write_atomically(page, _page(feel, lighter(model), skin))
    return solid, picture, page


def _page(feel: MeshFeel, model: ViewerModel, skin: str) -> bytes:
    """The page of a model of the mesh, which may be lighter; one file that fetches nothing from a network."""
    roughness = feel.values[ROUGHNESS.name]
    least, most = float(roughness.min()), float(roughness.max())
    return render_page(
        "feel.html.j2",
        viewer=True,
        kind="feel",
        pair={"title": model.name},
        figure=viewer_figure(f"{model.name} in the colours of its roughness", model, start=LAYER),
        feel=feel,
        skin=skin,
        mean=feel.means[ROUGHNESS.name],
        least=least,
        most=most,
        apart=jnd_unless_smooth(most, least),
        smooth=smooth_clause(least),
        area=feel.means[CONTACT_AREA.name],
        faces=len(feel.body.faces),
        shown=len(model.body.faces),
    )
