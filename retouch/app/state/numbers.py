"""Numbers: heights and feel of the picture, which follow every change of it."""

from retouch.app.computing import pictures, touch
from retouch.app.computing.worker import Superseded, Worker
from retouch.app.state.activity import Activity
from retouch.app.state.history import History
from retouch.app.values.document import Document, Picture
from retouch.app.values.findings import FeltPlaces, Reachable, Shape, Source
from retouch.app.values.folders import textures

PLACES_AT_ONCE = 4
"""Places that are pressed in one go: a fifth of a second, the longest wait of the next change."""


class Numbers:
    """What is known of the picture.

    Attributes:
        source, shape, felt_here, felt: of the picture: as it was found, its heights, and how they feel at one
            place and all over; None until known.
        scale: roughness of the bundled textures, by name.
        reach: how far the feel can change; None until known.
        settled: whether `felt` is of the picture as it is now; while it is not, `felt` may be that of before.
    """

    def __init__(self, history: History, activity: Activity, live: Worker, idle: Worker) -> None:
        self.source: Source | None = None
        self.shape: Shape | None = None
        self.felt_here: FeltPlaces | None = None
        self.felt: FeltPlaces | None = None
        self.scale: dict[str, float] = {}
        self.reach: Reachable | None = None
        self._history, self._activity, self._live, self._idle = history, activity, live, idle
        self._opened: tuple[str, Source | None] = ("", None)
        self._following = False
        self._again = False
        self.settled = False
        self._scale_of: str | None = None
        self._scale_found: dict[str, float] = {}
        self._reach_of: tuple[Picture | None, str] | None = None
        history.follow(self._changed)

    def _changed(self, before: Document, after: Document) -> None:
        one, other = before.picture, after.picture
        if other is not None and (one is None or one.file != other.file):
            file, source = self._opened
            self.source = source if file == other.file else None
        if one != other or before.feel.skin != after.feel.skin:
            self.follow()

    async def picture_of(self, file: str) -> Picture:
        """A picture, or a bundled texture by its name, with the lengths that it tells. Raises InputError."""
        source = await self._live(pictures.source, file)
        self._opened = (file, source)
        return Picture(file, relief_mm=source.relief_mm, size_mm=source.size_mm)

    def follow(self) -> None:
        """Compute heights and feel of the document anew; a computation under way begins again when it can."""
        self._again = True
        self.settled = False
        self.reach = None
        self._activity.faults.pop("reach", None)
        self._activity.under_way["numbers"] = "pressing"
        if not self._following:
            self._following = True
            self._activity.in_background(self._follow())

    async def _follow(self) -> None:
        try:
            while self._again:
                self._again = False
                document = self._history.document
                if document.picture is None:
                    continue
                work = self._compute(document.picture, document.feel.skin)
                await self._activity.guarded("numbers", work)
        finally:
            self._following = False
            self._activity.under_way.pop("numbers", None)
        self._activity.tell()

    async def _compute(self, picture: Picture, skin: str) -> None:
        if self.source is None:
            source = await self._live(pictures.source, picture.file)
            if self._again:
                return
            self.source = source
        shape = self.shape = await self._live(pictures.shape, picture)
        self._activity.tell()
        self.felt_here, self.felt = await self._live(touch.felt, shape, skin), None
        self._activity.tell()
        await self._all_over(shape, skin, self.felt_here)
        await self._textures(skin)

    async def _all_over(self, shape: Shape, skin: str, here: FeltPlaces) -> None:
        """Press all over, in parts, so that the next change need not wait."""
        count = await self._live(touch.count_places, shape)
        felt = here if count == 1 else FeltPlaces()
        for first in range(0, count if count > 1 else 0, PLACES_AT_ONCE):
            if self._again:
                return
            felt += await self._live(touch.felt, shape, skin, slice(first, first + PLACES_AT_ONCE))
        if not self._again:
            self.felt, self.settled = felt, True
            self._activity.tell()

    async def _textures(self, skin: str) -> None:
        """Press the bundled textures with the finger, one by one for the same reason."""
        if self._scale_of != skin:
            self._scale_of, self._scale_found = skin, {}
        for name in textures():
            if self._again:
                return
            if name not in self._scale_found:
                self._scale_found[name] = await self._live(touch.texture_roughness, name, skin)
        self.scale = dict(sorted(self._scale_found.items(), key=lambda item: item[1]))

    def want_reach(self) -> None:
        """Compute in the background how far the feel can change, if that is not known."""
        document, under_way = self._history.document, self._activity.under_way
        asked = (document.picture, document.feel.skin)
        unready = not self.settled or under_way.keys() & {"numbers", "picture"}
        if self.shape is None or unready or self._reach_of == asked:
            return
        self.forget_reach()
        self._reach_of = asked
        under_way["reach"] = "estimating how far the feel can change"
        self._activity.in_background(self._activity.guarded("reach", self._estimate(self.shape, asked[1])))
        self._activity.tell()

    async def _estimate(self, shape: Shape, skin: str) -> None:
        asked = self._reach_of
        try:
            reach = await self._idle(touch.reach, shape, skin)
        except Superseded:
            return
        finally:
            if self._reach_of == asked:
                self._activity.under_way.pop("reach", None)
                self._activity.tell()
        if self._reach_of == asked:
            self.reach = reach
        self._activity.tell()

    def forget_reach(self) -> None:
        """End the estimate of how far the feel can change: it is of another picture, or in the way."""
        self.reach = self._reach_of = None
        if self._activity.under_way.pop("reach", None):
            self._idle.close()
