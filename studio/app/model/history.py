"""User changes that can be undone: what the document was before and is after each."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from studio.app.model.documents.document import Document


@dataclass(frozen=True, slots=True, eq=False)
class Change:
    """One step of undo.

    Attributes:
        label: what was done, such as "Move chair-1".
        before: the document without it.
        after: the document with it.
        merge: changes in a row with the same key that is not empty are one step: a drag.
    """

    label: str
    before: Document
    after: Document
    merge: str = ""

    def merged(self, later: Change) -> Change | None:
        """Both as one step; None if they are two."""
        if not self.merge or self.merge != later.merge:
            return None
        return Change(self.label, self.before, later.after, self.merge)


class History(Protocol):
    """A stack of changes; the window's is Qt's undo stack."""

    @property
    def undoes(self) -> str:
        """Label of the change that `undo` takes back; "" if there is none."""
        ...

    @property
    def redoes(self) -> str:
        """Label of the change that `redo` makes again; "" if there is none."""
        ...

    def push(self, change: Change) -> None:
        """Remember a change that has been made."""
        ...

    def undo(self) -> None:
        """Take the last change back, if there is one."""
        ...

    def redo(self) -> None:
        """Make the change again that was taken back last."""
        ...

    def clear(self) -> None:
        """Forget all: another document was opened."""
        ...
