"""Scenes: every plugin and parameter with sound and hostile values, nested and referred to, edited bytes."""

from __future__ import annotations

import re
from collections.abc import Mapping
from xml.sax.saxutils import quoteattr

from hypothesis import strategies as st

from tests.fuzz.case import HOSTILE, Case, chance, edited, several_edits
from visual.lights.quadrature import KINDS
from visual.scene_file.bounds import PARAMETERS, plugins

TAGS = {"Shape": "shape", "Sensor": "sensor", "BSDF": "bsdf", "Texture": "texture", "Emitter": "emitter"}
"""Elements of the objects that are added to a scene; each is allowed there with sound parameters."""
PARTS = {
    **TAGS,
    "Film": "film",
    "ReconstructionFilter": "rfilter",
    "Sampler": "sampler",
    "Integrator": "integrator",
}
INSIDE = {
    **{"Shape": ("BSDF", "Emitter"), "Sensor": ("Film", "Sampler"), "Film": ("ReconstructionFilter",)},
    **{"BSDF": ("BSDF", "Texture"), "Texture": ("Texture",), "Emitter": ("Texture",)},
}
NUMBERS = (
    *(
        "0",
        "0.5",
        "1",
        "2",
        "0.1",
        "16",
        "-1",
        "1e-6",
        "1e6",
        "nan",
        "inf",
        "1e300",
        "1e-300",
        "-0.5",
        "1.1",
        "64",
    ),
    *("9" * 400, "8192", "8193", "65537", "", "x", "$x", "0x10", "1e400", "1,5"),
)
QUOTED = re.compile(rb'"[^"<>&]*"')


def number() -> st.SearchStrategy[str]:
    """The text of a number; half of them are harmless."""
    sound = st.sampled_from(("0.5", "1", "0.3", "2"))
    return st.one_of(*(sound,) * 5, st.sampled_from(NUMBERS))


@st.composite
def triples(draw: st.DrawFn) -> str:
    """The text of a colour, a vector or a point."""
    count = draw(st.sampled_from((*(3,) * 12, 1, 2, 4)))
    return ", ".join(draw(number()) for _ in range(count))


@st.composite
def transforms(draw: st.DrawFn) -> str:
    """An element inside a transform."""
    what = draw(st.sampled_from(("scale", "translate", "rotate", "lookat", "matrix")))
    if what == "matrix":
        count = draw(st.sampled_from((16, 16, 9, 3)))
        return f"<matrix value={quoteattr(' '.join(draw(number()) for _ in range(count)))}/>"
    if what == "lookat":
        named = {key: draw(triples()) for key in ("origin", "target", "up")}
        return f"<lookat {' '.join(f'{key}={quoteattr(value)}' for key, value in named.items())}/>"
    angle = f" angle={quoteattr(draw(number()))}" if what == "rotate" else ""
    return f"<{what} x={quoteattr(draw(number()))} z={quoteattr(draw(number()))}{angle}/>"


FITTING = {
    "a whole number": ("integer",),
    "a number": ("float",),
    "a colour": ("rgb", "float", "spectrum"),
    "true or false": ("boolean",),
    "a finite": ("transform",),
    "a point": ("point",),
    "a direction": ("vector",),
}
"""Elements by the begin of the words for what a parameter may be (`visual.scene_file.bounds.Kind`)."""
ELEMENTS = ("float", "integer", "rgb", "string", "vector", "boolean", "spectrum", "transform", "point", "ref")


@st.composite
def parameters(draw: st.DrawFn, name: str, words: str) -> str:
    """An element that gives a parameter a value, mostly of the right type."""
    fitting = next((tags for begin, tags in FITTING.items() if words.startswith(begin)), ("string",))
    tag = draw(st.sampled_from(ELEMENTS if chance(draw, 12) else fitting))
    named = f"name={quoteattr(name)}"
    if tag == "transform":
        return f"<transform {named}>{draw(transforms())}</transform>"
    if tag == "ref":
        return f"<ref {named} id={quoteattr(draw(st.sampled_from(('plate', 'sun', 'own', 'absent'))))}/>"
    if tag in ("rgb", "vector", "point"):
        value = draw(triples())
    elif tag == "spectrum":
        odd = st.sampled_from(("400:0.5, 700:0.6", "400:nan 700:1", "700:1 400:1", "a:b"))
        value = draw(st.one_of(odd, number(), number()))
    elif tag == "boolean":
        value = draw(st.sampled_from(("true", "false", "true", "x")))
    elif tag == "integer":
        value = draw(st.sampled_from(("1", "2", "4", "8")) | st.sampled_from(NUMBERS))
    elif tag == "string":
        listed = words.removeprefix("one of ").split(", ") if words.startswith("one of ") else FILES
        value = draw(st.sampled_from(listed) | st.sampled_from((*listed, "Cu", "bk7", *HOSTILE)))
    else:
        value = draw(number())
    return f"<{tag} {named} value={quoteattr(value)}/>"


