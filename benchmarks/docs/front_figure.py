"""The first picture of the README: a part as found and two JND rougher, `docs/images/front.png`.

python -m benchmarks.docs.front_figure FOLDER

FOLDER holds `dial-found.3mf` and `dial.3mf`, weave around a knob as found and as the run `runs/dial` made it
rougher, by the commands of `docs/tutorials/part.md`.
"""

from benchmarks.objects.guide.parts_figure import COLOURS, SHOTS, picture
from benchmarks.shared.common import IMAGES, folder_named, machine, save
from benchmarks.shared.picture_sheets import sheet
from optimize.run_directory.finished_run import FinishedRun

NAMES = {"dial-found.3mf": "as found", "dial.3mf": "two just-noticeable differences rougher"}


def main() -> None:
    folder = folder_named(__doc__, "FOLDER")
    shot = next(shot for shot in SHOTS if shot.file == "dial.3mf")
    shown = [(picture(folder, shot._replace(file=file)), name) for file, name in NAMES.items()]
    verification = FinishedRun.read(folder / "runs" / "dial").verification
    places = verification.touch.places
    assert places is not None and places.between is not None
    save(
        "front",
        {
            "machine": machine(),
            "percent": verification.look.change_percent,
            "jnd": places.steered.jnd_mean,
            "held_out_jnd": places.between.jnd_mean,
        },
    )
    sheet([shown]).quantize(COLOURS).save(IMAGES / "front.png", optimize=True)


if __name__ == "__main__":
    main()
