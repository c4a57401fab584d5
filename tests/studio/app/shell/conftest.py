"""The whole window on the tiny room, driven by mouse and keys."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from studio import rehearsal
from studio.app.model.documents.document import Document
from studio.session import opening


@pytest.fixture
def desk(tiny, tmp_path, qapp, until, monkeypatch):
    """`desk.window` with the tiny room open, and what a hand does: keys, clicks, drags, answers."""
    from PySide6.QtCore import QPoint, Qt
    from PySide6.QtTest import QTest
    from PySide6.QtWidgets import QDialogButtonBox, QFileDialog, QLineEdit, QMessageBox

    from scenes.package import save_package
    from studio.app.window import dispose, make_window

    room = tmp_path / "tiny.gnx"
    save_package(tiny.scene, room)
    options, plans = {}, []

    def open_tiny(plan, **given):
        plans.append(plan)
        if plan.fork is None:
            return tiny.session(plan, **options, **given)
        inputs = options.get("inputs", tiny.inputs)
        return tiny.session(plan, inputs=lambda: plan.fork.proven(inputs()), **given)

    monkeypatch.setattr(rehearsal, "open_session", open_tiny)
    monkeypatch.setattr(opening, "open_session", open_tiny)
    windows = []

    def window_on(document):
        window = make_window(document, rehearse_to=tmp_path / "sessions", home=tmp_path / "home")
        window.bench.set(has_started=True)
        windows.append(window)
        window.run.open_scene(document.scene)
        window.show()
        until(lambda: window.is_filled and window.bench.scene is not None)
        qapp.setActiveWindow(window)  # Xvfb has no window manager that would
        return window

    window = window_on(Document(str(room)))

    def press(key, *modifiers):
        flags = Qt.KeyboardModifier.NoModifier
        for modifier in modifiers:
            flags |= getattr(Qt.KeyboardModifier, f"{modifier}Modifier")
        QTest.keyClick(made.window, getattr(Qt.Key, f"Key_{key}"), flags)

    def question():
        boxes = [box for box in made.window.findChildren(QMessageBox) if box.isVisible()]
        return boxes[0] if boxes else None

    def answer(word):
        until(lambda: question() is not None)
        box = question()
        button = next(b for b in box.buttons() if b.text().replace("&", "").startswith(word))
        QTest.mouseClick(button, Qt.MouseButton.LeftButton)
        until(lambda: question() is not box)

    def click(widget):
        assert widget.isVisible()
        assert widget.isEnabled()
        QTest.mouseClick(widget, Qt.MouseButton.LeftButton)

    def choose_file(path):
        """Choose a path in the file dialog that a key or click is about to open."""
        from PySide6.QtCore import QTimer
        from PySide6.QtWidgets import QApplication

        def fill(tries=200):
            dialog = QApplication.activeModalWidget()
            if not isinstance(dialog, QFileDialog):
                assert tries, "no file dialog has come"
                QTimer.singleShot(20, lambda: fill(tries - 1))
                return
            dialog.findChild(QLineEdit, "fileNameEdit").setText(str(path))
            accept = dialog.findChild(QDialogButtonBox).buttons()[0]
            QTest.mouseClick(accept, Qt.MouseButton.LeftButton)
            if dialog.isVisible():
                dialog.reject()  # the test fails, and does not wait for ever

        QTimer.singleShot(20, fill)

    def drag_object(object_id):
        """Drag an object along x by its arrow in the view; whether there was an arrow to drag."""
        view, bench = made.window.view.active, made.window.bench
        bench.perform("view.tool_move")
        bench.select(object_id)
        until(lambda: view.painted is not None)
        gizmo = view._handles().gizmo
        if gizmo is None:
            return False
        start, end = (QPoint(*map(round, at)) for at in gizmo.lines()["x"])
        QTest.mousePress(view, Qt.MouseButton.LeftButton, pos=start + (end - start) * 0.7)
        for share in (0.8, 1.0, 1.3):
            QTest.mouseMove(view, start + (end - start) * share)
        QTest.mouseRelease(view, Qt.MouseButton.LeftButton, pos=start + (end - start) * 1.3)
        return True

    def edit():
        """Adds a box, as the menu does."""
        made.window.bench.perform("twin.add_primitive", shape="box", place=[0.2, 0.2, 0.0])

    made = SimpleNamespace(
        window=window,
        room=room,
        options=options,
        plans=plans,
        window_on=window_on,
        press=press,
        question=question,
        answer=answer,
        click=click,
        choose_file=choose_file,
        edit=edit,
        until=until,
        drag_object=drag_object,
    )
    yield made
    for each in windows:
        each.close()
        dispose(each)
