"""Questions of the window: before unsaved edits are lost, and for files and folders."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QFileDialog, QMessageBox, QWidget

from studio.app.model.runs.leaving import Answer

ANSWERS = {
    QMessageBox.StandardButton.Save: Answer.SAVE,
    QMessageBox.StandardButton.Discard: Answer.DISCARD,
    QMessageBox.StandardButton.Cancel: Answer.CANCEL,
}
"""By the button that was pressed."""


def ask_unsaved(window: QWidget, name: str, answered: Callable[[Answer], None]) -> None:
    """Ask over a window; it is called back with the answer, and the window lives on meanwhile."""
    box = QMessageBox(window)
    box.setObjectName("unsaved")
    box.setAttribute(Qt.WidgetAttribute.WA_DeleteOnClose)
    box.setIcon(QMessageBox.Icon.Warning)
    box.setWindowTitle("Unsaved changes")
    box.setText(f"Save the changes to {name!r}?")
    box.setInformativeText("If you discard them, they are gone for good.")
    for button in ANSWERS:
        box.addButton(button)
    box.setDefaultButton(QMessageBox.StandardButton.Save)
    box.setEscapeButton(QMessageBox.StandardButton.Cancel)
    box.setWindowModality(Qt.WindowModality.WindowModal)

    def done(_result: int) -> None:
        answered(ANSWERS.get(box.standardButton(box.clickedButton()), Answer.CANCEL))

    box.finished.connect(done)
    box.open()


def ask_file(window: QWidget, title: str, kinds: str, writes: bool) -> str:
    """Ask for a file, to be written or read; "" if none is chosen."""
    ask = QFileDialog.getSaveFileName if writes else QFileDialog.getOpenFileName
    chosen, _ = ask(window, title, "", kinds)
    return chosen


def ask_folder(window: QWidget, title: str) -> str:
    """Ask for a folder; "" if none is chosen."""
    return QFileDialog.getExistingDirectory(window, title)
