"""Roughness as colours on a mesh: a GLB with a colour at each vertex, a picture, and a page to turn it on."""

import tempfile
from pathlib import Path

import numpy as np
from PIL import Image, ImageDraw, ImageFont
from scipy.spatial import cKDTree

from optimize.verification.solids.mesh_feel import MeshFeel
from relief.ground.arrays import Array
from relief.ground.files import partial_file
from relief.ground.progress import stage
from relief.ground.srgb import linear_rgb, srgb
from relief.solids.body import Body, Part
from relief.solids.export.parts import write_parts
from relief.solids.meshes.mesh_places import vertex_normals
from retouch.pages.colour_maps import NO_CONTACT, VIRIDIS
from retouch.pages.objects.feel_page import write_feel_page
from tactile.jnd import ROUGHNESS_JND, jnd_unless_smooth
from tactile.quantities import ROUGHNESS
from visual.backend.variants import load_mitsuba

NEIGHBOURS, WIDTH_MM = 8, 2.5
"""Places whose roughness goes into the colour of a vertex, and the width of their weights, mm."""
FARTHEST_MM = 5.0
"""Distance from the next place beyond which a vertex is grey, mm: half a finger's patch."""
FACING = 0.1
"""Least cosine between the normal of a vertex and the axis of the place next to it; others are grey."""
VIEWS = ((-0.6, -1.0, 0.9), (0.9, -0.7, 0.5))
"""Directions from the object to the cameras."""
VIEW_PIXELS, SAMPLES = 640, 32
MARGIN_PIXELS, LEAST_PIXELS = 24, 300
"""White around the object in the picture, and the least height of the picture, which the bar needs."""
BAR_PIXELS = 150


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
    colours[~reached] = np.array(NO_CONTACT) / 255.0
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
    solid = write_parts(folder / f"{stem}-roughness.glb", [Part(stem, feel.body, colours=colours)])
    views = [_view(feel.body, colours, np.array(direction)) for direction in VIEWS]
    picture = _with_legend(views, ends, feel.means[ROUGHNESS.name], skin)
    with partial_file(folder / f"{stem}-roughness.png") as path:
        picture.save(path, optimize=True)
    page = write_feel_page(folder / f"{stem}-roughness.html", stem, feel, colours, ends, skin)
    return solid, folder / f"{stem}-roughness.png", page


def _view(body: Body, colours: Array, direction: Array) -> Array:
    """(rows, cols, 3) picture in sRGB, 0 to 255, of a body seen from a direction."""
    mi = load_mitsuba(colour=True)
    low, high = body.vertices.min(axis=0), body.vertices.max(axis=0)
    centre, radius = (low + high) / 2, 0.5 * float(np.linalg.norm(high - low))
    direction = direction / np.linalg.norm(direction)
    up = np.array([0.0, 0.0, 1.0])
    right = np.cross(up, direction)
    right /= np.linalg.norm(right)
    # From above, to the left of the camera.
    key = direction + 0.9 * np.cross(direction, right) - 0.8 * right
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "mesh.ply"
        path.write_bytes(_ply(body, colours))
        rotation = mi.ScalarTransform4f
        scene = mi.load_dict(
            {
                "type": "scene",
                "integrator": {"type": "path", "max_depth": 4, "hide_emitters": True},
                "sensor": {
                    "type": "perspective",
                    "fov": 24.0,
                    "to_world": rotation().look_at(
                        origin=(centre + direction * radius / np.sin(np.radians(11.5))).tolist(),
                        target=centre.tolist(),
                        up=up.tolist(),
                    ),
                    "film": {
                        "type": "hdrfilm",
                        "width": VIEW_PIXELS,
                        "height": VIEW_PIXELS,
                        "pixel_format": "rgba",
                        "rfilter": {"type": "gaussian"},
                    },
                    "sampler": {"type": "independent", "sample_count": SAMPLES},
                },
                "key": {
                    "type": "directional",
                    "direction": (-key).tolist(),
                    "irradiance": {"type": "rgb", "value": 2.6},
                },
                "sky": {"type": "constant", "radiance": {"type": "rgb", "value": 0.6}},
                "body": {
                    "type": "ply",
                    "filename": str(path),
                    "face_normals": True,
                    "bsdf": {
                        "type": "twosided",
                        "bsdf": {
                            "type": "diffuse",
                            "reflectance": {"type": "mesh_attribute", "name": "vertex_color"},
                        },
                    },
                },
            }
        )
        pixels = np.array(mi.render(scene, seed=1), dtype=np.float64)
    alpha = np.clip(pixels[..., 3:], 0.0, 1.0)
    return np.asarray(255.0 * (srgb(pixels[..., :3], 1.0) * alpha + 1.0 - alpha))


