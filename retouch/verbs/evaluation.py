"""Evaluation: how a relief or a solid feels at each place of the finger, and how far a change can go."""

import os
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, Unpack

import numpy as np

from mitsuba_scenes import find_file
from mitsuba_scenes.fingers import DEFAULT_SKIN
from optimize.estimates.change_curves import Reach
from optimize.run_directory.finished_run import holds_run
from optimize.settings.skins import OWN, described_skin, load_skin
from optimize.verification.tilt import warn_of_tilt
from relief.ground.arrays import Array
from relief.ground.errors import InputError, naming
from relief.ground.formats import is_gcode, is_mesh
from relief.ground.formatting import html_table, number, percent
from relief.ground.lazy import LoadedAtFirstUse
from relief.ground.lengths import Lengths, scale_of
from relief.ground.progress import Progress, stage
from relief.patches import Patches
from relief.places import centres_mm, places
from relief.printers import Printer, printer_of
from relief.relief import Relief
from relief.solids.filament.beads import SlicedPart
from relief.solids.files.mesh import Mesh
from relief.surface import Repeats
from retouch.verbs.progress_display import followed
from retouch.verbs.reliefs import Source, refuse, relief_of
from tactile.jnd import SMOOTH_BELOW, jnd_unless_smooth, smooth_clause
from tactile.measures import TouchMeasures, measure_touch
from tactile.model import ModelName
from tactile.quantities import CONTACT_AREA, LARGEST_JND, LIMIT_PERCENT, QUANTITIES, ROUGHNESS, means
from tactile.readouts import READ_OUTS
from tactile.skin import Skin

if TYPE_CHECKING:
    from optimize.verification.solids.mesh_feel import MeshFeel
    from optimize.verification.verification import SurfaceBand
    from relief.solids.export.printed_parts import PrintedPart
    from retouch.verbs import solid_evaluation as solids
    from retouch.verbs.filament.as_sliced import AsSliced
    from retouch.verbs.fingers.own_finger import OwnFinger
    from visual.scene import Scene
else:
    # Solids and G-code take 0.15 s that height maps do not need.
    solids = LoadedAtFirstUse(lambda: import_module("retouch.verbs.solid_evaluation"))


