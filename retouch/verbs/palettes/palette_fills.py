"""Palettes: fills that are told apart by touch, as tiles, as plates to print, and on a page."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Unpack

from relief.ground.files import only_writer, write_atomically
from relief.ground.lengths import Lengths
from relief.ground.progress import Progress
from retouch.laboratory.palettes.document import content_of, labels_of, page
from retouch.laboratory.palettes.making import make
from retouch.laboratory.palettes.palette import MOST_FILLS, Palette
from retouch.laboratory.stimulus_sets.document import document_bytes
from retouch.laboratory.stimulus_sets.plate_set import claim
from retouch.laboratory.stimulus_sets.plates import FOLDER, check_labels, write_plates
from retouch.laboratory.studies.engine import PAGE, ROWS
from retouch.laboratory.workers.choice import runner
from retouch.pages.sentences import TextTable
from retouch.verbs.exporting import export
from retouch.verbs.progress_display import followed
from retouch.verbs.stimulus_plates import plate_fields

DOCUMENT, TILES = "palette.json", "tiles"
"""Files of a palette: its numbers, and the folder of its tiles."""


@dataclass(frozen=True)
class PaletteFills:
    """What became of a palette.

    Attributes:
        folder: of the palette.
        content: of `palette.json` (`retouch.laboratory.palettes.document.content_of`).
    """

    folder: Path
    content: Mapping[str, Any]

    def as_json(self) -> dict[str, Any]:
        """What `retouch palette --json` prints."""
        return {"folder": str(self.folder), **self.content}

    def lines(self) -> Iterator[str | TextTable]:
        """Lines and the table of the fills for a person."""
        fills = self.content["fills"]
        columns = {
            "fill": "{label}",
            "level, JND": "{level:+.2f}",
            "V": "{roughness[0]:.4f}",
            "pictures, % of white": "{picture_change_percent_of_white:.2f}",
            "named rightly, %": "{named_percent:.0f}",
        }
        rows = [[form.format(**fill) for form in columns.values()] for fill in fills]
        yield TextTable([(heading, "") for heading in columns], rows, gap=1)
        whose = "every finger" if len(self.content["fingers"]) > 1 else "this finger"
        least = f"least apart: {self.content['least']:.2f} JND for {whose}, by roughness alone"
        yield self.content["short"] or least
        yield f"{self.folder / PAGE}: {len(fills)} fills; to print: {', '.join(self.content['print'])}"


def palette(
    textures: Sequence[str | os.PathLike[str]],
    out: str | os.PathLike[str],
    *,
    apart: float = 2.0,
    fills: int | None = None,
    one_finger: bool = False,
    skin: str | os.PathLike[str] | None = None,
    plates: Mapping[str, Any] | None = None,
    fast: bool = False,
    settings: Mapping[str, Any] | None = None,
    workers: int | None = None,
    dask: str | None = None,
    quiet: bool | None = None,
    progress: Callable[[Progress], None] | None = None,
    **lengths: Unpack[Lengths],
) -> PaletteFills:
    """Make fills that every finger of a range tells apart by roughness, from one texture or several.

    Args:
        textures: height maps or names of bundled ones: tiles.
        out: folder to write to, or to go on in.
        apart: least just-noticeable differences between any two fills.
        fills: number of fills; None: one of each texture, or of one texture as many as there is room for.
        one_finger: whether only the given finger is to tell them apart, not a range of fingers about it.
        skin, plates, fast, settings, lengths: as in `stimuli`.
        workers, dask, quiet, progress: as in `study`.

    Raises:
        InputError: what is wrong with the textures, there is no room for so many fills, or the folder holds
            something else.
        KeyboardInterrupt: fills that are done stay; the same call goes on.
    """
    own = {"apart": apart, "fills": fills, "one_finger": one_finger}
    request = Palette.checked(plate_fields(textures, lengths, skin, plates, fast, settings) | own)
    out = Path(out)
    request.check_textures()
    check_labels([f"{name} {MOST_FILLS}" for name in request.names], request.print)
    with followed(progress, quiet), only_writer(out):
        claim(out, request)
        (out / ROWS).mkdir(exist_ok=True)
        made = make(request, out, lambda work, observer: runner(work, workers, dask, observer))
        tiles = {label: fill.run.result for label, fill in zip(labels_of(request, made), made, strict=True)}
        files = write_plates(out, "palette", tiles, request)
        # Other sides of the bed make other files.
        for old in set((out / FOLDER).glob("*.3mf")) - set(files):
            old.unlink()
        content = content_of(request, made, out, files)
        (out / TILES).mkdir(exist_ok=True)
        for fill, one in zip(made, content["fills"], strict=True):
            export(fill.run.result, out / one["tile"], tile=True)
        write_atomically(out / DOCUMENT, document_bytes(content))
        write_atomically(out / PAGE, page(content, request, out))
    return PaletteFills(out, content)
