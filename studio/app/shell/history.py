"""Qt's undo stack as the workbench's history."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtGui import QUndoCommand, QUndoStack

from studio.app.model.documents.document import Change, Document
from studio.app.model.workbench import Workbench

LIMIT = 500
"""Steps that can be undone; documents share what did not change, so a step takes a few kB."""


class QtHistory:
    """Changes on a `QUndoStack`.

    Args:
        show: shows a document without another step.
    """

    def __init__(self, show: Callable[[Document], None]) -> None:
        self.stack = QUndoStack()
        self.stack.setUndoLimit(LIMIT)
        self._show = show
        self._merge_ids: dict[str, int] = {}

    @property
    def undoes(self) -> str:
        """See `History.undoes`."""
        return self.stack.undoText()

    @property
    def redoes(self) -> str:
        """See `History.redoes`."""
        return self.stack.redoText()

    def push(self, change: Change) -> None:
        """See `History.push`."""
        self.stack.push(_Step(change, self._show, self._merge_id(change.merge)))

    def undo(self) -> None:
        """See `History.undo`."""
        self.stack.undo()

    def redo(self) -> None:
        """See `History.redo`."""
        self.stack.redo()

    def clear(self) -> None:
        """See `History.clear`."""
        self.stack.clear()
        self._merge_ids.clear()

    def _merge_id(self, merge: str) -> int:
        return self._merge_ids.setdefault(merge, len(self._merge_ids)) if merge else -1


class _Step(QUndoCommand):
    def __init__(self, change: Change, show: Callable[[Document], None], merge_id: int) -> None:
        super().__init__(change.label)
        self._change = change
        self._show = show
        self._merge_id = merge_id
        self._is_done = True  # Qt calls redo when a command is pushed; the change is made already

    def id(self) -> int:
        return self._merge_id

    def mergeWith(self, other: QUndoCommand) -> bool:
        merged = self._change.merged(other._change) if isinstance(other, _Step) else None
        if merged is not None:
            self._change = merged
        return merged is not None

    def undo(self) -> None:
        self._is_done = False
        self._show(self._change.before)

    def redo(self) -> None:
        if not self._is_done:
            self._show(self._change.after)
        self._is_done = True


def make_history(bench: Callable[[], Workbench]) -> QtHistory:
    """Return the undo stack of a bench that is made after it."""
    return QtHistory(lambda document: bench().show_document(document))
