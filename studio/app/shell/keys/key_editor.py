"""The dock in which keys are changed."""

from __future__ import annotations

from PySide6.QtCore import Qt
from PySide6.QtGui import QKeySequence
from PySide6.QtWidgets import (
    QComboBox,
    QHBoxLayout,
    QHeaderView,
    QKeySequenceEdit,
    QLabel,
    QLineEdit,
    QPushButton,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from studio.app.model.actions import matching
from studio.app.model.keys import PRESETS, clashes, keys_of
from studio.app.model.workbench import Topic, Workbench


class KeyEditor(QWidget):
    """Actions with their keys; the chosen action's keys are typed below the list."""

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self._bench = bench
        self.preset = QComboBox()
        self.preset.addItems(list(PRESETS))
        self.preset.setAccessibleName("key preset")
        self.preset.textActivated.connect(lambda name: bench.set(key_preset=name))
        self.search = QLineEdit()
        self.search.setPlaceholderText("Search")
        self.search.textChanged.connect(self._fill)
        self.list = QTreeWidget()
        self.list.setHeaderLabels(["Action", "Keys"])
        self.list.setRootIsDecorated(False)
        # Long titles end in dots; keys are never cut.
        self.list.header().setStretchLastSection(False)
        self.list.header().setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        self.list.header().setSectionResizeMode(1, QHeaderView.ResizeMode.ResizeToContents)
        self.list.currentItemChanged.connect(self._chosen)
        self.edit = QKeySequenceEdit()
        self.edit.setMaximumSequenceLength(1)
        self.edit.editingFinished.connect(self._take)
        usual = QPushButton("Usual keys")
        usual.setToolTip("give this action the keys of the preset again")
        usual.clicked.connect(lambda: self._set(None))
        self._note = QLabel()
        self._note.setWordWrap(True)
        top, bottom = QHBoxLayout(), QHBoxLayout()
        top.addWidget(QLabel("Preset"))
        top.addWidget(self.preset)
        top.addWidget(self.search, 1)
        bottom.addWidget(QLabel("New keys"))
        bottom.addWidget(self.edit, 1)
        bottom.addWidget(usual)
        layout = QVBoxLayout(self)
        layout.addLayout(top)
        layout.addWidget(self.list, 1)
        layout.addLayout(bottom)
        layout.addWidget(self._note)
        self._hint = QLabel("Choose an action, click into the field and press its new keys.")
        self._hint.setObjectName("faint")
        self._hint.setWordWrap(True)
        layout.addWidget(self._hint)
        bench.listen(Topic.SETTINGS, self._fill)
        self._fill()

    def _fill(self, _typed: str = "") -> None:
        settings = self._bench.settings
        self.preset.setCurrentText(settings.key_preset)
        chosen = self._action_id()
        self.list.clear()
        for action in matching(self._bench.actions, self.search.text()):
            if action.arguments and not keys_of(action, settings):
                continue
            item = QTreeWidgetItem([f"{action.group}: {action.title}", keys_of(action, settings)])
            item.setData(0, Qt.ItemDataRole.UserRole, action.id)
            self.list.addTopLevelItem(item)
            if action.id == chosen:
                self.list.setCurrentItem(item)
        self.list.resizeColumnToContents(0)
        double = clashes(self._bench.actions, settings)
        self._note.setText(
            "; ".join(
                f"▲ {keys}: {' and '.join(a.title for a in actions)}"
                for keys, actions in double.items()
            )
        )

    def _action_id(self) -> str:
        item = self.list.currentItem()
        return "" if item is None else item.data(0, Qt.ItemDataRole.UserRole)

    def _chosen(self) -> None:
        item = self.list.currentItem()
        self.edit.setKeySequence(QKeySequence("" if item is None else item.text(1)))

    def _take(self) -> None:
        sequence = self.edit.keySequence().toString(QKeySequence.SequenceFormat.PortableText)
        self._set(sequence)

    def _set(self, sequence: str | None) -> None:
        action_id = self._action_id()
        if not action_id:
            return
        keys = {k: v for k, v in self._bench.settings.keys.items() if k != action_id}
        if sequence is not None:
            keys[action_id] = sequence
        if keys != dict(self._bench.settings.keys):
            self._bench.set(keys=keys)
