"""`retouch app`: make, feel, run and compare on a page in the browser.

Opens a page in the browser: drop a picture, light it, see how rough it feels, choose another feel, run, and
compare. The page is served by this machine to itself alone; the address that is printed holds a token without
which nobody gets in. Pictures are kept in the folder `pictures`, runs in `runs`, as `retouch optimize` writes
them. Ctrl-C closes the app; a run under way writes its best relief and can go on later.

examples:
  retouch app
  retouch app stone.jpg
  retouch app --no-browser --port 8080
"""

import argparse
import importlib.util
from pathlib import Path

from mitsuba_scenes import find_texture
from relief.ground.errors import InputError
from relief.ground.options import whole_number
from retouch.commands.options import add

PORT = 8642
"""Port where none is given; none of the registered services of common machines has it."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    text = "any picture to begin with; a bundled texture goes by its name (default: the last one)"
    add(parser, "picture PICTURE", text, nargs="?", type=Path)
    text = f"port of this machine; 0 takes any that is free (default: {PORT})"
    add(parser, "--port N", text, type=whole_number(0, 65535), default=PORT)
    add(parser, "--no-browser", "only print the address of the page", dest="browser", action="store_false")


def run(arguments: argparse.Namespace) -> int:
    if importlib.util.find_spec("nicegui") is None:
        raise InputError("retouch app needs NiceGUI; install it with: pip install 'retouch[app]'")
    picture = arguments.picture
    if picture is not None and not find_texture(picture).is_file():
        raise InputError(f"{picture}: no such file")
    # Imported here: the other verbs need no server. Its worker starts first, as the server takes a second.
    from retouch.app.state.session import Session

    session = Session()
    with session.opened(picture) as chosen:
        from retouch.app.serve import serve

        serve(session, chosen, arguments.port, arguments.browser)
    return 0
