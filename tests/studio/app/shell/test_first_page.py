"""The first page shows all of its words, at every text size, in every view."""

import pytest

from studio.app.model.documents.document import Document
from studio.app.model.settings import TEXT_SCALES, THEMES, Settings
from studio.app.model.workbench import Workbench
from studio.console.display import why_no_window

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]
SMALL, LARGE = (530, 380), (1500, 1000)
"""Views of a window 1280 × 800 at the largest text, and of one 2560 × 1440, pixels."""


class NoHistory:
    def push(self, change):
        raise AssertionError("nothing is changed here")

    def clear(self):
        pass


@pytest.fixture
def make_page(qapp):
    from PySide6.QtTest import QTest
    from PySide6.QtWidgets import QWidget

    from studio.app.shell.first_page import FirstPage
    from studio.app.shell.theme import apply_theme

    over = []

    def make(size, theme="dark", scale=1.0):
        apply_theme(qapp, theme, scale)
        view = QWidget()
        over.append(view)
        view.resize(*size)
        page = FirstPage(Workbench(Document("lab"), Settings(), NoHistory()), view)
        view.show()
        assert QTest.qWaitForWindowExposed(view, 60_000)  # a busy X server takes its time
        page.place()
        qapp.processEvents()
        return page

    yield make
    for view in over:
        view.close()
        view.deleteLater()
    apply_theme(qapp, "dark", 1.0)
    qapp.setProperty("nexus theme", None)


def words_of(page):
    from PySide6.QtWidgets import QLabel, QPushButton

    return [*page.findChildren(QLabel), *page.findChildren(QPushButton)]


def assert_whole(page, qapp):
    """Every word has the room that it needs, and can be brought into sight."""
    from PySide6.QtCore import QPoint, QRect
    from PySide6.QtWidgets import QLabel, QScrollArea, QToolButton

    assert page.parentWidget().rect().contains(page.geometry())
    area = page.findChild(QScrollArea)
    assert area.horizontalScrollBar().maximum() == 0
    close = page.findChild(QToolButton)
    assert page.rect().contains(QRect(close.mapTo(page, QPoint(0, 0)), close.size()))
    for each in words_of(page):
        name = f"{each.text()!r} in {page.size()}"
        if isinstance(each, QLabel) and each.wordWrap():
            assert each.height() >= each.heightForWidth(each.width()), name
            assert each.width() >= each.minimumSizeHint().width(), name
        else:
            assert each.width() >= each.sizeHint().width(), name
            assert each.height() >= each.sizeHint().height(), name
        if area.isAncestorOf(each):
            area.ensureWidgetVisible(each, 0, 0)
            qapp.processEvents()
            assert not each.visibleRegion().isEmpty(), name
            assert each.visibleRegion().boundingRect() == each.rect(), name


@pytest.mark.parametrize("theme", THEMES)
@pytest.mark.parametrize("scale", TEXT_SCALES)
@pytest.mark.parametrize("size", [SMALL, LARGE])
def test_no_word_is_cut_off(make_page, qapp, theme, scale, size):
    assert_whole(make_page(size, theme, scale), qapp)


def test_it_scrolls_only_where_its_words_are_higher_than_the_view(make_page):
    from PySide6.QtWidgets import QScrollArea

    bars = {
        (size, scale): make_page(size, "dark", scale)
        .findChild(QScrollArea)
        .verticalScrollBar()
        .maximum()
        for size in (SMALL, LARGE)
        for scale in (1.0, 2.0)
    }
    assert [place for place, most in bars.items() if most > 0] == [(SMALL, 2.0)]


def test_notes_go_below_their_buttons_where_beside_them_they_are_higher(make_page):
    from PySide6.QtWidgets import QLabel, QPushButton

    def is_beside(page):
        button = page.findChildren(QPushButton)[0]
        note = next(each for each in page.findChildren(QLabel) if "tracker" in each.text())
        return note.geometry().left() > button.geometry().right()

    assert is_beside(make_page(SMALL, "dark", 1.0))
    assert not is_beside(make_page(SMALL, "dark", 2.0))
    assert is_beside(make_page(LARGE, "dark", 2.0))


def test_it_follows_the_text_and_the_view_while_it_is_shown(make_page, qapp):
    from studio.app.shell.theme import apply_theme

    page = make_page(LARGE)
    before = page.size()
    apply_theme(qapp, "light", 1.5)
    for _ in range(5):
        qapp.processEvents()
    assert page.width() > 1.4 * before.width()
    assert_whole(page, qapp)
    page.parentWidget().resize(*SMALL)
    for _ in range(5):
        qapp.processEvents()
    assert_whole(page, qapp)


def test_the_tab_key_brings_every_way_into_sight(make_page, qapp):
    from PySide6.QtCore import Qt
    from PySide6.QtTest import QTest
    from PySide6.QtWidgets import QPushButton

    page = make_page(SMALL, "dark", 2.0)
    buttons = page.findChildren(QPushButton)
    assert buttons[-1].visibleRegion().isEmpty()
    qapp.setActiveWindow(page.window())
    buttons[0].setFocus()
    for each in buttons[1:]:
        QTest.keyClick(qapp.focusWidget(), Qt.Key.Key_Tab)
        qapp.processEvents()
        assert each.hasFocus()
        assert each.visibleRegion().boundingRect() == each.rect()
