"""Numbers of a comparison of two reliefs, as JSON and as lines for a person."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any

from optimize.verification.section import EachUnder, Section
from optimize.verification.verification import Fingers, Measured, PictureChange, Spread, SurfaceBand, Values
from relief.ground.formatting import number, percent
from retouch.pages import sentences
from tactile.quantities import GAPS_COUNT, QUANTITIES, ROUGHNESS


class ComparedSide(Section):
    """Numbers of one of two reliefs.

    Attributes:
        name: as the page calls it.
        file: file of the heights.
        size_mm: width of the plate, mm.
        samples: samples along x.
        rows: samples along y.
        relief_mm: from the lowest to the highest point, mm.
        printer: name of the printer of which the relief is a print; null of a design.
        values: value of the quantity, mean over the contact locations.
        contact_fraction: share of the patch under pressure.
    """

    name: str
    file: str
    size_mm: float
    samples: int
    rows: int
    relief_mm: float
    printer: str | None = None
    values: Annotated[Values, EachUnder("")]
    contact_fraction: float


class Compared(Section):
    """Numbers of a comparison, as `retouch compare --json` prints them.

    Attributes:
        first: the first relief, or the original of a run.
        second: the second relief, or the result of a run.
        jnd_apart: just-noticeable differences by which the second is rougher (+) or smoother (-); null if one
            is smooth.
        places: the same over the contact locations; null if there is one, or if their numbers differ.
        told_apart_probability: probability of naming the rougher one in one touch of both.
        look: change of the pictures from first to second, as `look` of result.json; null if they are not
            compared.
        no_look: why they are not compared, in a sentence; else null.
        scene: scene of the pictures.
        skin: `name` of the finger, and its parameters.
        model: model of touch.
        fingers: other fingers, as `touch.fingers` of result.json.
        measured: a finger fitted to measurements, as `touch.measured` of result.json; null if the reliefs
            differ in size, samples or repeats.
        surface_bands: the skin's surface, as `touch.surface_bands` of result.json, where `jnd_apart` is null.
        page: page that was written.
    """

    first: ComparedSide
    second: ComparedSide
    jnd_apart: float | None
    places: Spread | None
    told_apart_probability: float | None
    look: PictureChange | None
    no_look: str | None
    scene: str | None
    skin: Mapping[str, Any]
    model: str
    fingers: Fingers | None = None
    measured: Measured | None = None
    surface_bands: tuple[SurfaceBand, ...] | None = None
    page: str | None = None

    @property
    def sides(self) -> tuple[ComparedSide, ComparedSide]:
        """Numbers of both reliefs."""
        return self.first, self.second

    @property
    def smooth(self) -> str:
        """Why there are no just-noticeable differences, in a clause; empty if there are."""
        values = (side.values[ROUGHNESS.name] or 0.0 for side in self.sides)
        return sentences.smooth_change(*values) if self.jnd_apart is None else ""

    def lines(self, verbose: bool = False) -> Iterator[tuple[str, str]]:
        """A word and a sentence each; `verbose` adds other measures of the pictures."""
        for side in self.sides:
            print_of = "" if side.printer is None else f", as printed ({side.printer})"
            yield side.name, f"{side.file}, {side.size_mm:g} mm, {side.samples} x {side.rows}{print_of}"
        means = "" if self.places is None else f" (means over {self.places.count} places)"
        for name, quantity in QUANTITIES.items():
            values = " and ".join(number(side.values[name]) for side in self.sides)
            yield quantity.label, f"{values} {quantity.unit}".rstrip() + means
        shares = " and ".join(f"{100.0 * side.contact_fraction:.0f} %" for side in self.sides)
        yield "in contact", f"{shares} of the patch; {GAPS_COUNT}"
        yield "feel", _feel(self)
        if (places := self.places) is not None and places.jnd_min is not None:
            ends = f"{places.jnd_min:+.2f} to {places.jnd_max:+.2f}"
            yield "", f"{ends} JND over {places.count} places of the finger"
        if (fingers := self.fingers) is not None and fingers.jnd_min is not None:
            yield "", sentences.other_fingers(fingers, self.places is not None)
        if (measured := self.measured) is not None and measured.jnd_mean is not None:
            yield "", sentences.measured_finger(measured)
        for line, band in enumerate(self.surface_bands or ()):
            yield "" if line else "skin's surface", sentences.surface_band(band)
        if (look := self.look) is None:
            yield "pictures", f"not compared: {self.no_look}"
        else:
            yield "pictures", _pictures(look, verbose)
            for name, each in (("DSSIM", look.dssim), ("FLIP", look.flip)):
                values = ", ".join(number(value, 2) for value in each)
                yield name, f"{values} ({', '.join(look.conditions)})"
        yield "page", str(self.page)


def _feel(numbers: Compared) -> str:
    jnd, names = numbers.jnd_apart, (numbers.first.name, numbers.second.name)
    # "A" and "B", but "the result".
    one, other = (f"the {name}" if name.islower() else name for name in names)
    if jnd is None:
        return numbers.smooth
    return f"{other} is {sentences.jnd_in_words(jnd)} than {one}, {sentences.told_apart(jnd)}"


def _pictures(look: PictureChange, verbose: bool) -> str:
    if look.noise.certainty == "same":
        return look.noise.message
    about = "" if look.noise.certainty == "known" else "about "
    apart = f"{about}{percent(look.change_percent)} of the mean picture apart"
    of_white = f"{percent(look.change_percent_of_white)} of white"
    return f"{apart} (rms {percent(look.change_rms_percent)}); {of_white}" if verbose else apart
