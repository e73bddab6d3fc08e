"""The page of `retouch evaluate part.3mf -o DIR`: a print file in the colours of its roughness."""

from pathlib import Path

from markupsafe import Markup

from optimize.verification.solids.mesh_feel import MeshFeel
from relief.ground.arrays import Array
from relief.ground.formatting import number
from retouch.pages.colour_maps import NO_CONTACT, VIRIDIS
from retouch.pages.objects.object_page import Card, write_object_page
from retouch.pages.svg import colour_bar, nice_axis
from retouch.pages.viewer.figure import key, viewer_figure
from retouch.pages.viewer.lighter import MOST_FACES, lighter
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
    grey = "#" + "".join(f"{channel:02x}" for channel in NO_CONTACT)
    bar = colour_bar(VIRIDIS, nice_axis(*ends, tight=True), "Roughness, no unit")
    legend = Markup("{}<span>{}</span>").format(bar, key((grey, "beyond the reach of the places")))
    model = lighter(ViewerModel(stem, feel.body, [ColourLayer(LAYER, colours, legend)]))
    figure = viewer_figure(f"{stem} in the colours of its roughness", model, start=LAYER)
    deck = "How rough the surface feels where a finger has room to press."
    return write_object_page(
        path, "feel", stem, deck, figure, _cards(feel, skin), _notes(feel, model, len(feel.body.faces))
    )


def _cards(feel: MeshFeel, skin: str) -> list[Card]:
    roughness, count = feel.values[ROUGHNESS.name], len(feel.crops)
    least, most = float(roughness.min()), float(roughness.max())
    mean = feel.means[ROUGHNESS.name]
    spread = "at the only place"
    if count > 1:
        spread = f"mean; {number(least)} to {number(most)} over {count} places"
    cards = [Card("Roughness", number(mean), "", f"{spread}; skin {skin}")]
    if (apart := jnd_unless_smooth(most, least)) is None:
        cards.append(Card("Spread", "smooth", "", smooth_clause(least)))
    elif count > 1:
        cards.append(Card("Spread", number(apart, 2), "JND", "just-noticeable differences between the ends"))
    area = feel.means[CONTACT_AREA.name]
    cards.append(Card("Contact", number(area), "mm²", "mean area that the finger touches"))
    return cards


def _notes(feel: MeshFeel, model: ViewerModel, faces: int) -> list[str]:
    details = feel.details()
    notes = [
        f"The object's own curvature is {details['curvature']}.",
        "A vertex has the roughness of the places around it, the nearer the more. Between places, which lie "
        "2.5 mm apart or farther, nothing is measured.",
        "The colours reach at least one just-noticeable difference below and above the mean, so that what "
        "nobody feels is one colour.",
    ]
    if faces > MOST_FACES:
        shown = round(len(model.body.faces), -3)
        notes.append(f"The page shows {shown:,} triangles of the file's {faces:,}; all of them were pressed.")
    return notes
