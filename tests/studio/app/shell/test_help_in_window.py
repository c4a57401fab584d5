"""The Help menu: the manual is read offline, About says versions and licences, words are found."""

from pathlib import Path

import pytest

from benchmarks.studio.tasks.clicking import Hand
from studio.app.model.actions import SYNONYMS, matching
from studio.app.shell.help_pages import AboutWindow, ManualWindow, libraries, manual_pages
from studio.console.display import why_no_window
from studio.console.machine import program_version

WHY_NOT = why_no_window()
pytestmark = [
    pytest.mark.gui,
    pytest.mark.skipif(WHY_NOT is not None, reason=f"no window here: {WHY_NOT}"),
]
DOCS = Path(__file__).resolve().parents[4] / "docs"


def test_every_page_is_in_the_manual_and_the_studio_s_own_comes_first():
    pages = manual_pages(DOCS)
    assert {path for _, path in pages} == set(DOCS.rglob("*.md"))
    assert pages[0] == ("The studio", DOCS / "studio.md")
    assert all(title for title, _ in pages)


def test_the_manual_opens_by_its_menu_finds_words_and_follows_links(desk):
    from PySide6.QtCore import QUrl
    from PySide6.QtTest import QTest

    hand = Hand(desk.window, desk.until)
    hand.menu("Help", "Manual")
    (window,) = desk.window.findChildren(ManualWindow)
    desk.until(window.isVisible)
    assert "First steps" in window.text.toPlainText()
    count = window.list.count()
    QTest.keyClicks(window.field, "equirectangular")
    titles = [window.list.item(row).text() for row in range(window.list.count())]
    assert 0 < len(titles) < count
    assert "Files that are read" in titles
    window.text.anchorClicked.emit(QUrl("preparation.md"))
    assert window.text.source().fileName() == "preparation.md"
    window.close()


def test_a_copy_without_pages_says_so(qapp, tmp_path):
    window = ManualWindow(None, tmp_path / "docs")
    assert "missing in this copy" in window.text.toPlainText()
    window.deleteLater()


def test_about_has_version_licence_and_libraries(desk):
    hand = Hand(desk.window, desk.until)
    hand.menu("Help", "About")
    (window,) = desk.window.findChildren(AboutWindow)
    desk.until(window.isVisible)
    assert program_version() in window.version
    found = {name.lower(): licence for name, _, licence in window.libraries}
    assert "LGPL" in found["pyside6_essentials"]
    assert "Apache" in found["mujoco-core"]
    assert "PySide6" in window.text.toPlainText()
    hand.button("Licence", window)
    assert "Apache License" in window.text.toPlainText()
    assert "numpy 2" in window.copied
    hand.button("Close", window)
    assert len(libraries()) > 30


def test_every_word_of_other_programs_finds_something_in_the_palette(desk):
    from PySide6.QtTest import QTest

    desk.until(lambda: desk.window.is_filled)
    actions = desk.window.bench.actions
    titles = [action.title.lower() for action in actions]
    named = {(word, each) for word, ours in SYNONYMS.items() for each in ours}
    assert [pair for pair in named if not any(pair[1] in title for title in titles)] == []
    wanted = {
        "export": "Share …",
        "save as": "Save project as …",
        "record": "Rehearse",
        "simulate": "Rehearse",
        "delete": "Remove",
    }
    for word, title in wanted.items():
        assert title in [action.title for action in matching(actions, word)], word
    desk.press("K", "Control")
    palette = desk.window.palette_bar
    QTest.keyClicks(palette.field, "screensh")
    texts = [palette.list.item(row).text() for row in range(palette.list.count())]
    assert "View: Picture of the window" in texts
