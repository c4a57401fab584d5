"""Which tracker follows the objects in the next session, and with which settings."""

from __future__ import annotations

from PySide6.QtWidgets import QCheckBox, QComboBox, QHBoxLayout, QLabel, QVBoxLayout, QWidget

from studio.app.devices.tracker_options import TrackerOptionsForm
from studio.app.model.workbench import Topic, Workbench

TITLES = {"own": "this program's", "paper": "the paper's"}
"""What people read of the built-in trackers."""


class TrackerPanel(QWidget):
    """The choice of the tracker.

    Args:
        bench: whose document has it.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self._bench = bench
        self.names = QComboBox()
        self.names.setAccessibleName("Tracker of the next session")
        self.names.activated.connect(self._choose)
        self.beside = QCheckBox("this program's too")
        self.beside.setToolTip("run this program's tracker too: report and timeline show both")
        self.beside.clicked.connect(self._choose)
        self.note = QLabel()
        self.note.setWordWrap(True)
        row = QHBoxLayout()
        row.addWidget(QLabel("Tracker"))
        row.addWidget(self.names, 1)
        row.addWidget(self.beside)
        layout = QVBoxLayout(self)
        layout.setContentsMargins(0, 0, 0, 0)
        layout.addLayout(row)
        layout.addWidget(self.note)
        self.options = TrackerOptionsForm(bench)
        layout.addWidget(self.options)
        bench.listen(Topic.DOCUMENT, self.refresh)
        bench.listen(Topic.OFFERED, self.refresh)
        self.refresh()

    def refresh(self) -> None:
        """Show the trackers that there are, and the one that is chosen."""
        choice, offered = self._bench.document.tracker, self._bench.offered.trackers
        known = [*TITLES, *offered]
        is_missing = choice.name not in known
        names = [*known, choice.name] if is_missing else known
        if [self.names.itemData(row) for row in range(self.names.count())] != names:
            self.names.clear()
            for name in names:
                self.names.addItem(TITLES.get(name, f"{name} (plug-in)"), name)
        self.names.setCurrentIndex(names.index(choice.name))
        self.beside.setChecked(choice.is_beside)
        self.beside.setEnabled(choice.name != "own")
        self.options.setVisible(choice.name == "own" or choice.is_beside)
        self.note.setText(f"▲ no plug-in offers {choice.name!r} now" if is_missing else "")
        self.note.setVisible(is_missing)

    def close_panel(self) -> None:
        """No longer follow the bench."""
        self._bench.stop_listening(self.refresh)
        self.options.close_form()

    def _choose(self) -> None:
        values = {"name": self.names.currentData(), "beside": self.beside.isChecked()}
        if not self._bench.do("tracker.choose", **values):
            self.refresh()
