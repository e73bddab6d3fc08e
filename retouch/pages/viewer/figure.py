"""The viewer as a part of a page: HTML with the meshes and a still picture."""

import base64
from collections.abc import Sequence

from markupsafe import Markup, escape

from retouch.pages.templates import as_json, html
from retouch.pages.viewer.models import ViewerModel
from retouch.pages.viewer.packing import packed_colours, packed_faces, packed_places
from retouch.pages.viewer.still import still_png

PLAIN = "Plain"
"""Name of the switch that takes all colours away."""


def viewer_figure(
    label: str,
    first: ViewerModel,
    second: ViewerModel | None = None,
    *,
    start: str = PLAIN,
) -> Markup:
    """A figure that shows one model, or two under one camera and one lamp with an edge between them.

    Args:
        label: what is shown, for those who do not see it; text of any kind.
        first: left of the edge.
        second: right of the edge.
        start: name of the layer that is shown first.

    Returns:
        HTML for a page that `render_page` makes with `viewer=True`.
    """
    models = [model for model in (first, second) if model]
    return html(
        "viewer_figure.html.j2",
        label=label,
        names=[model.name for model in models],
        layers={layer.name: layer for model in models for layer in model.layers},
        plain=PLAIN,
        start=start,
        still=base64.b64encode(still_png(models[-1], start)).decode(),
        data=_data(models),
    )


def _data(models: Sequence[ViewerModel]) -> Markup:
    """The meshes as JSON that ends no script, whatever their names are."""
    faces = models[0].body.faces
    meshes = [
        {
            "name": model.name,
            **packed_places(model.body.vertices),
            # The second mesh has the faces of the first, if they are the same array.
            "faces": packed_faces(model.body)
            if model is models[0] or model.body.faces is not faces
            else None,
            "layers": [
                {"name": layer.name, "colours": packed_colours(layer.colours)} for layer in model.layers
            ],
        }
        for model in models
    ]
    return as_json(meshes)


def key(*entries: tuple[str, str]) -> Markup:
    """A legend of colours "#1a2b3c" and what each means."""
    return Markup("").join(
        Markup('<span><i style="background:{}"></i>{}</span>').format(colour, escape(text))
        for colour, text in entries
    )
