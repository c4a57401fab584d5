"""Questions of the window."""

import pytest

from studio.app.model.runs.leaving import Answer
from studio.app.shell.questions import ask_unsaved


@pytest.mark.parametrize(("word", "meant"), [("Save", Answer.SAVE), ("Cancel", Answer.CANCEL)])
def test_what_follows_an_answer_begins_after_its_click(qapp, until, word, meant):
    """It may ask for a file in a loop of its own, in which the question is deleted."""
    from PySide6.QtCore import Qt
    from PySide6.QtTest import QTest
    from PySide6.QtWidgets import QMessageBox, QWidget

    window, answers, is_clicked = QWidget(), [], False
    window.show()
    ask_unsaved(window, "mine", lambda answer: answers.append((answer, is_clicked)))
    (box,) = window.findChildren(QMessageBox)
    button = next(b for b in box.buttons() if b.text().replace("&", "").startswith(word))
    QTest.mouseClick(button, Qt.MouseButton.LeftButton)
    is_clicked = True
    until(lambda: answers)
    assert answers == [(meant, True)]
    until(lambda: not window.findChildren(QMessageBox))
    window.deleteLater()
