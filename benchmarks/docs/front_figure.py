"""The first picture of the README: a part as found and two JND rougher, `docs/images/front.png`.

python -m benchmarks.docs.front_figure FOLDER

FOLDER holds `dial-found.3mf` and `dial.3mf`, weave around a knob as found and as the run `runs/dial` made it
rougher, by the commands of `docs/tutorials/part.md`.
"""

from PIL import Image, ImageDraw, ImageFont

from benchmarks.objects.guide.parts_figure import HEIGHT, SHOTS, WIDTH, picture
from benchmarks.shared.common import IMAGES, folder_named, machine, save
from optimize.run_directory.finished_run import FinishedRun

NAMES = {"dial-found.3mf": "as found", "dial.3mf": "two just-noticeable differences rougher"}
LABEL = 30
COLOURS = 256


def main() -> None:
    folder = folder_named(__doc__, "FOLDER")
    shot = next(shot for shot in SHOTS if shot.file == "dial.3mf")
    sheet = Image.new("RGB", (len(NAMES) * WIDTH, HEIGHT + LABEL), "white")
    draw, font = ImageDraw.Draw(sheet), ImageFont.load_default(18)
    for column, (file, name) in enumerate(NAMES.items()):
        sheet.paste(picture(folder, shot._replace(file=file)), (WIDTH * column, 0))
        draw.text((WIDTH * (column + 0.5), HEIGHT + 3), name, "black", font, anchor="ma")
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
    sheet.quantize(COLOURS).save(IMAGES / "front.png", optimize=True)


if __name__ == "__main__":
    main()