FILES = ("picture.png", "sky.exr", "mesh.ply", "plate.exr")


@st.composite
def objects(draw: st.DrawFn, kind: str, depth: int = 0, name: str = "") -> str:
    """An object of a kind, with some of its parameters and objects in it."""
    known = plugins(kind)
    plugin = "absent" if chance(draw, 60) else draw(st.sampled_from(sorted(set(known) - {"heightfield"})))
    bounds = known.get(plugin, {})
    inner = ""
    needed = ["filename"] * ("filename" in bounds and not chance(draw, 12))
    for key in {*needed, *draw(st.lists(st.sampled_from(sorted(bounds) or ["x"]), max_size=3, unique=True))}:
        if bounds and bounds[key].values and depth < 3 and chance(draw, 4):
            inner += draw(objects("Texture", depth + 1, key))
        else:
            inner += draw(parameters(key, bounds[key].words if bounds else ""))
    if chance(draw, 20):
        inner += draw(parameters("x", ""))
    for nested in INSIDE.get(kind, ()):
        if depth < 3 and draw(st.booleans()) and not (nested == "Emitter" and depth):
            inner += draw(objects(nested, depth + 1))
    if kind == "BSDF" and plugin in ("twosided", "blendbsdf"):
        inner += '<bsdf type="diffuse"/>' * draw(st.sampled_from((1, 2)))
    identity = ' id="own"' if chance(draw, 5) else ' id="plate"' if chance(draw, 60) else ""
    named = f" name={quoteattr(name)}" if name else ""
    return f"<{PARTS[kind]} type={quoteattr(plugin)}{identity}{named}>{inner}</{PARTS[kind]}>"


ODDS = (
    *('<default name="x" value="1"/>', '<include filename="scene.xml"/>', '<include filename="more.xml"/>'),
    *('<path value=".."/>', '<ref id="own"/>', '<alias id="plate" as="own"/>', "<null/>", "<x/>"),
    *('<resource filename="scene.xml"/>', "<bsdf type='twosided'>" * 20 + "</bsdf>" * 20),
    '<default name="x" value="$x$x$x$x"/>' * 12,
    '<default name="a0" value="aaaaaaaaaa"/>'
    + "".join(f'<default name="a{i + 1}" value="$a{i}$a{i}"/>' for i in range(30)),
)
"""Elements that parsing itself acts on."""
MORE = b'<scene version="3.9.1"><bsdf type="diffuse" id="own"/></scene>'
MARKS = {kind: re.compile(f"<{tag} .*?</{tag}>".encode(), re.DOTALL) for kind, tag in PARTS.items()}
"""Places of a sound scene where an object of a kind may take the place of the scene's own."""


@st.composite
def scenes(draw: st.DrawFn, base: Mapping[str, bytes], whole: bool) -> Case:
    """A scene around a sound one.

    Args:
        base: A sound scene, with the files that it names.
        whole: Whether the scene is rendered, or explained where the work would be large.
    """
    text = base["scene.xml"]
    extra = "".join(draw(objects(kind)) for kind in draw(st.lists(st.sampled_from(sorted(TAGS)), max_size=2)))
    if chance(draw, 12):
        extra += draw(st.sampled_from(ODDS))
    if draw(st.booleans()):
        kind = draw(
            st.sampled_from(("BSDF", "Film", "Sampler", "Integrator", "Emitter", "ReconstructionFilter"))
        )
        own = draw(objects(kind, 1)).encode()
        text = MARKS[kind].sub(lambda _: own, text, count=1)
    text = text.replace(b"</scene>", extra.encode() + b"</scene>")
    for _ in range(draw(st.sampled_from((*(0,) * 6, 1, 2)))):
        spots = list(QUOTED.finditer(text))
        spot = spots[draw(st.integers(0, 10_000)) % len(spots)]
        words = (*NUMBERS, *HOSTILE, *KINDS, *PARAMETERS["BSDF"], "own", "plate")
        value = draw(st.sampled_from(words))
        text = text[: spot.start()] + quoteattr(value).encode() + text[spot.end() :]
    changes = draw(several_edits(2)) if chance(draw, 3) else []
    files = {**base, "scene.xml": edited(text, changes), "more.xml": MORE}
    if chance(draw, 10):
        name = draw(st.sampled_from(FILES))
        files[name] = edited(files[name], draw(several_edits()))
    if not whole:
        return Case("scenes", files, ["scene.xml"])
    verb = draw(st.sampled_from((("render", "scene.xml", "-o", "out"), ("render", "scene.xml", "--explain"))))
    return Case("scenes", files, [], verb)
