"""The list of sessions that were recorded: open, show in the file manager, delete, bring back."""

from __future__ import annotations

from pathlib import Path

from PySide6.QtCore import Qt, QUrl
from PySide6.QtGui import QColor, QDesktopServices
from PySide6.QtWidgets import (
    QLabel,
    QPushButton,
    QToolButton,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from studio.app.model.actions import Action
from studio.app.model.runs.session_folders import KeptSession, SessionFolders
from studio.app.model.workbench import Topic, Workbench
from studio.app.shell.theme import SHAPES, THEMES
from studio.app.shell.wrapping import WrappingRow

NONE_YET = (
    "No session was recorded here yet. Rehearse (F5) or go live (F6): every session gets a folder "
    "of its own and is listed here."
)


MIN_WIDTH_PX = 160
"""Of the list: a date and a verdict are read in it."""


class SessionsDock(QWidget):
    """One line a session, newest first, with what can be done with the chosen one.

    Args:
        bench: whose sessions; what is open is known to it.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self._bench = bench
        folders = bench.shared(SessionFolders)
        assert folders is not None
        self._folders = folders
        self._kept: dict[Path, KeptSession] = {}
        self.words = QLabel(NONE_YET)
        self.words.setObjectName("faint")
        self.words.setWordWrap(True)
        self.table = QTreeWidget()
        self.table.setHeaderHidden(True)
        self.table.setRootIsDecorated(False)
        self.table.setAccessibleName("Sessions")
        self.table.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        self.table.itemDoubleClicked.connect(lambda *_: self._do("sessions.open"))
        self.table.itemSelectionChanged.connect(self._show_buttons)
        self.open_button = self._button("Open", "sessions.open", "in the timeline")
        self.reveal_button = self._button("Show folder", "sessions.reveal", "in the file manager")
        self.delete_button = self._button("Delete", "sessions.delete", "it can come back")
        self.undo_button = QPushButton("Undo delete")
        self.undo_button.clicked.connect(lambda: bench.do("sessions.undo_delete"))
        self.table.setMinimumWidth(MIN_WIDTH_PX)
        self.table.setTextElideMode(Qt.TextElideMode.ElideMiddle)
        row = WrappingRow((self.open_button, self.reveal_button, self.delete_button))
        layout = QVBoxLayout(self)
        layout.addWidget(self.words)
        layout.addWidget(self.table, 1)
        layout.addLayout(row)
        layout.addWidget(self.undo_button)
        self._add_actions()
        for topic in (Topic.SESSION, Topic.RECORDING, Topic.OPENED, Topic.SETTINGS):
            bench.listen(topic, self._refresh_if_changed)
        self._seen: object = None
        self.refresh()

    def _button(self, words: str, action_id: str, hint: str) -> QToolButton:
        button = QToolButton()
        button.setText(words)
        button.setToolTip(hint)
        button.clicked.connect(lambda: self._do(action_id))
        return button

    def _do(self, action_id: str) -> None:
        self._bench.do(action_id)

    # --- what is seen ----------------------------------------------------------------------------

    def _refresh_if_changed(self) -> None:
        """Frames of a session change nothing here."""
        bench = self._bench
        seen = bench.standing, bench.project, bench.settings.theme
        if seen != self._seen:
            self._seen = seen
            self.refresh()

    def refresh(self) -> None:
        """Read the folders again."""
        chosen = self.chosen
        kept = self._folders.listed(self._bench.project)
        self._kept = {each.folder: each for each in kept}
        self.table.clear()
        for each in kept:
            self.table.addTopLevelItem(self._line(each))
        self.words.setVisible(not kept)
        self.choose(chosen)
        self._show_buttons()

    def _line(self, kept: KeptSession) -> QTreeWidgetItem:
        theme = THEMES[self._bench.settings.theme]
        kind = {True: "good", False: "bad", None: "calm"}[kept.is_good]
        lines = [kept.title, kept.begun.strftime("%Y-%m-%d %H:%M")]
        if kept.cut_short:
            lines.append(f"{SHAPES['warning']} cut short")
        if kept.verdict:
            lines.append(f"{SHAPES[kind]} {kept.verdict}")
        item = QTreeWidgetItem(["\n".join(lines)])
        item.setData(0, Qt.ItemDataRole.UserRole, str(kept.folder))
        item.setToolTip(0, f"{kept.folder}\n{kept.cut_short}".strip())
        if self._bench.recording == kept.recording:
            font = item.font(0)
            font.setBold(True)
            item.setFont(0, font)
            item.setForeground(0, QColor(theme.accent))
        return item

    def _show_buttons(self) -> None:
        for button in (self.open_button, self.reveal_button, self.delete_button):
            button.setEnabled(self.chosen is not None)
        self.undo_button.setVisible(self._folders.can_undo)

    @property
    def chosen(self) -> Path | None:
        """Folder of the session that is chosen."""
        items = self.table.selectedItems()
        return Path(items[0].data(0, Qt.ItemDataRole.UserRole)) if items else None

    def choose(self, folder: Path | None) -> None:
        """Choose a session by its folder."""
        for row in range(self.table.topLevelItemCount()):
            item = self.table.topLevelItem(row)
            if item is not None and item.data(0, Qt.ItemDataRole.UserRole) == str(folder):
                item.setSelected(True)

    # --- actions ---------------------------------------------------------------------------------

    def _add_actions(self) -> None:
        for action in (
            Action(
                "sessions.open",
                "Open the chosen session",
                "Session",
                self.open,
                "its recording, in the timeline",
                arguments=("folder",),
            ),
            Action(
                "sessions.reveal",
                "Show the chosen session's folder",
                "Session",
                self.reveal,
                "in the file manager",
                arguments=("folder",),
            ),
            Action(
                "sessions.delete",
                "Delete the chosen session",
                "Session",
                self.delete,
                "it can come back until the studio is closed",
                arguments=("folder",),
            ),
            Action(
                "sessions.undo_delete",
                "Undo deleting a session",
                "Session",
                self.undo_delete,
                "the last one that was deleted comes back",
                available=lambda: self._folders.can_undo,
            ),
        ):
            self._bench.actions.add(action)

    def open(self, folder: str = "") -> None:
        """Open its recording."""
        self._bench.perform("timeline.open", path=str(self._session(folder).recording))

    def reveal(self, folder: str = "") -> None:
        """Show its folder in the file manager."""
        kept = self._session(folder)
        QDesktopServices.openUrl(QUrl.fromLocalFile(str(kept.folder.absolute())))

    def delete(self, folder: str = "") -> None:
        """Delete it; a recording that is open is closed first."""
        bench, kept = self._bench, self._session(folder)
        if bench.recording is not None and bench.recording.is_relative_to(kept.folder):
            bench.open_recording(None)
        self._folders.delete(kept.folder)
        bench.say("info", f"deleted {kept.folder.name}; it can come back until the studio closes")
        self.refresh()

    def undo_delete(self) -> None:
        """Bring back the last one that was deleted."""
        folder = self._folders.undo_delete()
        self._bench.say("info", f"{folder.name} is back")
        self.refresh()
        self.choose(folder)

    def _session(self, folder: str) -> KeptSession:
        wanted = Path(folder) if folder else self.chosen
        if wanted is None:
            raise ValueError("sessions: none is chosen; choose one in the list, or name its folder")
        kept = self._kept.get(wanted)
        if kept is None:
            raise ValueError(f"{wanted}: no such session in the list")
        return kept
