"""Picture: what becomes the relief, how it looks under a lamp, and how rough it feels."""

import base64
from functools import partial
from statistics import fmean
from typing import Any

from nicegui import events, ui

from mitsuba_scenes.fingers import bundled_skins
from relief.ground.limits import LARGEST_PLATE_MM, LARGEST_RELIEF_MM, SMALLEST_PLATE_MM, SMALLEST_RELIEF_MM
from retouch.app.stages.controls import Number, NumberField, Told, button, section
from retouch.app.stages.elements import CropBox, DropZone, Range, ReliefView, TextureScale
from retouch.app.stages.window import Window
from retouch.app.values.document import Picture
from retouch.app.values.findings import FeltPlaces
from retouch.app.values.folders import PICTURES_FOLDER, SUFFIXES, textures

RELIEF_ENDS_MM = (0.1, 3.0)
"""Ends of the slider of the relief, mm: what a finger follows. The field beside it takes any."""
SAMPLES = {64: "64", 128: "128", 256: "256"}
TILED = "Make a tile that repeats"


def _places_told(felt: FeltPlaces) -> str:
    """Where the finger pressed, in words."""
    share = f"{100.0 * fmean(felt.contact_fraction):.0f} %"
    if len(felt.roughness) == 1:
        return f"at one place of the finger, {share} of it in contact"
    ends = f"V {min(felt.roughness):.4f} to {max(felt.roughness):.4f}"
    return f"mean over {len(felt.roughness)} places, {ends}, {share} in contact"