@dataclass(frozen=True, eq=False)
class TouchedPlaces:
    """Places of the finger, and what is felt there.

    Attributes:
        count: number of places, k.
        centres_mm: (k, 2) centres of the patches on a relief, mm down from the first row's and right from the
            first column's outer edge; (k, 3) points of a solid, mm.
        values: (k,) of each quantity by its name, "roughness" and "contact_area_mm2".
    """

    count: int
    centres_mm: Array
    values: Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class Evaluation:
    """How a relief or a solid feels.

    Attributes:
        relief: what was touched.
        touch: what fingers got from it, place by place.
        model: of touch.
        skin: of the finger.
        skin_name: name or file of the skin; "own" if it has none.
        reach: how far the feel can be changed before the pictures visibly change; None if not asked for.
        scene: file of the scene of these pictures.
        files: written to show the feel of a solid.
        printer: whose print was touched; None: what the file holds.
        printed: what the printer makes of a solid.
        as_sliced: what a slicer leaves of a relief, which is then the sliced one; None without a slicer.
        beside: the evaluation of another print of the same part, at the same places; None without one.
        own: finger of one's own shape, whose touch this is; None: the finger of the skin.
        round_finger: what the round finger of the same radii feels at the same places, beside such a finger.
    """

    relief: Relief | Mesh | SlicedPart
    touch: "TouchMeasures | MeshFeel"
    model: ModelName
    skin: Skin
    skin_name: str
    reach: Reach | None = None
    scene: Path | None = None
    files: tuple[Path, ...] = ()
    printer: Printer | None = None
    printed: "PrintedPart | None" = None
    as_sliced: "AsSliced | None" = None
    beside: "Evaluation | None" = None
    own: "OwnFinger | None" = None
    round_finger: TouchMeasures | None = None

    @property
    def name(self) -> str:
        """File of the relief, the solid or the G-code; "heights" for an array."""
        return self.relief.name if isinstance(self.relief, Relief) else str(self.relief.path)

    @property
    def roughness(self) -> float:
        """Mean over the places, no unit."""
        return self.touch.means[ROUGHNESS.name]

    @property
    def contact_area_mm2(self) -> float:
        """Mean over the places, mm²."""
        return self.touch.means[CONTACT_AREA.name]

    @property
    def contact_fraction(self) -> float:
        """Share of the patch in contact, mean over the places."""
        return self.touch.contact_fraction

    @property
    def places(self) -> TouchedPlaces:
        """Where the fingers pressed, and the values there."""
        if not isinstance(self.touch, TouchMeasures):
            centres = np.array([crop.frame.at for crop in self.touch.crops])
        else:
            assert isinstance(self.relief, Relief)
            centres = centres_mm(self.relief.surface, places(self.relief.surface))
        return TouchedPlaces(len(centres), centres, self.touch.values)

    @property
    def patch_mm(self) -> float:
        """Side of the square under a finger, mm; of a round one, that of the patch around its contact."""
        if self.skin.patch_mm is not None:
            return self.skin.patch_mm
        if not isinstance(self.relief, Relief):
            assert not isinstance(self.touch, TouchMeasures)
            return self.touch.crops[0].side_mm
        return Patches(self.relief.surface, places(self.relief.surface)).size_mm

    @property
    def regions(self) -> "dict[str, Evaluation]":
        """The evaluations of a sliced part's regions, such as "top" and "side"; none of other surfaces.

        Beside a finger of one's own there is "round finger".
        """
        if self.round_finger is not None:
            return {"round finger": replace(self, touch=self.round_finger, model="layer", round_finger=None)}
        parts = {} if isinstance(self.touch, TouchMeasures) else self.touch.by_region()
        return {name: replace(self, touch=part) for name, part in parts.items()}

    @property
    def bands(self) -> "Mapping[str, tuple[SurfaceBand, ...]]":
        """Waves of the skin's surface by region of a sliced part; none of other surfaces."""
        bands: Mapping[str, tuple[SurfaceBand, ...]] = getattr(self.touch, "bands", {})
        return bands

    @property
    def readouts(self) -> dict[str, float]:
        """Means of the read-outs over the places, by name; none if not asked for."""
        return means(self.touch.readouts) if isinstance(self.touch, TouchMeasures) else {}

    def _repr_html_(self) -> str:
        """What a notebook shows of this evaluation."""
        shown = (
            self.relief._repr_html_() if isinstance(self.relief, Relief) else html_table({"name": self.name})
        )
        rows = {one.label: f"{number(self.touch.means[name])} {one.unit}" for name, one in QUANTITIES.items()}
        finger = {"contact locations": self.places.count, "finger": self.skin_name, "model": self.model}
        return shown + html_table(rows | finger)

    def jnd_from(self, first: Self) -> float | None:
        """Just-noticeable differences by which this is rougher (+) or smoother (-); None if one is smooth."""
        return jnd_unless_smooth(self.roughness, first.roughness)

    @property
    def numbers(self) -> dict[str, Any]:
        """Means over the places, and their least and largest values if there are several, for JSON."""
        felt = {**self.touch.means, "contact_fraction": self.contact_fraction}
        several = len(self.touch.values[ROUGHNESS.name]) > 1
        return felt | ({"places": self.touch.ends} if several else {})

    def lines(self) -> Iterator[str]:
        """Sentences for a person about a smooth surface, the reach of a relief, and a solid."""
        if self.roughness < SMOOTH_BELOW:
            # Of a sliced part the waves are printed with the regions.
            waves = "" if self.bands else "; retouch compare shows waves of the skin's surface"
            yield f"{self.name}: {smooth_clause(self.roughness)}{waves}."
        if self.reach is not None and self.scene is not None:
            of_mean = f"{percent(self.reach.limit_percent_of_mean)} of the mean picture"
            limit = f"its pictures in {self.scene.stem} change by {of_mean} ({LIMIT_PERCENT:g} % of white)"
            yield f"{self.name} can be made {_ways(self.reach)} before {limit}."
        if isinstance(self.touch, TouchMeasures) and (some := self.touch.subsample) is not None:
            pressed = f"{some.count} of {self.places.count} places were pressed with all their samples"
            error = f"standard error of the mean roughness {number(some.standard_errors[ROUGHNESS.name], 2)}"
            yield f"{self.name}: {pressed}, the others with fewer; {error}."
        if self.as_sliced is not None:
            yield self.as_sliced.line(self.name, self.roughness)
        if not isinstance(self.touch, TouchMeasures):
            if isinstance(self.relief, SlicedPart):
                yield from solids.part_lines(self.relief, self.touch)
            else:
                yield from solids.solid_lines(self.name, self.touch, self.printed)
        if self.files:
            yield f"Roughness in colours: {', '.join(map(str, self.files))}"

    def as_json(self, first: Self | None = None, same_places: bool = False) -> dict[str, Any]:
        """An entry of what `retouch evaluate --json` prints.

        Args:
            first: with `jnd_from_first`, counted from this one.
            same_places: whether both are prints that were pressed at the same places, so that each place of
                them has its own `jnd_from_first`.
        """
        solid = None if isinstance(self.touch, TouchMeasures) else self.touch
        entry = {"texture": self.name, **self.numbers}
        if solid is not None:
            other = first.touch if same_places and first is not None else None
            entry |= solid.details(None if isinstance(other, TouchMeasures) else other)
        if first is not None:
            entry |= {"jnd_from_first": self.jnd_from(first)}
        if self.readouts:
            entry["readouts"] = {
                name: {"value": value, "unit": READ_OUTS[name].unit, "source": READ_OUTS[name].source}
                for name, value in self.readouts.items()
            }
        if self.reach is not None:
            entry |= {"reach": {"scene": str(self.scene), **self.reach.as_json()}}
        if isinstance(self.relief, Relief):
            entry |= {"size_mm": self.relief.width_mm}
            entry |= {} if self.as_sliced is None else {"as_sliced": self.as_sliced.as_json()}
            if self.own is not None:
                one = self.regions["round finger"]
                jnd = {} if first is None else {"jnd_from_first": one.jnd_from(first.regions["round finger"])}
                finger = {"file": str(self.own.file), "square_mm": self.own.square_mm}
                entry |= {"finger": finger, "round_finger": one.numbers | jnd}
        elif isinstance(self.relief, SlicedPart):
            entry |= self.relief.as_json() | {"files": [str(file) for file in self.files]}
            others = first.regions if same_places and first is not None else {}
            entry["regions"] = {
                name: one.numbers
                | {"bands": [_band(band) for band in self.bands[name]]}
                | ({"jnd_from_first": one.jnd_from(others[name])} if others else {})
                for name, one in self.regions.items()
            }
            entry |= {} if self.beside is None else {"beside": self.beside.as_json(self, same_places=True)}
        elif solid is not None:
            entry |= {"size_mm": solid.sides_mm[0], "warnings": list(self.relief.warnings)}
            entry |= {"files": [str(file) for file in self.files]} if self.files else {}
            entry |= {"print": self.printed and self.printed.as_json()}
        of_skin = described_skin(self.skin, self.skin_name)
        printer = self.printer and self.printer.name
        return entry | {"skin": of_skin, "model": self.model, "printer": printer}


