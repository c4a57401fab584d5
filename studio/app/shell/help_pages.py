"""Windows of the Help menu: the manual, read offline, and what this program is made of."""

from __future__ import annotations

import re
from collections.abc import Sequence
from html import escape
from importlib import metadata
from pathlib import Path
from typing import Any

from PySide6.QtCore import QSize, Qt, QUrl
from PySide6.QtGui import QDesktopServices, QGuiApplication, QImage, QTextDocument
from PySide6.QtWidgets import (
    QDialog,
    QHBoxLayout,
    QLabel,
    QLineEdit,
    QListWidget,
    QListWidgetItem,
    QPushButton,
    QSplitter,
    QTextBrowser,
    QVBoxLayout,
    QWidget,
)

from studio.console.machine import DISTRIBUTION, describe_machine, program_version
from studio.console.program_files import PROGRAM_FILES
from studio.view.fonts import FACES

FIRST_PAGES = ("studio", "preparation", "scenarios", "live", "sharing", "forks", "sweeps", "files")
"""Of the manual, in this order; the others follow by title."""

SUITABLE = re.compile(r"^License :: OSI Approved :: (.*)$")
PAGE = int(Qt.ItemDataRole.UserRole)
WIDEST = 70
"""Letters of a licence's name that are shown: some libraries state the whole text."""


def manual_pages(folder: Path) -> list[tuple[str, Path]]:
    """Title and file of every page, first those that a new user needs."""
    pages: list[tuple[str, Path]] = []
    for path in sorted(folder.rglob("*.md")):
        first = path.read_text(encoding="utf-8").partition("\n")[0]
        pages.append((first.lstrip("# ").strip() or path.stem, path))

    def place(page: tuple[str, Path]) -> tuple[int, str]:
        stem = page[1].stem
        return FIRST_PAGES.index(stem) if stem in FIRST_PAGES else len(FIRST_PAGES), page[0]

    return sorted(pages, key=place)


def libraries() -> list[tuple[str, str, str]]:
    """Name, version and licence of everything that the program runs on."""
    listed = PROGRAM_FILES / "requirements" / "run.txt"
    wanted: set[str] | None = None
    if listed.is_file():
        lines = listed.read_text(encoding="utf-8").splitlines()
        wanted = {_plain(line.partition("==")[0]) for line in lines if "==" in line}
    found: dict[str, tuple[str, str, str]] = {}
    for each in metadata.distributions():
        name = str(each.metadata["Name"])
        if (wanted is None or _plain(name) in wanted) and _plain(name) != _plain(DISTRIBUTION):
            found[_plain(name)] = (name, each.version, _licence(each.metadata))
    return [found[key] for key in sorted(found)]


def _plain(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name.strip()).lower()


def _licence(of: Any) -> str:
    stated = str(of.get("License-Expression") or "").strip()
    classified = (SUITABLE.match(str(line)) for line in of.get_all("Classifier") or ())
    names = [match[1] for match in classified if match is not None]
    first = str(of.get("License") or "").strip().partition("\n")[0]
    return (stated or ", ".join(names) or first or "see its own pages")[:WIDEST]


class _Pages(QTextBrowser):
    """A page of the manual, its pictures no wider than it."""

    def loadResource(self, type: int, name: QUrl | str) -> Any:
        """See Qt."""
        found = super().loadResource(type, name)
        kind = QTextDocument.ResourceType.ImageResource.value
        if type != kind:
            return found
        url = self.source().resolved(name if isinstance(name, QUrl) else QUrl(name))
        image = QImage(url.toLocalFile())
        width = self.viewport().width() - 24
        if image.isNull() or image.width() <= width:
            return image
        return image.scaledToWidth(width, Qt.TransformationMode.SmoothTransformation)


