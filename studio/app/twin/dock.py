"""The twin's dock: what is in the room, its numbers, and the physics."""

from __future__ import annotations

import qtawesome
from PySide6.QtCore import QEvent, QSignalBlocker, Qt, QTimer
from PySide6.QtGui import QPalette, QResizeEvent
from PySide6.QtWidgets import (
    QFileDialog,
    QFrame,
    QHeaderView,
    QLabel,
    QMenu,
    QScrollArea,
    QSplitter,
    QToolButton,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from devices.clock import Clock, WallClock
from studio.app.model.workbench import Topic, Workbench
from studio.app.shell.wrapping import WrappingRow
from studio.app.twin.edits import ItemKind
from studio.app.twin.hand import TwinPhysics
from studio.app.twin.inspector import Inspector
from studio.app.twin.items import TITLES, TwinItem, items_of
from studio.app.twin.mesh_file import SUFFIXES
from studio.app.twin.twin_actions import add_twin_actions

POLL_MS = 16
"""Between two looks at the physics: a picture of 60 Hz."""
TREE_ROWS = 6
"""Lines of the tree that are seen in the lowest window."""
STATE_SHARE = 0.45
"""Most of the tree's width that states take; names are read first."""
NARROW = 22
"""Letters of the tree's width below which names take all of it."""
SHOW_MS = 80
"""Between two changes of the numbers while objects move: faster, nobody reads them."""
ICONS = {
    ItemKind.OBJECT: "mdi6.chair-rolling",
    ItemKind.PRIMITIVE: "mdi6.cube-outline",
    ItemKind.PROPOSAL: "mdi6.cube-send",
    ItemKind.AVATAR: "mdi6.account-outline",
    ItemKind.CAMERA: "mdi6.video-outline",
    ItemKind.SURFACE: "mdi6.vector-square",
    ItemKind.ANNOTATION: "mdi6.draw",
    ItemKind.MESH: "mdi6.vector-triangle",
}
"""Of each kind, beside its heading's words."""
ADDITIONS = (
    ("Box", "twin.add_primitive", {"shape": "box"}),
    ("Ball", "twin.add_primitive", {"shape": "ball"}),
    ("Cylinder", "twin.add_primitive", {"shape": "cylinder"}),
    ("Person here", "twin.add_avatar", {"role": "local"}),
    ("Person elsewhere", "twin.add_avatar", {"role": "remote"}),
    ("Camera", "twin.add_camera", {}),
    ("Mesh from a file …", "twin.add_mesh", {}),
)
"""Entries of the Add menu: title, action, and its arguments."""
NOTHING = "Click an object in the view or in the list: its place and numbers are shown here."
HINT = "In the view: hold Ctrl and drag an object to move it by physics; let go to throw it."


class TwinDock(QWidget):
    """Tree of the twin's items, the selected one's numbers below, physics at the bottom.

    Args:
        bench: whose twin it is.
        clock: of the physics.
    """

    def __init__(self, bench: Workbench, *, clock: Clock | None = None) -> None:
        super().__init__()
        self._bench = bench
        self.physics = TwinPhysics(bench, clock or WallClock())
        bench.grabbing = self.physics
        self._editing = add_twin_actions(bench, self.physics, _ask_mesh)
        self.tree = QTreeWidget()
        self.inspector = Inspector(bench)
        self.add = QToolButton()
        self.run = QToolButton()
        self.hint, self.nothing = QLabel(), QLabel(NOTHING)
        self._items: dict[str, TwinItem] = {}
        self._rows: dict[str, QTreeWidgetItem] = {}
        self._shape: tuple[tuple[str, ItemKind, str], ...] | None = None
        self._is_stale = True
        self._lay_out()
        for topic in (Topic.DOCUMENT, Topic.STATE, Topic.SCENE):
            bench.listen(topic, self._mark)
        bench.listen(Topic.SELECTION, self.refresh)
        self._poll_timer = QTimer(self)
        self._poll_timer.timeout.connect(self._poll)
        self._poll_timer.start(POLL_MS)
        self._show_timer = QTimer(self)
        self._show_timer.timeout.connect(self._show_if_stale)
        self._show_timer.start(SHOW_MS)
        self.refresh()

    def _lay_out(self) -> None:
        self.tree.setColumnCount(2)
        self.tree.setHeaderLabels(["Item", "State"])
        self.tree.setRootIsDecorated(True)
        self.tree.setIndentation(14)
        self.tree.setUniformRowHeights(True)
        header = self.tree.header()
        header.setStretchLastSection(False)
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        header.setSectionResizeMode(1, QHeaderView.ResizeMode.Fixed)
        self.tree.currentItemChanged.connect(self._pick)
        self.add.setText("Add")
        self.add.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self.add.setPopupMode(QToolButton.ToolButtonPopupMode.InstantPopup)
        menu = QMenu(self.add)
        for title, action_id, values in ADDITIONS:
            entry = menu.addAction(title)
            entry.triggered.connect(
                lambda _=False, of=action_id, with_=values: self._bench.do(of, **with_)
            )
        self.add.setMenu(menu)
        self.run.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
        self.run.clicked.connect(lambda: self._bench.do("twin.physics"))
        bar = WrappingRow((self.add, self.run))
        bar.setContentsMargins(6, 4, 6, 4)
        for label in (self.hint, self.nothing):
            label.setObjectName("faint")
            label.setWordWrap(True)
            label.setContentsMargins(8, 2, 8, 6)
        self.tree.setFrameShape(QFrame.Shape.NoFrame)
        self.area = QScrollArea()
        self.area.setWidgetResizable(True)
        self.area.setFrameShape(QFrame.Shape.NoFrame)
        self.area.setWidget(self.inspector)
        split = QSplitter(Qt.Orientation.Vertical)
        split.addWidget(self.tree)
        split.addWidget(self.area)
        split.setStretchFactor(0, 1)
        split.setStretchFactor(1, 1)
        split.setChildrenCollapsible(False)
        whole = QVBoxLayout(self)
        whole.setContentsMargins(0, 0, 0, 0)
        whole.setSpacing(0)
        whole.addLayout(bar)
        whole.addWidget(split, 1)
        whole.addWidget(self.nothing)
        whole.addWidget(self.hint)
        self._recolour()

    def _size(self) -> None:
        """Rows and columns for the size of the text: names keep most of the width."""
        self.tree.setMinimumHeight(TREE_ROWS * self.fontMetrics().lineSpacing())
        width = self.tree.viewport().width()
        most = round(STATE_SHARE * width)
        # Below, a selected item's state still stands among its numbers.
        self.tree.setColumnHidden(1, width < NARROW * self.fontMetrics().averageCharWidth())
        wanted = max(self.tree.sizeHintForColumn(1), self.tree.header().sectionSizeHint(1))
        self.tree.header().resizeSection(1, min(wanted, most))

    def resizeEvent(self, event: QResizeEvent) -> None:
        """See Qt."""
        super().resizeEvent(event)
        self._size()

    def heightForWidth(self, arg__1: int) -> int:
        """See Qt: what scrolls inside gives way, or the dock would scroll as a whole, too."""
        return self.minimumSizeHint().height()

    # --- what changes ----------------------------------------------------------------------------

    def refresh(self) -> None:
        """Show the bench as it is now."""
        self._is_stale = False
        bench = self._bench
        is_by_hand = bench.is_by_hand or self.physics.is_busy
        found = items_of(bench.scene, bench.document, bench.state, is_by_hand=is_by_hand)
        self._items = {item.item_id: item for item in found}
        shape = tuple((item.item_id, item.kind, item.name) for item in found)
        if shape != self._shape:
            self._shape = shape
            self._build(found)
        for item in found:
            self._rows[item.item_id].setText(1, item.state)
        self._size()
        with QSignalBlocker(self.tree):
            row = self._rows.get(bench.selection)
            if row is None:
                self.tree.clearSelection()
                self.tree.setCurrentItem(None)  # pyright: ignore[reportArgumentType]
            else:
                self.tree.setCurrentItem(row)
        chosen = self._items.get(bench.selection)
        self.inspector.show_item(chosen)
        self.area.setVisible(chosen is not None)
        self.nothing.setVisible(chosen is None)
        self._show_physics()

    def _build(self, found: tuple[TwinItem, ...]) -> None:
        colour = self.palette().color(QPalette.ColorRole.Text)
        with QSignalBlocker(self.tree):
            self.tree.clear()
            self._rows = {}
            for kind, title in TITLES.items():
                of_kind = [item for item in found if item.kind is kind]
                if not of_kind:
                    continue
                group = QTreeWidgetItem([title, str(len(of_kind))])
                group.setFlags(Qt.ItemFlag.ItemIsEnabled)
                self.tree.addTopLevelItem(group)
                for item in of_kind:
                    row = QTreeWidgetItem([item.name, item.state])
                    row.setData(0, Qt.ItemDataRole.UserRole, item.item_id)
                    row.setIcon(0, qtawesome.icon(ICONS[kind], color=colour))
                    row.setToolTip(0, item.item_id)
                    group.addChild(row)
                    self._rows[item.item_id] = row
                group.setExpanded(True)

    def _show_physics(self) -> None:
        is_running = self.physics.is_busy and not self.physics.is_paused
        name = "mdi6.pause" if is_running else "mdi6.play"
        if self.run.property("icon name") != name:
            self.run.setProperty("icon name", name)
            colour = self.palette().color(QPalette.ColorRole.ButtonText)
            self.run.setIcon(qtawesome.icon(name, color=colour))
            self.run.setText("Pause physics" if is_running else "Run physics")
            self.run.setToolTip("objects fall, slide and come to rest, as the mouse moves them")
        why_not = self.physics.why_not
        self.run.setEnabled(not why_not)
        held = self.physics.grabbed
        self.hint.setText(f"○ {why_not}" if why_not else f"▶ holding {held}" if held else HINT)
        self.hint.setVisible(bool(why_not or held) or not self._bench.selection)

    def _pick(self, row: QTreeWidgetItem | None, _before: QTreeWidgetItem | None = None) -> None:
        item_id = None if row is None else row.data(0, Qt.ItemDataRole.UserRole)
        if item_id:
            self._bench.select(str(item_id))

    def _mark(self) -> None:
        self._is_stale = True

    def _show_if_stale(self) -> None:
        if self._is_stale:
            self.refresh()
        else:
            self._show_physics()

    def _poll(self) -> None:
        self.physics.poll()
        self._editing.poll()

    def _recolour(self) -> None:
        colour = self.palette().color(QPalette.ColorRole.ButtonText)
        self.add.setIcon(qtawesome.icon("mdi6.plus", color=colour))
        self.run.setProperty("icon name", "")
        self._shape = None

    def changeEvent(self, event: QEvent) -> None:
        """Draw the icons anew when the theme changes."""
        super().changeEvent(event)
        if event.type() == QEvent.Type.FontChange:
            self._size()
        if event.type() == QEvent.Type.PaletteChange:
            self._recolour()
            self._is_stale = True


def _ask_mesh() -> str:
    kinds = " ".join(f"*{suffix}" for suffix in SUFFIXES)
    return QFileDialog.getOpenFileName(None, "Add a mesh", "", f"Meshes ({kinds})")[0]