class PictureStage:
    """The stage on which a picture becomes a relief."""

    name = "Picture"

    def __init__(self, window: Window) -> None:
        self.window, self.session = window, window.session
        self._thumbnail: tuple[int, str] = (0, "")

    def build(self) -> None:
        """Put its elements into the present slot."""
        with ui.element("div").classes("stage"):
            with ui.element("div").classes("work"):
                self._view = ReliefView(("relief", ""))
                self._view.on("lamp", self.window.lamp_moved).on("tilt", self.window.tilted)
                self._feeling()
            with ui.element("aside").classes("side"):
                self._choosing()
                self._shaping()
                self._telling()

    def _choosing(self) -> None:
        with section("Picture"):
            DropZone(
                "Choose a picture",
                "or drop one anywhere on this page",
                "/app/picture",
                SUFFIXES[PICTURES_FOLDER],
            ).on("kept", self._kept)
            with ui.element("div").classes("gallery"):
                self._choices = {name: self._choice(name) for name in textures()}
            self._crop = CropBox().on("crop", self._cropped)
            self._notes = ui.label().classes("hint")
            self._warnings = Told()
            self._fault = ui.label().classes("fault").props('role="alert"')

    def _choice(self, name: str) -> Any:
        choice = ui.element("button").props(f'type="button" title="{name}" aria-label="texture {name}"')
        with choice.on("click", partial(self.session.choose, name)):
            ui.element("img").props(f'src="/app/textures/{name}.png" alt="" width="44" height="44"')
        return choice

    def _shaping(self) -> None:
        change = self.session.history.change_picture
        with section("Shape"):
            ui.label("Relief, from the lowest to the highest point")
            self._slider = Range("relief", RELIEF_ENDS_MM, 0.05, "mm").on("slid", self._slid)
            with ui.element("div").classes("pair"):
                ends = SMALLEST_RELIEF_MM, LARGEST_RELIEF_MM
                self._relief = NumberField("Relief, mm", *ends, lambda value: change(relief_mm=value))
                ends = SMALLEST_PLATE_MM, LARGEST_PLATE_MM
                self._size = NumberField("Size, mm", *ends, lambda value: change(size_mm=value))
            with ui.element("div").classes("row-of"):
                button("Turn left", partial(self._turn, 90))
                button("Turn right", partial(self._turn, 270))
            self._invert = ui.switch("Dark is high", on_change=lambda e: change(invert=bool(e.value)))
            self._tile = ui.switch(TILED, on_change=self._tiled)
            self._samples = ui.select(SAMPLES, label="Samples a side", on_change=self._sampled)
            fingers = list(bundled_skins())
            self._skin = ui.select(fingers, label="Finger", on_change=self._other_finger)
            for field in (self._samples, self._skin):
                field.props("outlined dense options-dense")

    def _feeling(self) -> None:
        with ui.element("section").classes("strip").props('aria-label="how it feels"'):
            self._roughness = Number("roughness V")
            self._area = Number("contact area", "mm²")
            with ui.element("div").classes("grow"):
                self._scale = TextureScale()
                self._places = ui.label().classes("hint")

    def _telling(self) -> None:
        with ui.element("details").classes("more"):
            with ui.element("summary"):
                ui.label("What was done")
            self._lines = Told()

    def commands(self) -> list[list[str]]:
        """The commands that do the same, without `retouch`."""
        return self.session.running.commands()[:1]

    def refresh(self) -> None:
        """Bring its elements to the state of the session."""
        session, picture = self.session, self.session.document.picture
        self._view.give(
            before=self.window.shapes.address(session.numbers.shape),
            lamp=self.window.lamp,
            tilt=self.window.tilt,
        )
        self._fault.set_text(
            session.activity.faults.get("picture") or session.activity.faults.get("numbers", "")
        )
        self._skin.set_value(session.document.feel.skin)
        self._show_numbers()
        if picture is None:
            return
        for name, choice in self._choices.items():
            choice.props(f'aria-pressed="{"true" if name == picture.file else "false"}"')
        self._show_picture(picture)
        self._invert.set_value(picture.invert)
        shape = session.numbers.shape
        already = picture.tile is None and shape is not None and shape.repeats == (True, True)
        # Before its value, which a person could not have set then.
        self._tile.set_enabled(not already)
        self._tile.set_value(already or picture.tile is not None)
        self._tile.set_text("A tile that repeats, as its file says" if already else TILED)
        self._relief.show(picture.relief_mm)
        self._size.show(picture.size_mm)
        self._slider.give(value=picture.relief_mm)
        if session.numbers.shape is not None:
            self._samples.set_value(picture.samples or len(session.numbers.shape.heights))
            lines = session.numbers.shape.lines
            self._lines.show(lines)
            self._warnings.show(line for line in lines if line[0] == "warning")

    def _show_picture(self, picture: Picture) -> None:
        source = self.session.numbers.source
        if source is None:
            return
        if self._thumbnail[0] != id(source):
            data = base64.b64encode(source.thumbnail).decode()
            self._thumbnail = (id(source), f"data:image/png;base64,{data}")
        square = self.session.numbers.shape.square if self.session.numbers.shape else (0, 0, 0)
        crop = list(picture.crop[:3]) if picture.crop else (list(square) if square[2] else None)
        address = self._thumbnail[1]
        self._crop.give(picture=address, width=source.width, height=source.height, crop=crop)
        name = "" if picture.file in self._choices else f"{picture.file}: "
        self._notes.set_text(name + source.notes)

    def _show_numbers(self) -> None:
        session = self.session
        felt = session.numbers.felt or session.numbers.felt_here
        stale = not session.numbers.settled
        for figure, value in (
            (self._roughness, None if felt is None else f"{fmean(felt.roughness):.4f}"),
            (self._area, None if felt is None else f"{fmean(felt.contact_area_mm2):.1f}"),
        ):
            figure.show(value, stale)
        self._scale.give(scale=session.numbers.scale, value=None if felt is None else fmean(felt.roughness))
        self._places.set_text(_places_told(felt) if felt is not None else "The finger is getting ready.")

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

    def _slid(self, event: events.GenericEventArguments) -> None:
        low, high = RELIEF_ENDS_MM
        if low <= float(event.args) <= high:
            self.session.history.change_picture(slid="relief", relief_mm=round(float(event.args), 3))

    def _sampled(self, event: events.ValueChangeEventArguments) -> None:
        shape = self.session.numbers.shape
        if event.value and shape is not None and event.value != len(shape.heights):
            self.session.history.change_picture(samples=int(event.value))

    def _other_finger(self, event: events.ValueChangeEventArguments) -> None:
        if event.value and event.value != self.session.document.feel.skin:
            self.session.history.change_feel(skin=str(event.value))
