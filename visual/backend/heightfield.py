"""``<shape type="heightfield">``: a plate of relief as a Mitsuba plugin with differentiable heights.

| parameter | meaning |
|---|---|
| ``filename`` | height map: PNG, TIFF, EXR or NPY (see ``relief.heightmap``) |
| ``heights`` | instead of ``filename``, in scenes made in Python: ``mi.TensorXf`` of shape (rows, cols), mm |
| ``size_mm`` | width of the plate, along x, default 10; the samples are square |
| ``relief_mm`` | height of white above black in a picture whose header has none; without meaning for mm |
| ``halo_rows``, ``halo_cols`` | for a tile: samples of its neighbours on each side (``relief.plate_grid``) |
| nested BSDF | the plate's material |

The plate lies in the plane z = 0, centred on the origin, one scene unit per mm. ``mi.traverse`` shows
``heights``, flat, row by row, mm. A change of ``heights`` moves the vertices; gradients flow from pictures
back to ``heights``. Textures lie on the plate as on Mitsuba's rectangle: u from 0 to 1 along x, v along y.
"""

from collections.abc import Sequence
from functools import cache
from typing import Any

import numpy as np

from relief import heightmap
from relief import plate_grid as grid
from relief.ground.errors import InputError
from relief.ground.limits import PATCH_SIDE_MM
from visual.backend import buffers
from visual.backend.mitsuba import dr, mi

PLUGIN = "heightfield"


@cache
def register() -> None:
    """Make the plugin known to Mitsuba, in the variant set now and in every later one; may be repeated."""
    mi.detail.add_variant_callback(_register_in)
    _register_in(None, mi.variant())


def _register_in(_: str | None, variant: str | None) -> None:
    if variant is not None:
        mi.register_shape(PLUGIN, _plugin_class(variant))


@cache
def _plugin_class(variant: str) -> type:
    """The plugin in one variant, which must be set: each has a base class and array types of its own."""

    class HeightField(mi.Mesh):
        def __init__(self, props: Any) -> None:
            size_mm, samples = _read(props)
            rows, cols = samples.shape
            halo = int(props.get("halo_rows", 0)), int(props.get("halo_cols", 0))
            shape = rows, cols, halo
            props["face_normals"] = True
            # Texture coordinates turn the frames in which materials are sampled: only textures need them.
            textured = _is_textured(props)
            down, across = grid.vertex_shape(*shape)
            counts = down * across, 2 * (down - 1) * (across - 1)
            super().__init__(PLUGIN, *counts, props, has_vertex_texcoords=textured)
            self.rows, self.cols, self.size_mm = rows, cols, size_mm
            self._Float, self._UInt = type(self.vertex_positions_buffer()), type(self.faces_buffer())
            self._flat = self._Float(grid.flat_positions(rows, cols, size_mm, halo))
            self._sample_of_vertex = self._UInt(grid.pad_index(*shape))
            self._z_slots = self._UInt(np.arange(down * across, dtype=np.uint32) * 3 + 2)
            self.heights = self._Float(samples.astype(np.float32).ravel())
            faces = self._UInt(grid.grid_faces(*shape).astype(np.uint32).ravel())
            params = mi.traverse(self)
            if textured:
                params[buffers.TEXCOORDS] = self._Float(grid.texture_coordinates(*shape))
            buffers.write_geometry(params, self._positions(), faces)

        def _positions(self) -> Any:
            heights: Any = self.heights
            expected, samples = self.rows * self.cols, dr.width(heights)
            if samples != expected:
                raise InputError(f"heightfield: heights: {samples} samples given, the plate has {expected}")
            if not dr.all(dr.isfinite(heights)):
                raise InputError("heightfield: heights: some are not finite")
            positions = self._Float(self._flat)
            dr.scatter(positions, dr.gather(self._Float, heights, self._sample_of_vertex), self._z_slots)
            return positions

        def traverse(self, callback: Any) -> None:
            super().traverse(callback)
            callback.put(
                buffers.HEIGHTS, self.heights, mi.ParamFlags.Differentiable | mi.ParamFlags.Discontinuous
            )

        def parameters_changed(self, keys: Sequence[str] = ()) -> None:
            if buffers.HEIGHTS in keys:
                buffers.write_positions(mi.traverse(self), self._positions())
            else:
                super().parameters_changed(keys)

        def to_string(self) -> str:
            return f"HeightField[{self.rows} x {self.cols} samples, size_mm = {self.size_mm}]"

    return HeightField


def _is_textured(props: Any) -> bool:
    """Whether an object in the plate, as its material, varies over the plate or with directions along it."""
    nested = [value for _, value in props.items() if isinstance(value, mi.Object)]
    along = int(mi.BSDFFlags.Anisotropic)
    # Only textures that depend on the place have a transform of texture coordinates.
    return any(key.endswith("to_uv") for value in nested for key in mi.traverse(value).keys()) or any(  # noqa: SIM118
        int(value.flags()) & along for value in nested if isinstance(value, mi.BSDF)
    )


def check_placement(props: Any, where: str) -> None:
    """Raise an InputError that starts with ``where`` if a height field's ``to_world`` moves it."""
    if "to_world" in props and not np.array_equal(np.array(props["to_world"].matrix), np.eye(4)):
        raise InputError(f"{where}: to_world: the plate stays where it is; move lights and cameras instead")


def _read(props: Any) -> tuple[float, np.ndarray]:
    """Side of the plate, mm, and heights (rows, cols), mm, from a plugin's properties."""
    size_mm = float(props.get("size_mm", PATCH_SIDE_MM))
    if not (np.isfinite(size_mm) and size_mm > 0):
        raise InputError(f"heightfield: size_mm: {size_mm} is not a length above 0")
    check_placement(props, PLUGIN)
    relief_mm = float(props["relief_mm"]) if "relief_mm" in props else None
    if "heights" in props:
        return size_mm, heightmap.check_heights(np.asarray(props["heights"], dtype=np.float64), "heightfield")
    if "filename" not in props:
        raise InputError("heightfield: filename: missing")
    resolver: Any = mi.file_resolver
    path = str(resolver().resolve(props["filename"]))
    return size_mm, heightmap.load_height_map(path, default_relief_mm=relief_mm).heights
