"""A finger of one's own: the skin that people's answers propose, as JSON and in words."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True)
class FittedKey:
    """A key of a skin that was fitted, with the ends of its 95 % interval; None where an end is open.

    Attributes:
        key: of the skin.
        value, low, high: MPa or mm.
        source: what the key was fitted to.
    """

    key: str
    value: float
    low: float | None
    high: float | None
    source: str = "answers"

    @property
    def open(self) -> bool:
        """Whether an end of the interval is."""
        return self.low is None or self.high is None

    def ends(self, missing: str) -> list[str]:
        """Both ends as text; `missing` where an end is open."""
        return [missing if end is None else f"{end:.3g}" for end in (self.low, self.high)]

    def as_json(self) -> dict[str, Any]:
        """The key as `answers.json` has it."""
        return {"key": self.key, "value": self.value, "low": self.low, "high": self.high, "from": self.source}


@dataclass(frozen=True)
class HeldOut:
    """How well a finger that is fitted to all textures but one predicts the answers to that one.

    Attributes:
        own: mean logarithm of the likelihood of such an answer by these fingers.
        start: the same by the finger that they start from, with its JND fitted likewise.
        textures: their number.
    """

    own: float
    start: float
    textures: int


@dataclass(frozen=True)
class Proposal:
    """A finger that answers propose.

    Attributes:
        fitted: keys of the skin.
        skin: all of its values.
        answers, people, measurements: that were fitted.
        start: name of the skin that the fit starts from.
        held_out: None for one texture.
    """

    fitted: tuple[FittedKey, ...]
    skin: Mapping[str, Any]
    answers: int
    people: int
    measurements: int
    start: str
    held_out: HeldOut | None

    @property
    def summary(self) -> str:
        """The proposal in words."""
        values = []
        for one in self.fitted:
            unit, (low, high) = "MPa" if one.key.endswith("_mpa") else "mm", one.ends("?")
            values.append(f"{one.key} {one.value:.3g} {unit} ({low} to {high})")
        text = f"a finger of {self.answers} answers, from {self.start}: {', '.join(values)}"
        if any(one.open for one in self.fitted):
            text += "; a question mark is an end that these answers do not tell"
        if (held := self.held_out) is None:
            return f"{text}; one texture is fitted and not predicted"
        better = "better" if held.own > held.start else "no better"
        return (
            f"{text}; textures left out of the fit are predicted {better} than by {self.start} "
            f"(log-likelihood of an answer {held.own:.3f}, {held.start:.3f})"
        )

    def as_json(self) -> dict[str, Any]:
        """The proposal as `answers.json` has it."""
        return {
            "fitted": [one.as_json() for one in self.fitted],
            "skin": dict(self.skin),
            "answers": self.answers,
            "people": self.people,
            "measurements": self.measurements,
            "from": self.start,
            "held_out": None if self.held_out is None else asdict(self.held_out),
            "summary": self.summary,
        }