class ManualWindow(QDialog):
    """All pages, a field that finds words in them, and the page that is read.

    Args:
        over: the studio's window.
        folder: of the pages.
    """

    def __init__(self, over: QWidget | None, folder: Path = PROGRAM_FILES / "docs") -> None:
        super().__init__(over)
        self.setWindowTitle("Manual")
        self.resize(1000, 700)
        self._pages = manual_pages(folder) if folder.is_dir() else []
        self.field, self.list, self.text = QLineEdit(), QListWidget(), _Pages()
        self.field.setPlaceholderText("Find in all pages …")
        self.field.setAccessibleName("find in the manual")
        self.field.setClearButtonEnabled(True)
        self.list.setAccessibleName("pages of the manual")
        self.text.setOpenLinks(False)
        self.back = QPushButton("Back")
        left, split = QWidget(), QSplitter()
        column = QVBoxLayout(left)
        column.setContentsMargins(0, 0, 0, 0)
        for widget in (self.field, self.list, self.back):
            column.addWidget(widget)
        split.addWidget(left)
        split.addWidget(self.text)
        split.setSizes([260, 740])
        QVBoxLayout(self).addWidget(split)
        self.field.textChanged.connect(self._fill)
        self.list.currentItemChanged.connect(self._choose)
        self.text.anchorClicked.connect(self._follow)
        self.text.backwardAvailable.connect(self.back.setEnabled)
        self.back.setEnabled(False)
        self.back.clicked.connect(self.text.backward)
        self._fill("")
        if not self._pages:
            self.text.setPlainText(f"The pages are not here: {folder} is missing in this copy.")

    def _fill(self, typed: str) -> None:
        words = typed.lower().split()
        self.list.clear()
        for title, path in self._pages:
            text = path.read_text(encoding="utf-8").lower() if words else ""
            if all(word in text for word in words):
                item = QListWidgetItem(title)
                item.setData(PAGE, str(path))
                self.list.addItem(item)
        self.list.setCurrentRow(0)

    def _choose(self, item: QListWidgetItem | None) -> None:
        if item is None:
            return
        self.text.setSource(QUrl.fromLocalFile(item.data(PAGE)))
        words = self.field.text().split()
        if words:
            self.text.find(words[0])

    def _follow(self, link: QUrl) -> None:
        url = self.text.source().resolved(link)
        if url.isLocalFile() and Path(url.toLocalFile()).suffix == ".md":
            self.text.setSource(url)
        else:
            QDesktopServices.openUrl(url)


class AboutWindow(QDialog):
    """Name, version, licence, machine and libraries; what a report of a fault needs, to be copied.

    Args:
        over: the studio's window.
    """

    def __init__(self, over: QWidget | None) -> None:
        super().__init__(over)
        self.setWindowTitle("About GaussianNexus Studio")
        machine = describe_machine()
        self.version = f"GaussianNexus Studio {program_version()}"
        system = f"{machine['os']}, Python {machine['python']}, {machine['cpu']}"
        head = QLabel(
            f"<h2>{escape(self.version)}</h2><p>Live copies of rooms from scans and one 360° "
            f"camera.<br>Free software under the Apache License 2.0.</p><p>{escape(system)}</p>"
        )
        head.setWordWrap(True)
        self.libraries = libraries()
        self.text = QTextBrowser()
        self.text.setHtml(_as_table(self.libraries))
        self.text.setMinimumHeight(260)
        self.copied = f"{self.version}\n{system}\n" + "\n".join(
            f"{name} {version}" for name, version, _ in self.libraries
        )
        row = QHBoxLayout()
        for words, run in (
            ("Copy for a report", lambda: QGuiApplication.clipboard().setText(self.copied)),
            ("Licence", lambda: self._show_text(PROGRAM_FILES / "LICENSE")),
            ("Libraries", lambda: self.text.setHtml(_as_table(self.libraries))),
        ):
            button = QPushButton(words)
            button.setAutoDefault(False)
            button.clicked.connect(run)
            row.addWidget(button)
        row.addStretch(1)
        close = QPushButton("Close")
        close.clicked.connect(self.close)
        row.addWidget(close)
        layout = QVBoxLayout(self)
        layout.addWidget(head)
        layout.addWidget(self.text, 1)
        layout.addLayout(row)

    def sizeHint(self) -> QSize:
        """See Qt."""
        return QSize(680, 560)

    def _show_text(self, path: Path) -> None:
        words = f"Apache License 2.0: {path} is missing in this copy."
        self.text.setPlainText(path.read_text(encoding="utf-8") if path.is_file() else words)


def _as_table(rows: Sequence[tuple[str, str, str]]) -> str:
    lines = "".join(
        f"<tr>{''.join(f'<td>{escape(cell)}&nbsp;&nbsp;</td>' for cell in row)}</tr>"
        for row in rows
    )
    faces = sorted(path.stem for path in FACES.glob("*.ttf"))
    fonts = f"<p>Typefaces under the SIL Open Font License: {', '.join(faces)}</p>" if faces else ""
    return f"<p>It runs on:</p><table>{lines}</table>{fonts}"
