"""What the app shows of a picture: the part that was taken, and in it what a tile repeats."""

from dataclasses import replace

from retouch.app.computing.pictures import prepare
from retouch.app.values.document import PictureChoice


def test_the_part_that_a_tile_repeats_is_shown_within_what_was_taken() -> None:
    choice = PictureChoice("gravel", crop=(8, 16, 80, 80), tile="blend")
    taken = prepare(choice)
    assert taken.square == (8, 16, 80) and taken.tile is not None
    assert taken.tile[:2] == (8, 16) and 40 <= taken.tile[2] <= 64
    assert prepare(replace(choice, tile=None)).tile is None
