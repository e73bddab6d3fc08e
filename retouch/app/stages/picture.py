"""Picture: what becomes the relief, how it looks under a lamp, and how rough it feels."""

import base64
from functools import partial
from statistics import fmean

from nicegui import events, ui

from relief.ground.limits import LARGEST_PLATE_MM, LARGEST_RELIEF_MM, SMALLEST_PLATE_MM, SMALLEST_RELIEF_MM
from retouch.app.stages import controls
from retouch.app.stages.elements import CropBox, DropZone, Range, TextureScale
from retouch.app.stages.window import AppWindow, PageStage
from retouch.app.values.document import PictureChoice
from retouch.app.values.findings import CONTACT, PreparedPicture
from retouch.app.values.folders import PICTURES_FOLDER, SUFFIXES
from tactile.quantities import QUANTITIES, ROUGHNESS, Values

RELIEF_ENDS_MM = (0.1, 3.0)
"""Ends of the slider of the relief, mm: what a finger follows. The field beside it takes any."""
SAMPLES = {64: "64", 128: "128", 256: "256"}
TILED = "Make a tile that repeats"


def _places_text(felt: Values) -> str:
    """Where the finger pressed, in words."""
    roughness, share = felt[ROUGHNESS.name], f"{100.0 * fmean(felt[CONTACT]):.0f} %"
    if len(roughness) == 1:
        return f"at one place of the finger, {share} of it in contact"
    ends = f"V {min(roughness):.4f} to {max(roughness):.4f}"
    return f"mean over {len(roughness)} places, {ends}, {share} in contact"


