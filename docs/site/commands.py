"""The reference of the command, written from the parsers that the command itself has."""

import argparse
import re
from collections.abc import Iterator

from retouch.commands import main

SPECIAL = re.compile(r"([\\*_<>$&|\[\]{}~#])")
"""Characters that mean something in Markdown."""


class _Wide(argparse.HelpFormatter):
    """Lines of one length, whatever the width of the terminal."""

    def __init__(self, prog: str) -> None:
        super().__init__(prog, width=80)


def reference() -> str:
    """Markdown: a section for each verb."""
    return "\n\n".join(_verb(name) for name in main.VERB_NAMES)


def _verb(name: str) -> str:
    verb, parser = main.VERBS[name], argparse.ArgumentParser(f"retouch {name}", formatter_class=_Wide)
    verb.add_arguments(parser)
    texts = main.texts_of(verb)
    parts = [f"## retouch {name}", *_paragraphs(texts["description"]), _code(parser.format_usage())]
    for group in parser._action_groups:
        options = [
            _option(parser, action)
            for action in group._group_actions
            if "--help" not in action.option_strings
        ]
        if options:
            parts += [f"**{(group.title or '').capitalize()}**", *options]
    return "\n\n".join([*parts, *_paragraphs(texts["epilog"])])


def _option(parser: argparse.ArgumentParser, action: argparse.Action) -> str:
    """An entry of a definition list."""
    formatter = parser._get_formatter()
    text = formatter._expand_help(action) if action.help else ""
    return f"`{formatter._format_action_invocation(action)}`\n: {_escaped(text)}"


def _paragraphs(text: str) -> Iterator[str]:
    """Paragraphs, and as code what is set in: lists with aligned columns, examples."""
    for paragraph in text.strip("\n").split("\n\n"):
        head, indented, rest = paragraph.partition("\n  ")
        if head.startswith("  "):
            yield _code(paragraph)
        else:
            yield _escaped(head)
            if indented:
                yield _code(f"  {rest}")


def _code(text: str) -> str:
    return f"```text\n{text.rstrip()}\n```"


def _escaped(text: str) -> str:
    """Text as Markdown, with its code between backticks."""
    parts = text.split("`")
    return "`".join(part if at % 2 else SPECIAL.sub(r"\\\1", part) for at, part in enumerate(parts))
