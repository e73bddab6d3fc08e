"""History: the document that is being made, and the steps that led to it."""

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from retouch.app.values.document import AppDocument, object_options

ONE_CHANGE_S = 0.7
"""Changes of one number that follow one another faster, as those of a slider, are undone together, s."""
MOST_UNDONE = 50
"""Steps that can be undone."""

Follower = Callable[[AppDocument, AppDocument], None]
"""What is called with the document before and after a change."""


class UndoHistory:
    """The document and its earlier states.

    Attributes:
        document: what is chosen.
    """

    def __init__(self) -> None:
        self.document = AppDocument()
        self._followers: list[Follower] = []
        self._undo: list[AppDocument] = []
        self._last: tuple[str, float] = ("", 0.0)

    def follow(self, follower: Follower) -> None:
        """Call a function after every change, in the order in which the functions came."""
        self._followers.append(follower)

    def change(self, document: AppDocument, undoable: bool = True, slid: str = "") -> None:
        """Take another document.

        Args:
            document: the other one.
            undoable: whether the change is a step that can be undone.
            slid: name of the number that a slider may move; empty for a change that is a step of its own.
        """
        before = self.document
        if document == before:
            return
        last, at = self._last
        now = time.monotonic()
        self._last = (slid, now)
        if undoable and not (slid and slid == last and now - at <= ONE_CHANGE_S):
            self._undo = [*self._undo, before][-MOST_UNDONE:]
        self.document = document
        for follower in self._followers:
            follower(before, document)

    def change_picture(self, *, slid: str = "", **fields: Any) -> None:
        """Change fields of the picture; `slid` as of `change`."""
        self._change_fields("picture", slid, fields)

    def change_feel(self, *, slid: str = "", **fields: Any) -> None:
        """Change fields of the feel; `slid` as of `change`."""
        self._change_fields("feel", slid, fields)

    def change_part(self, **fields: Any) -> None:
        """Change fields of the object."""
        self._change_fields("part", "", fields)

    def change_option(self, name: str, value: object) -> None:
        """Change an option of the object; None and the value without the option leave the option out."""
        options = {key: one for key, one in self.document.part.options.items() if key != name}
        if value not in (None, object_options()[name].value):
            options[name] = value
        self.change_part(options=options)

    def _change_fields(self, name: str, slid: str, fields: dict[str, Any]) -> None:
        earlier = getattr(self.document, name)
        if earlier is not None:
            self.change(replace(self.document, **{name: replace(earlier, **fields)}), slid=slid)

    def look_at(self, run: str) -> None:
        """Look at another run; that is no step to undo."""
        self.change(replace(self.document, run=run), undoable=False)

    def undo(self) -> None:
        """Go back to the document before the last change."""
        while self._undo:
            # The run that is looked at is no part of the steps.
            earlier = replace(self._undo.pop(), run=self.document.run)
            # A slider that was moved and brought back has left a step that changes nothing.
            if earlier != self.document:
                self.change(earlier, undoable=False)
                return

    @property
    def can_undo(self) -> bool:
        """Whether there is a change to undo."""
        return any(replace(one, run=self.document.run) != self.document for one in self._undo)