def _band(band: "SurfaceBand") -> dict[str, float]:
    """A band of the skin's surface on one solid, for JSON."""
    ends = {"least_mm": band.least_mm, "most_mm": band.most_mm}
    return ends | {"rms_um": band.initial_um, "threshold_um": band.threshold_um}


def _ways(reach: Reach) -> str:
    """A reach in words."""
    ways = []
    for sense, way in (("rougher", reach.rougher), ("smoother", reach.smoother)):
        jnd = f"{number(way.jnd, 2)} JND"
        beyond = way.jnd >= LARGEST_JND or not way.arrived
        ways.append(f"{jnd} or more {sense}" if beyond else f"about {jnd} {sense}")
    return " or ".join(ways)


def evaluate(
    relief: Source | Mesh | SlicedPart,
    *,
    repeats: Repeats | None = None,
    printer: str | Printer | None = None,
    units: str | None = None,
    without_texture: Mesh | str | os.PathLike[str] | None = None,
    on_shape: bool = False,
    beside: SlicedPart | str | os.PathLike[str] | None = None,
    slicer: str | None = None,
    profile: str | os.PathLike[str] | None = None,
    model: ModelName = "layer",
    skin: Skin | str | os.PathLike[str] = DEFAULT_SKIN,
    reach: "Scene | str | os.PathLike[str] | None" = None,
    readouts: bool = False,
    colours: str | os.PathLike[str] | None = None,
    finger: Mesh | str | os.PathLike[str] | None = None,
    quiet: bool | None = None,
    progress: Callable[[Progress], None] | None = None,
    **lengths: Unpack[Lengths],
) -> Evaluation:
    """Press fingers on a relief or a solid, wherever there is room for one, as `retouch evaluate` does.

    Args:
        relief: a `Relief`, heights (rows, cols) in mm, a height map, the name of a bundled one, or the folder
            of a run; or a solid, as a print file (STL, OBJ, PLY, GLB, 3MF, STEP) or of `read_solid`; or the
            beads of a sliced part, as G-code or of `read_gcode`.
        lengths: `size_mm`, `relief_mm`, `height_scale`, `fill` and `level` of a file, as in `Relief.read`;
            `size_mm` also of an array.
        repeats: whether a file or an array is a tile, along both axes, "x" or "y"; None: as the header says.
        printer: name of a printer, or a printer, whose print of the relief or the solid is pressed.
        units: of a print file, as in `read_solid`; or of the heights in a file, in place of `height_scale`.
        without_texture: the solid before its texture, whose own curvature is then known and taken out;
            without it, each patch estimates its own.
        on_shape: press on the texture where it lies, on the solid before its texture, and take out the strain
            under the bare solid, as textures are steered with `touch.curved_x_mm`.
        beside: G-code of another print of the same part, pressed at the same places.
        slicer: program that slices the relief, whose beads are pressed; None: prusa-slicer, if there is a
            `profile`.
        profile: file of the slicer's settings.
        model: of touch.
        skin: of the finger, or its name or file.
        reach: estimate how much rougher and smoother the relief can be made before its pictures in this scene
            change by 2 % of white. The name or the file of a scene, where the relief is put; or a scene, of
            whose own relief the reach then is.
        readouts: take the read-outs beside roughness of a relief, too (`tactile.readouts`).
        colours: folder for the files that show the roughness of a solid in colours.
        finger: skin of one's own shape that presses on a height map, as a print file in `units` or of
            `read_solid`: its lower face touches, its flat top is bonded to the bone; `skin` has its modulus,
            force and receptors.
        quiet, progress: as in `optimize`.

    Raises:
        InputError: what is wrong with the input, in one line.
        ContactError: a contact does not converge.
    """
    name, hand = (OWN, skin) if isinstance(skin, Skin) else (str(skin), load_skin(skin))
    if finger is not None:
        elsewhere = {"reach": reach, "profile": profile, "slicer": slicer, "readouts": readouts}
        refuse("fingers that --skin describes, not for one's own", elsewhere | {"model": model != "layer"})
        if not isinstance(finger, Mesh):
            finger, units = solids.read_solid(finger, units=units), None
    if isinstance(relief, str | os.PathLike) and is_mesh(Path(relief)):
        relief = solids.read_solid(relief, units=units)
    if isinstance(relief, str | os.PathLike) and is_gcode(Path(relief)):
        relief = solids.read_gcode(relief)
    of_reliefs = {**lengths, "repeats": repeats, "reach": reach, "slicer": slicer, "profile": profile}
    of_reliefs |= {"finger": finger, "readouts": readouts}
    shape = None
    if isinstance(relief, Mesh | SlicedPart) and without_texture is not None:
        given = without_texture
        shape = given if isinstance(given, Mesh) else solids.read_solid(given, units=units)
    if isinstance(relief, SlicedPart):
        of_meshes = {"printer": printer, "on_shape": on_shape, "units": without_texture is None and units}
        refuse("height maps and print files; G-code is felt as it is", of_reliefs | of_meshes)
        parts = [relief]
        if beside is not None:
            parts.append(beside if isinstance(beside, SlicedPart) else solids.read_gcode(beside))
        with followed(progress, quiet):
            with naming(relief.path), stage(f"feeling {relief.path.name}"):
                feels = solids.feel_of_beads(parts, hand, model, without_texture=shape)
            files = solids.write_colours(colours, relief, feels[0], name)
            first, *others = (
                Evaluation(part, feel, model, hand, name) for part, feel in zip(parts, feels, strict=True)
            )
            return replace(first, files=files, beside=others[0] if others else None)
    refuse("G-code", {"beside": beside})
    if isinstance(relief, Mesh):
        refuse("height maps; a print file is felt as it is", of_reliefs)
        with followed(progress, quiet):
            if on_shape and without_texture is None:
                raise InputError("on_shape: needs the solid before its texture; state without_texture")
            if on_shape and model == "net":
                raise InputError('on_shape: the net is trained for flat objects; use model "layer"')
            made_by = printer_of(printer)
            feel, printed = solids.press_solid(relief, shape, model, hand, made_by, on_shape)
            files = solids.write_colours(colours, relief, feel, name)
            return Evaluation(relief, feel, model, hand, name, files=files, printer=made_by, printed=printed)
    if not isinstance(relief, str | os.PathLike):
        refuse("files", {"units": units})
    elif units is not None:
        lengths["height_scale"] = scale_of(units, lengths.get("height_scale"))
    of_solids = {"without_texture": without_texture, "colours": colours}
    refuse("print files", of_solids | {"on_shape": on_shape or None})
    felt = relief_of(relief, **lengths, repeats=repeats, printer=printer)
    if isinstance(finger, Mesh):
        from retouch.verbs.fingers.own_finger import own_finger

        # Faults are those of the fingertip, whose file they name.
        with followed(progress, quiet):
            own = own_finger(finger, hand)
            touch, round_finger = own.feel(felt)
        own_shape = Evaluation(felt, touch, "fem", own.skin, OWN, printer=felt.printer, own=own)
        return replace(own_shape, round_finger=round_finger)
    with followed(progress, quiet), naming(felt.name):
        if slicer is not None or profile is not None:
            if profile is None:
                raise InputError(
                    "slicer: needs the file of its settings; state profile", "--slicer: needs --profile"
                )
            refuse("textures that are not sliced", {"reach": reach, "printer": printer, "readouts": readouts})
            from retouch.verbs.filament.as_sliced import as_sliced

            now, touch, left = as_sliced(felt, slicer or "prusa-slicer", profile, hand, model)
            return Evaluation(now, touch, model, hand, name, as_sliced=left)
        touch = measure_touch(felt, hand, model, readouts=tuple(READ_OUTS.values()) if readouts else ())
        if not holds_run(Path(felt.name).parent):
            warn_of_tilt(felt, hand, touch.means[ROUGHNESS.name])
        if reach is None:
            return Evaluation(felt, touch, model, hand, name, printer=felt.printer)
        # Here, because nothing else renders: descents and pictures take 0.15 s to import.
        from optimize.estimates.reach import reach as reach_of
        from visual.scene import Scene, load_scene

        with stage(f"reach of {Path(felt.name).name}"):
            if not isinstance(reach, Scene):
                reach = load_scene(find_file(reach, ".xml"), relief=felt)
            found = reach_of(reach, hand)
            return Evaluation(felt, touch, model, hand, name, found, reach.file, printer=felt.printer)
