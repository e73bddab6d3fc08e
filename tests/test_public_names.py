"""What compatibility is promised of does not change by accident: public names, commands and their options.

`make names` lists them anew in `public_names.txt`, after a change that is meant.
"""

import argparse
import importlib
import inspect
from collections.abc import Iterator
from pathlib import Path

import pytest

from retouch.commands.main import VERBS

FILE = Path(__file__).with_name("public_names.txt")
PACKAGES = ("retouch", "tactile", "visual", "optimize")


def names() -> Iterator[str]:
    """A line for each name of a package, with its parameters, and for each argument of a command."""
    for package in map(importlib.import_module, PACKAGES):
        for name in sorted(package.__all__):
            yield f"{package.__name__}.{name}{parameters(getattr(package, name))}"
    for verb, module in VERBS.items():
        parser = argparse.ArgumentParser(add_help=False)
        module.add_arguments(parser)
        for action in parser._actions:
            yield f"retouch {verb} {', '.join(action.option_strings) or action.metavar or action.dest}"


def parameters(thing: object) -> str:
    """Names of the parameters of a function, in brackets; nothing for a class, which functions make."""
    return f"({', '.join(inspect.signature(thing).parameters)})" if inspect.isfunction(thing) else ""


@pytest.mark.slow
@pytest.mark.sentinel
def test_public_names_are_those_of_the_list() -> None:
    assert list(names()) == FILE.read_text(encoding="utf-8").splitlines()


if __name__ == "__main__":
    FILE.write_text("".join(f"{line}\n" for line in names()), encoding="utf-8")
