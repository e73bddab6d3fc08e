"""The viewer as a part of a page: HTML with the meshes and a still picture, style and script."""

import base64
import json
from collections.abc import Sequence
from functools import cache
from importlib.resources import files

from markupsafe import Markup, escape

from relief.ground.formatting import plain
from retouch.pages.viewer.models import ViewerModel
from retouch.pages.viewer.packing import packed_colours, packed_faces, packed_places
from retouch.pages.viewer.still import still_png

PLAIN = "Plain"
"""Name of the switch that takes all colours away."""

FIGURE = Markup("""\
<figure class="viewer" data-label="{label}">
<div class="stage"><img class="still" src="{still}" alt="{label}">{tags}<span class="scale-bar"></span></div>
<div class="switches">{switches}</div>
{legends}<figcaption><span class="still-note">This picture turns where scripts may run.</span>\
<span class="hint">Drag to turn, shift and drag to move the lamp, two fingers or the wheel to zoom, the \
right button to shift. Keys: arrows, shift and arrows for the lamp, + and −, 0{swipe_key}.</span></figcaption>
<script type="application/json">{data}</script>
</figure>""")
SWIPE = Markup("""\
<span class="tag">{first}</span><span class="tag">{second}</span>\
<label class="swipe"><input type="range" min="0" max="100" value="50" \
aria-label="{first} left of, {second} right of"></label><i></i>""")
BUTTON = Markup('<button type="button"{attributes} aria-pressed="{pressed}">{name}</button>')
GROUP = Markup('<span class="group" role="group" aria-label="{name}">{buttons}</span>')


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
    layers = {layer.name: layer for model in models for layer in model.layers}
    names = [PLAIN, *layers] if layers else []
    groups = [
        GROUP.format(
            name="Lamp and view",
            buttons=_button("Lamp", Markup(' class="lamp"'), False)
            + Markup('<button type="button" class="reset">Reset</button>'),
        ),
        _group("Colours", [(name, "layer", name, name == start) for name in names]),
    ]
    tags = Markup()
    if len(models) == 2:
        tags = SWIPE.format(first=models[0].name, second=models[1].name)
        ways = [(models[0].name, "100"), ("Both", "50"), (models[1].name, "0")]
        groups.append(_group("Shown", [(name, "split", value, value == "50") for name, value in ways]))
    shown = [
        Markup('<div class="key" data-legend="{}"{}>{}</div>\n').format(
            layer.name, "" if layer.name == start else Markup(" hidden"), layer.legend
        )
        for layer in layers.values()
    ]
    return FIGURE.format(
        label=plain(label),
        still=f"data:image/png;base64,{base64.b64encode(still_png(models[-1], start)).decode()}",
        tags=tags,
        switches=Markup().join(groups),
        legends=Markup().join(shown),
        swipe_key="; B shows one, then the other" if len(models) == 2 else "",
        data=_data(models),
    )


def _button(name: str, attributes: Markup, pressed: bool) -> Markup:
    return BUTTON.format(name=name, attributes=attributes, pressed="true" if pressed else "false")


def _group(name: str, buttons: Sequence[tuple[str, str, str, bool]]) -> Markup:
    """Buttons of which one is pressed: name, what it sets, to which value, whether it is set; or nothing."""
    if not buttons:
        return Markup()
    parts = [
        _button(text, Markup(' data-{}="{}"').format(key, value), pressed)
        for text, key, value, pressed in buttons
    ]
    return GROUP.format(name=name, buttons=Markup().join(parts))


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
    return Markup(json.dumps(meshes, separators=(",", ":")).replace("<", r"\u003c"))


def key(*entries: tuple[str, str]) -> Markup:
    """A legend of colours "#1a2b3c" and what each means."""
    return Markup("").join(
        Markup('<span><i style="background:{}"></i>{}</span>').format(colour, escape(text))
        for colour, text in entries
    )


@cache
def asset(name: str) -> str:
    """The text of `viewer.js` or `viewer.css`."""
    return files("retouch.pages.viewer").joinpath(name).read_text(encoding="utf-8")
