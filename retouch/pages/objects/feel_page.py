"""The page of `retouch evaluate part.3mf -o DIR`: a print file in the colours of its roughness."""

from pathlib import Path

from markupsafe import Markup

from optimize.verification.solids.mesh_feel import MeshFeel
from relief.ground.arrays import Array
from relief.ground.files import write_atomically
from retouch.pages.colour_maps import NO_VALUE, VIRIDIS
from retouch.pages.rendering import render_page
from retouch.pages.svg import colour_bar, nice_axis
from retouch.pages.viewer.figure import key, viewer_figure
from retouch.pages.viewer.lighter import lighter
from retouch.pages.viewer.models import ColourLayer, ViewerModel
from tactile.jnd import jnd_unless_smooth, smooth_clause
from tactile.quantities import CONTACT_AREA, ROUGHNESS

LAYER = "Roughness"
"""Name of the layer of colours."""


def write_feel_page(
    path: Path, stem: str, feel: MeshFeel, colours: Array, ends: tuple[float, float], skin: str
) -> Path:
    """Write the page, atomically; it is one file that fetches nothing from a network.

    Args:
        path: of the page.
        stem: of the mesh's file.
        feel: of the mesh.
        colours: (vertices, 3) in sRGB, from 0 to 1.
        ends: roughness of both ends of the colours.
        skin: its name.

    Returns:
        The path of the page.
    """
    grey = "#" + "".join(f"{channel:02x}" for channel in NO_VALUE)
    bar = colour_bar(VIRIDIS, nice_axis(*ends, tight=True), "Roughness, no unit")
    legend = Markup("{}<span>{}</span>").format(bar, key((grey, "beyond the reach of the places")))
    model = lighter(ViewerModel(stem, feel.body, [ColourLayer(LAYER, colours, legend)]))
    figure = viewer_figure(f"{stem} in the colours of its roughness", model, start=LAYER)
    roughness = feel.values[ROUGHNESS.name]
    least, most = float(roughness.min()), float(roughness.max())
    page = render_page(
        "feel.html.j2",
        viewer=True,
        kind="feel",
        pair={"title": stem},
        figure=figure,
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
    write_atomically(path, page)
    return path
