"""Numbers: heights and feel of the picture, which follow every change of it."""

import numpy as np

from optimize.estimates.change_curves import Reach
from relief.places import places
from relief.relief import Relief
from retouch.app.computing import drafts, pictures, touch
from retouch.app.computing.worker import Worker
from retouch.app.state.activity import Activity
from retouch.app.state.history import UndoHistory
from retouch.app.state.latest import Latest
from retouch.app.values.document import AppDocument, PictureChoice
from retouch.app.values.findings import Draft, PreparedPicture, Source
from retouch.app.values.folders import textures
from tactile.quantities import Values

PLACES_AT_ONCE = 4
"""Places that are pressed in one go: a fifth of a second, the longest wait of the next change."""


class Numbers:
    """What is known of the picture.

    Attributes:
        opened: the picture that was opened last, as it was found.
        prepared: the relief of the picture; None until known.
        felt_here, felt: values of the quantities at one place of the finger and all over; None until known.
        scale: roughness of the bundled textures, by name.
        reach: how far the feel can change.
        samples: drafts at the samples of that curve.
    """

    def __init__(self, history: UndoHistory, activity: Activity, live: Worker, idle: Worker) -> None:
        self.opened: Source | None = None
        self.prepared: PreparedPicture | None = None
        self.felt_here: Values | None = None
        self.felt: Values | None = None
        self.scale: dict[str, float] = {}
        self._history, self._activity, self._live = history, activity, live
        self._pressing = Latest(activity, "numbers", self._press)
        self._pressed: tuple[PictureChoice, str] | None = None
        self.samples: tuple[Draft, ...] = ()
        self._idle = idle
        self.reach = Latest(activity, "reach", self._reach, stop=idle.close)
        self._scales: dict[str, dict[str, float]] = {}
        history.follow(self._changed)

    @property
    def source(self) -> Source | None:
        """The picture as it was found; None until known."""
        picture = self._history.document.picture
        if self.opened is None or picture is None or self.opened.picture.file != picture.file:
            return None
        return self.opened

    @property
    def relief(self) -> Relief | None:
        """The relief of the picture; None until known."""
        return None if self.prepared is None else self.prepared.relief

    @property
    def settled(self) -> bool:
        """Whether `felt` is of the picture as it is now; while it is not, `felt` may be of the one before."""
        return self._pressed is not None and self._pressed == self._pressing.key

    def _changed(self, before: AppDocument, after: AppDocument) -> None:
        if (before.picture, before.feel.skin) != (after.picture, after.feel.skin):
            self.follow()

    def follow(self, anew: bool = False) -> None:
        """Compute heights and feel of the document.

        Args:
            anew: whether to compute them even if they were computed, or have failed, before.
        """
        picture, skin = self._history.document.picture, self._history.document.feel.skin
        self.forget_reach()
        self.samples = ()
        if anew:
            self._pressing.want(None)
        if picture is not None:
            self._pressing.want((picture, skin), "pressing", topic=picture.file)

    async def _press(self, key: tuple[PictureChoice, str]) -> None:
        picture, skin = key
        self._pressed = None
        if self.source is None:
            source = await self._live(pictures.source, picture.file)
            self._pressing.check()
            self.opened = source
        self.prepared = await self._live(pictures.prepare, picture)
        self._activity.notify()
        relief = self.prepared.relief
        self.felt_here, self.felt = await self._live(touch.felt, relief, skin, touch.middle(relief)), None
        self._activity.notify()
        self.felt = await self._all_over(relief, skin, self.felt_here)
        self._pressed = key
        self._activity.notify()
        await self._textures(skin)

    async def _all_over(self, relief: Relief, skin: str, here: Values) -> Values:
        """Press all over, in parts, so that the next change need not wait."""
        at = places(relief.surface)
        if len(at) == 1:
            return here
        parts = []
        for first in range(0, len(at), PLACES_AT_ONCE):
            self._pressing.check()
            parts.append(await self._live(touch.felt, relief, skin, at[first : first + PLACES_AT_ONCE]))
        self._pressing.check()
        return {name: np.concatenate([part[name] for part in parts]) for name in here}

    async def _textures(self, skin: str) -> None:
        """Press the bundled textures with the finger, one by one for the same reason."""
        scale = self._scales.setdefault(skin, {})
        for name in textures():
            self._pressing.check()
            if name not in scale:
                scale[name] = await self._live(touch.texture_roughness, name, skin)
        self.scale = dict(sorted(scale.items(), key=lambda item: item[1]))

    def want_reach(self) -> None:
        """Compute in the background how far the feel can change, once the picture has been pressed."""
        waiting = self._pressing.busy or "picture" in self._activity.under_way
        if self.relief is not None and self.settled and not waiting:
            key = self.relief, self._history.document.feel.skin
            self.reach.want(key, "estimating how far the feel can change")

    async def _reach(self, key: tuple[Relief, str]) -> Reach:
        reach, self.samples = await self._idle(drafts.reach, *key)
        return reach

    def forget_reach(self) -> None:
        """End the estimate of how far the feel can change: it is of another picture, or in the way."""
        self.reach.want(None)