class PictureStage(PageStage):
    """The stage on which a picture becomes a relief."""

    name = "Picture"

    def __init__(self, window: AppWindow) -> None:
        super().__init__(window)
        self._thumbnail: tuple[int, str] = (0, "")

    def build_work(self) -> None:
        """Put the relief and how it feels into the present slot."""
        self._view = self.window.view("relief", "")
        with ui.element("section").classes("strip").props('aria-label="how it feels"'):
            self._figures = {
                name: controls.Number(f"{quantity.label} {quantity.symbol}", quantity.unit)
                for name, quantity in QUANTITIES.items()
            }
            with ui.element("div").classes("grow"):
                self._scale = TextureScale()
                self._places = ui.label().classes("hint")

    def build_side(self) -> None:
        """Put the choice of a picture, and of its shape, into the present slot."""
        with controls.section("Picture"):
            suffixes = SUFFIXES[PICTURES_FOLDER]
            hint = "or drop one anywhere on this page"
            DropZone("Choose a picture", hint, "/app/picture", suffixes).on("kept", self._kept)
            self._textures = controls.Gallery("texture", self.session.choose)
            self._crop = CropBox().on("crop", self._cropped)
            self._notes = ui.label().classes("hint")
            self._warnings = controls.LineTable()
            self._fault = controls.fault_label()
        with controls.section("Shape"):
            self._build_shape()
        with controls.details("What was done"):
            self._lines = controls.LineTable()

    def _build_shape(self) -> None:
        history = self.session.history
        change = history.change_picture
        ui.label("Relief, from the lowest to the highest point")
        slid = partial(change, slid="relief")
        self._slider = Range("relief", "mm", RELIEF_ENDS_MM, 0.05, lambda mm: slid(relief_mm=mm))
        with ui.element("div").classes("pair"):
            ends = SMALLEST_RELIEF_MM, LARGEST_RELIEF_MM
            self._relief = controls.NumberField("Relief, mm", ends, lambda mm: change(relief_mm=mm))
            ends = SMALLEST_PLATE_MM, LARGEST_PLATE_MM
            self._size = controls.NumberField("Size, mm", ends, lambda mm: change(size_mm=mm))
        with ui.element("div").classes("row-of"):
            controls.button("Turn left", partial(self._turn, 90))
            controls.button("Turn right", partial(self._turn, 270))
        self._invert = ui.switch("Dark is high", on_change=lambda e: change(invert=bool(e.value)))
        self._fill = ui.switch("Fill what was not measured", on_change=lambda e: change(fill=bool(e.value)))
        self._tile = ui.switch(TILED, on_change=self._tiled)
        self._samples = controls.select("Samples a side", SAMPLES, self._samples_chosen)
        self._skin = controls.finger_select(lambda name: history.change_feel(skin=name))

    def commands(self) -> list[list[str]]:
        """The command that prepares the picture, without `retouch`."""
        return super().commands()[:1]

    def refresh(self) -> None:
        """Bring its elements to the state of the session."""
        session, numbers = self.session, self.session.numbers
        self.window.light_up(self._view, numbers.relief)
        faults = session.activity.faults
        self._fault.set_text(faults.get("picture") or faults.get("numbers", ""))
        self._skin.set_value(session.document.feel.skin)
        self._show_feel()
        picture = session.document.picture
        if picture is not None:
            self._textures.show(picture.file)
            self._show_picture(picture)
            self._show_shape(picture, numbers.prepared)

    def _show_picture(self, picture: PictureChoice) -> None:
        source, prepared = self.session.numbers.source, self.session.numbers.prepared
        if source is None:
            return
        if self._thumbnail[0] != id(source):
            data = base64.b64encode(source.thumbnail).decode()
            self._thumbnail = (id(source), f"data:image/png;base64,{data}")
        square = None if prepared is None else prepared.square
        crop = list(picture.crop[:3]) if picture.crop else square and list(square)
        tile = prepared and prepared.tile and list(prepared.tile)
        size = {"width": source.width, "height": source.height}
        self._crop.give(picture=self._thumbnail[1], **size, crop=crop, tile=tile)
        name = "" if picture.file in self._textures.names else f"{picture.file}: "
        self._notes.set_text(name + source.notes)

    def _show_shape(self, picture: PictureChoice, prepared: PreparedPicture | None) -> None:
        self._invert.set_value(picture.invert)
        self._fill.set_value(picture.fill)
        already = picture.tile is None and prepared is not None and prepared.relief.repeats == (True, True)
        # Before its value, which a person could not have set then.
        self._tile.set_enabled(not already)
        self._tile.set_value(already or picture.tile is not None)
        self._tile.set_text("A tile that repeats, as its file says" if already else TILED)
        self._relief.show(picture.relief_mm)
        self._size.show(picture.size_mm)
        self._slider.give(value=picture.relief_mm)
        if prepared is not None:
            self._samples.set_value(picture.samples or len(prepared.relief.heights))
            self._lines.show(prepared.lines)
            self._warnings.show(line for line in prepared.lines if line[0] == "warning")

    def _show_feel(self) -> None:
        numbers = self.session.numbers
        felt = numbers.felt or numbers.felt_here
        means = {} if felt is None else {name: fmean(values) for name, values in felt.items()}
        for name, figure in self._figures.items():
            decimals = QUANTITIES[name].decimals
            figure.show(f"{means[name]:.{decimals}f}" if means else None, stale=not numbers.settled)
        self._scale.give(scale=numbers.scale, value=means.get(ROUGHNESS.name))
        self._places.set_text("The finger is getting ready." if felt is None else _places_text(felt))

    async def _kept(self, event: events.GenericEventArguments) -> None:
        await self.session.choose(str(event.args["file"]))

    def _cropped(self, event: events.GenericEventArguments) -> None:
        source, numbers = self.session.numbers.source, [int(one) for one in event.args]
        if source is None or len(numbers) != 4:
            return
        x, y, width, height = numbers
        begins = min(x, y) >= 0 and min(width, height) >= 1
        if begins and x + width <= source.width and y + height <= source.height:
            self.session.history.change_picture(crop=(x, y, width, height))

    def _turn(self, degrees: int) -> None:
        picture = self.session.document.picture
        if picture is not None:
            self.session.history.change_picture(rotate=(picture.rotate + degrees) % 360)

    def _tiled(self, event: events.ValueChangeEventArguments) -> None:
        picture = self.session.document.picture
        if self._tile.enabled and picture is not None and bool(event.value) != (picture.tile is not None):
            self.session.history.change_picture(tile="auto" if event.value else None)

    def _samples_chosen(self, samples: int) -> None:
        relief = self.session.numbers.relief
        if relief is not None and samples != len(relief.heights):
            self.session.history.change_picture(samples=int(samples))