def _ply(body: Body, colours: Array) -> bytes:
    """A binary PLY file with linear colours, as Mitsuba reads it."""
    vertices = np.zeros(len(body.vertices), np.dtype([("at", "<f4", 3), ("rgb", "<f4", 3)]))
    vertices["at"], vertices["rgb"] = body.vertices, linear_rgb(colours)
    faces = np.zeros(len(body.faces), np.dtype([("count", "u1"), ("vertices", "<i4", 3)]))
    faces["count"], faces["vertices"] = 3, body.faces
    names = "".join(f"property float {name}\n" for name in ("x", "y", "z", "r", "g", "b"))
    head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(vertices)}\n{names}"
    head += f"element face {len(faces)}\nproperty list uchar int vertex_indices\nend_header\n"
    return head.encode() + vertices.tobytes() + faces.tobytes()


def _with_legend(views: list[Array], ends: tuple[float, float], mean: float, skin: str) -> Image.Image:
    """The views side by side without most of their white, and a bar of the colours with numbers.

    Args:
        views: Pictures (rows, cols, 3) in sRGB, 0 to 255, of the same shape.
        ends: Roughness of the ends of the colours.
        mean: Roughness from which the bar counts just-noticeable differences.
        skin: Its name.
    """
    seen = np.stack(views).min(axis=3) < 250.0
    rows = _span(seen.any(axis=(0, 2)), LEAST_PIXELS)
    views = [view[rows, _span(part.any(axis=0), 0)] for view, part in zip(views, seen, strict=True)]
    high, width = views[0].shape[0], sum(view.shape[1] for view in views)
    picture = Image.new("RGB", (width + BAR_PIXELS, high), "white")
    left = 0
    for view in views:
        picture.paste(Image.fromarray(np.clip(view, 0, 255).astype(np.uint8)), (left, 0))
        left += view.shape[1]
    left, top, bottom = width + 8, 76, high - 40
    bar = np.repeat(VIRIDIS[np.linspace(255, 0, bottom - top).astype(np.int64)][:, None], 22, axis=1)
    picture.paste(Image.fromarray(bar), (left, top))
    draw, font = ImageDraw.Draw(picture), ImageFont.load_default(15)
    draw.text((left, top - 66), "roughness", "black", font)
    draw.text((left, top - 48), f"skin {skin}", "black", font)
    for value in (ends[0], mean, ends[1]):
        at = bottom - (value - ends[0]) / max(ends[1] - ends[0], 1e-12) * (bottom - top)
        draw.line((left + 22, at, left + 26, at), "black")
        draw.text((left + 30, at - 18), f"{value:.3g}", "black", font)
        jnd = jnd_unless_smooth(value, mean)
        apart = "mean" if value == mean else "smooth" if jnd is None else f"{jnd:+.1f} JND"
        draw.text((left + 30, at), apart, "black", font)
    return picture


def _span(seen: Array, least: int) -> slice:
    """From the first to the last pixel (n,) that is seen, with a margin, and at least so many pixels."""
    numbers = np.flatnonzero(seen)
    first, last = (int(numbers[0]), int(numbers[-1]) + 1) if len(numbers) else (0, len(seen))
    more = max(MARGIN_PIXELS, (least - (last - first) + 1) // 2)
    return slice(max(first - more, 0), min(last + more, len(seen)))
