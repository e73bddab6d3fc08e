"""Drafts: what the feel that is chosen would make of the picture, shown while a person chooses."""

import math

from relief.relief import Relief
from retouch.app.computing import drafts
from retouch.app.computing.worker import Worker
from retouch.app.state.activity import Activity
from retouch.app.state.history import UndoHistory
from retouch.app.state.latest import Latest
from retouch.app.state.numbers import Numbers
from retouch.app.values.document import FEEL_OF, JND, Wish, goals
from retouch.app.values.findings import Draft
from tactile.jnd import ROUGHNESS_JND
from tactile.quantities import ROUGHNESS

STEPS = 12
"""Most steps towards a wish: most bundled textures take two or three at 2 JND, knit at -2 JND all."""
CLOSER = 0.95
"""Factor by which a step at the goal has to lower the change of the pictures for another one to follow."""
MOST_KEPT = 48
"""Most drafts that are kept; one of 256 x 256 samples takes 2 MB."""


class Drafts:
    """Drafts of the picture and the finger that are chosen; others are dropped, and no file holds any.

    The latest wish is drafted, from the nearest result that is known; each step is shown. An error is the
    fault of the subject "draft".
    """

    def __init__(self, history: UndoHistory, activity: Activity, numbers: Numbers, slow: Worker) -> None:
        self._history, self._activity, self._numbers, self._slow = history, activity, numbers, slow
        self._of = self._now()
        self._made: dict[Wish, Draft] = {}
        self._finished: set[Wish] = set()
        self._drafting = Latest[tuple[Relief, Wish], None](activity, "draft", self._draft)
        self._warming = Latest[str, None](activity, "warm", lambda skin: slow(drafts.warm, skin))

    @property
    def busy(self) -> bool:
        """Whether a draft is being made."""
        return self._drafting.busy

    def warm(self) -> None:
        """Load the models of drafts once the first picture has been pressed and nothing is under way."""
        if self._warming.key is None and self._numbers.settled and self._activity.idle:
            self._warming.want(self._history.document.feel.skin, "loading the models of drafts")

    def want(self) -> None:
        """Ask for a draft of the feel that is chosen, once the picture has been pressed."""
        relief, wish = self._numbers.relief, self._history.document.feel.wish()
        if self._of != self._now():
            self._of, self._made, self._finished = self._now(), {}, set()
        if relief is None or wish is None or wish in self._finished or not self._numbers.settled:
            self._drafting.want(None)
        else:
            self._drafting.want((relief, wish), "drafting")

    def shown(self) -> tuple[Draft | None, bool]:
        """The draft of the feel that is chosen, or the nearest known; and whether it is of this very feel."""
        wish = self._history.document.feel.wish()
        if wish is None or self._of != self._now():
            return None, False
        return (self._made[wish], True) if wish in self._made else (self._nearest(wish), False)

    def _now(self) -> tuple[object, ...]:
        """What drafts are of: picture, its relief, and finger."""
        document = self._history.document
        return self._numbers.relief, document.picture, document.feel.skin

    async def _draft(self, key: tuple[Relief, Wish]) -> None:
        (relief, wish), of = key, self._of
        own = going_on = self._made.get(wish)
        for _ in range(STEPS):
            start = going_on or self._nearest(wish, start=True)
            going_on = await self._slow(drafts.step, relief, wish, start, going_on is not None)
            if of != self._now():
                return
            before, own = own, self._better(wish, own, going_on)
            if before is not None and before.met and own.change_percent > CLOSER * before.change_percent:
                break
            self._activity.notify()
            self._drafting.check()
        self._finished.add(wish)

    def _better(self, wish: Wish, one: Draft | None, other: Draft) -> Draft:
        """The draft that reaches its goal, which is kept; of two such the closer look; else the nearer."""
        if one is not None and _rank(one) <= _rank(other):
            return one
        self._made[wish] = other
        if len(self._made) > MOST_KEPT:
            oldest = next(iter(self._made))
            del self._made[oldest]
            self._finished.discard(oldest)
        return other

    def _nearest(self, wish: Wish, start: bool = False) -> Draft | None:
        """The known result whose feel is nearest to a wish; None if that is the original, or unknown.

        Args:
            start: whether only results between the original and the wish count: the pictures of a draft that
                comes back from beyond change up to 1.7 times as much.
        """
        name, ratio = _quantity(wish.goal), self._ratio(wish)
        if ratio is None:
            return None
        made = [draft for other, draft in self._made.items() if _quantity(other.goal) == name]
        known = [*self._numbers.samples, *made] if name == ROUGHNESS.name else made
        wanted = math.log(ratio)
        ways: list[tuple[float, Draft | None]] = [(0.0, None)]
        ways += [(math.log(draft.ratios[name]), draft) for draft in known if name in draft.ratios]
        fit = [way for way in ways if not start or 0.0 <= way[0] * wanted <= wanted * wanted]
        return min(fit, key=lambda way: abs(way[0] - wanted))[1]

    def _ratio(self, wish: Wish) -> float | None:
        """What a wish makes of its quantity, in units of the original's; None if that is not known here."""
        if wish.goal == FEEL_OF:
            other, felt = self._numbers.scale.get(str(wish.value)), self._numbers.felt
            return None if other is None or felt is None else other / float(felt[ROUGHNESS.name].mean())
        return ROUGHNESS_JND ** float(wish.value) if wish.goal == JND else float(wish.value)


def _quantity(goal: str) -> str:
    """Name of the quantity that a goal changes."""
    return ROUGHNESS.name if goal == FEEL_OF else goals()[goal].name


def _rank(draft: Draft) -> tuple[bool, float]:
    return not draft.met, draft.change_percent if draft.met else draft.relative_error
