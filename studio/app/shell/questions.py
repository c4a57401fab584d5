"""Questions of the window: before unsaved edits are lost, and for files and folders."""

from __future__ import annotations

from collections.abc import Callable

from PySide6.QtCore import Qt, QTimer
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
        answer = ANSWERS.get(box.standardButton(box.clickedButton()), Answer.CANCEL)
        # What follows may ask for a file, in a loop of its own: the box is deleted in that, and the
        # click that closed it must have ended by then.
        QTimer.singleShot(0, window, lambda: answered(answer))

    box.finished.connect(done)
    box.open()


Ask = Callable[[str, str, bool], str]
"""Asks for a file: title, kinds, whether it is to be written; "" if none was chosen."""


def ask_file(window: QWidget, title: str, kinds: str, writes: bool) -> str:
    """Ask for a file, to be written or read; "" if none is chosen.

    A name to write gets the ending of the chosen kind where it has none of them, before it is asked
    whether a file of that name is to be replaced.
    """
    if not writes:
        return QFileDialog.getOpenFileName(window, title, "", kinds)[0]
    dialog = QFileDialog(window, title)
    dialog.setAcceptMode(QFileDialog.AcceptMode.AcceptSave)
    dialog.setNameFilters(kinds.split(";;"))

    def take_ending(kind: str) -> None:
        dialog.setDefaultSuffix(kind.partition("*.")[2].split()[0].strip(")"))

    dialog.filterSelected.connect(take_ending)
    take_ending(dialog.nameFilters()[0])
    chosen = dialog.selectedFiles() if dialog.exec() else []
    dialog.deleteLater()
    return chosen[0] if chosen else ""


def ask_folder(window: QWidget, title: str) -> str:
    """Ask for a folder; "" if none is chosen."""
    return QFileDialog.getExistingDirectory(window, title)
