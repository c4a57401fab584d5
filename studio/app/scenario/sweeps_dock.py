"""The sweeps panel: faults with their sizes, how far a sweep is, its table, and any run of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from PySide6.QtCore import Qt, QTimer, QUrl
from PySide6.QtGui import QCloseEvent, QDesktopServices
from PySide6.QtWidgets import (
    QComboBox,
    QHeaderView,
    QLabel,
    QProgressBar,
    QPushButton,
    QSpinBox,
    QTabWidget,
    QTreeWidget,
    QTreeWidgetItem,
    QVBoxLayout,
    QWidget,
)

from studio.app.model.actions import Action
from studio.app.model.documents.arranged import arranged_text
from studio.app.model.jobs.scene_job import SceneJob
from studio.app.model.runs.session_folders import SessionFolders
from studio.app.model.workbench import Topic, Workbench
from studio.app.preparation.child import Child
from studio.app.preparation.stage_lines import stages_of
from studio.app.scenario.asked_sweep import (
    OFFERED,
    found_rows,
    kept_sweeps,
    new_folder,
    runs_of,
    scene_of,
    sizes_of,
    sweep_values,
    write_sweep,
)
from studio.app.scenario.text.editing import ScenarioEditing
from studio.app.shell.questions import ask_file
from studio.app.shell.theme import SHAPES
from studio.app.shell.wrapping import WrappingRow, together

POLL_MS = 300
MIN_PX = 90
"""Height of a table in the lowest window."""
MAX_SEEDS = 50
WHAT = (
    "How large may a fault be until tracking suffers? The open scenario is played without a fault, "
    "then with each ticked fault in each of its sizes."
)
AGAIN = "A run keeps its figures only: it is played again, the same to the bit, and recorded."
COLUMNS = (
    ("Fault", None, 1.0),
    ("Size", None, 1.0),
    ("Seed", None, 1.0),
    ("Off, cm", "world_cm_mean", 1.0),
    ("to 95 %", "world_cm_p95", 1.0),
    ("Turned, °", "yaw_deg_mean", 1.0),
    ("Lost, %", "lost_share", 100.0),
)
"""Of the table: title, key of a run's row, factor."""
RUN = Qt.ItemDataRole.UserRole


class SweepsDock(QWidget):
    """Faults to tick, start and cancel, the table, and its runs.

    Args:
        bench: whose scenario is swept, and whose session plays a run of it.
    """

    def __init__(self, bench: Workbench) -> None:
        super().__init__()
        self._bench = bench
        folders = bench.shared(SessionFolders)
        assert folders is not None
        self._folders = folders
        self.folder: Path | None = None
        """Of the sweep that is shown."""
        self._child: Child | None = None
        self._rows: list[dict[str, Any]] = []
        self.tabs = QTabWidget()
        self.faults = _table(("Fault", "Sizes"))
        for each in OFFERED:
            item = QTreeWidgetItem([each.words, ", ".join(f"{size:g}" for size in each.usual)])
            item.setFlags(item.flags() | Qt.ItemFlag.ItemIsEditable)
            item.setCheckState(0, Qt.CheckState.Unchecked)
            self.faults.addTopLevelItem(item)
        self.faults.itemClicked.connect(self._edit_size)
        self.seeds = QSpinBox()
        self.seeds.setRange(1, MAX_SEEDS)
        self.seeds.setAccessibleName("Runs of each size")
        self.start_button = self._button("Start the sweep", "sweep.start")
        self.file_button = self._button("Of a file …", "sweep.start_file")
        self.cancel_button = self._button("Cancel", "sweep.cancel")
        self.bar, self.line = QProgressBar(), QLabel()
        self.line.setWordWrap(True)
        self.choice = QComboBox()
        self.choice.setAccessibleName("Sweeps that were played")
        self.choice.setMinimumContentsLength(10)
        self.choice.activated.connect(self._choose)
        self.table = _table(tuple(title for title, *_ in COLUMNS))
        self.table.itemSelectionChanged.connect(self._show_buttons)
        self.table.itemDoubleClicked.connect(lambda *_: bench.do("sweep.play_run"))
        self.run_button = self._button("Open this run", "sweep.play_run")
        self.run_button.setToolTip(AGAIN)
        self.page_button = self._button("Show the page", "sweep.open_page")
        self._lay_out()
        self._add_actions()
        for topic in (Topic.OPENED, Topic.SESSION, Topic.DOCUMENT):
            bench.listen(topic, self._show_buttons)
        self._timer = QTimer(self)
        self._timer.timeout.connect(self.refresh)
        self._timer.start(POLL_MS)
        self._list_sweeps()
        self.refresh()

    def _lay_out(self) -> None:
        what = QLabel(WHAT)
        what.setObjectName("faint")
        what.setWordWrap(True)
        asked, runs = QWidget(), QWidget()
        layout = QVBoxLayout(asked)
        layout.addWidget(what)
        layout.addWidget(self.faults, 1)
        layout.addLayout(WrappingRow((together(QLabel("Runs of each size"), self.seeds),)))
        layout.addLayout(WrappingRow((self.start_button, self.file_button)))
        layout = QVBoxLayout(runs)
        layout.addWidget(self.choice)
        layout.addWidget(self.line)
        layout.addWidget(self.bar)
        layout.addWidget(self.table, 1)
        layout.addLayout(WrappingRow((self.cancel_button, self.run_button, self.page_button)))
        self.tabs.setDocumentMode(True)
        self.tabs.addTab(asked, "Faults")
        self.tabs.addTab(runs, "Runs")
        whole = QVBoxLayout(self)
        whole.setContentsMargins(0, 0, 0, 0)
        whole.addWidget(self.tabs)

    def _button(self, words: str, action_id: str) -> QPushButton:
        button = QPushButton(words)
        button.clicked.connect(lambda: self._bench.do(action_id))
        return button

    def _edit_size(self, item: QTreeWidgetItem, column: int) -> None:
        if column == 1:
            self.faults.editItem(item, column)

    # --- actions ---------------------------------------------------------------------------------

    def _add_actions(self) -> None:
        def is_free() -> bool:
            return self._child is None

        for action_id, title, run, hint, arguments, available in (
            ("start", "Start a sweep", self.start, "of the ticked faults", (), is_free),
            ("start_file", "Start a sweep of a file", self.start_file, "TOML", ("path",), is_free),
            ("cancel", "Cancel the sweep", self.cancel, "", (), lambda: not is_free()),
            ("play_run", "Open a run of the sweep", self.play_run, AGAIN, ("run",), self._can_play),
            ("open_page", "Show the sweep's page", self.open_page, "plots", (), self._has_page),
        ):
            more = {"arguments": arguments, "available": available}
            self._bench.actions.add(
                Action(f"sweep.{action_id}", title, "Session", run, hint, **more)
            )

    def start(self) -> None:
        """Sweep the open scenario, as it is arranged, with the faults that are ticked.

        Raises:
            ValueError: no fault is ticked, a size is no number, or a sweep runs.
            OSError: the disk is full.
        """
        self._check_free()
        bench, editing = self._bench, self._bench.shared(ScenarioEditing)
        if editing is None:
            raise ValueError("the scenario is not there yet: show the dock Scenario first")
        ticked = {
            each.name: sizes_of(item.text(1), each.words)
            for each, item in zip(OFFERED, self._items(), strict=True)
            if item.checkState(0) is Qt.CheckState.Checked
        }
        ids = [item.object_id for item in bench.scene.objects] if bench.scene is not None else []
        chosen = bench.selection if bench.selection in ids else next(iter(ids), "")
        name = editing.name
        values = sweep_values(f"{name}.toml", ticked, seeds=self.seeds.value(), object_id=chosen)
        arranged = arranged_text(bench.document.twin)
        text = f"{editing.text.rstrip()}\n\n{arranged}" if arranged else editing.text
        self._begin(name, text, values)

    def start_file(self, path: str = "") -> None:
        """Sweep what a file says, see `nexus rehearse --sweep`; without a path, ask for one.

        Raises:
            ValueError: a sweep runs, or the file is no sweep.
            OSError: the folder cannot be made.
        """
        import tomllib

        from sim.scenarios.scenario import load_scenario
        from studio.sweep.plan import load_sweep

        self._check_free()
        chosen = path or ask_file(self, "Start a sweep", "Sweeps (*.toml)", False)
        if not chosen:
            return
        plan = load_sweep(chosen, self._bench.document.scene)
        file = Path(chosen)
        values = tomllib.loads(file.read_text(encoding="utf-8-sig"))
        beside = file.parent / str(values["sweep"]["scenario"])
        scenario = load_scenario(beside if beside.is_file() else plan.scenario_name)
        values["sweep"]["scenario"] = f"{plan.scenario_name}.toml"
        text = Path(scenario.source).read_text(encoding="utf-8-sig")
        self._begin(plan.scenario_name, text, values)

    def _begin(self, name: str, scenario: str, values: dict[str, Any]) -> None:
        bench = self._bench
        room = Path(bench.document.scene).stem
        folder = new_folder(self._folders.root_of(bench.project), f"{room}_{name}")
        file = write_sweep(folder, name, scenario, values)
        words = ["rehearse", bench.document.scene, "--sweep", str(file), "--out", str(folder)]
        self._child = Child(words)
        bench.busy.add("sweep")
        self._list_sweeps()
        self.show_sweep(folder)
        self.line.setText("beginning …")
        self.tabs.setCurrentIndex(1)
        self.refresh()

    def cancel(self) -> None:
        """Ask the sweep to end; runs that are whole stay, and are not played again."""
        if self._child is not None:
            self._child.cancel()

    def play_run(self, run: str = "") -> None:
        """Play a run again, recorded, and open it.

        Raises:
            ValueError: none is chosen, there is none of that name, or a session plays.
            OSError: its scenario cannot be written.
        """
        from studio.session.plan import SessionPlan
        from studio.sweep.results import RUNS

        name, session = run or self._chosen(), self._bench.session
        if session is None or self.folder is None or not name:
            raise ValueError("sweep: no run is chosen; choose a line of its table")
        if session.is_playing:
            raise ValueError("a session is playing already: stop it first")
        runs = runs_of(self.folder, scene_of(self.folder) or self._bench.document.scene)
        if name not in runs:
            raise ValueError(f"sweep: no run {name!r}, wanted one of {', '.join(runs)}")
        found = runs[name]
        scenario = self.folder / RUNS / f"{name}.toml"
        scenario.write_text(found.scenario, encoding="utf-8")
        plan = SessionPlan(found.scene, str(scenario), found.seed, methods=found.methods)
        folder = session.new_folder("sweep", name)
        session.play(SceneJob(plan.scene, plan, folder, keeps=True))

    def open_page(self) -> None:
        """Show the sweep's plots in the browser."""
        page = self._page()
        if page is None:
            raise ValueError("the page is written at the end of a sweep")
        QDesktopServices.openUrl(QUrl.fromLocalFile(str(page.absolute())))

    def _check_free(self) -> None:
        if self._child is not None:
            raise ValueError("a sweep is being played: wait for it, or cancel it")

    # --- what is seen ----------------------------------------------------------------------------

    def show_sweep(self, folder: Path) -> None:
        """Show the table of a sweep's folder."""
        self.folder, self._rows = folder, []
        self.choice.setCurrentIndex(self.choice.findData(str(folder)))
        self.table.clear()
        self._take_rows()

    def refresh(self) -> None:
        """Take what the process has left."""
        child = self._child
        if child is not None:
            stages = stages_of(child.said())
            if stages:
                self.bar.setValue(round(100 * stages[-1].done))
                self.line.setText(f"{stages[-1].name} … {stages[-1].note}")
            self._take_rows()
            if not child.is_running:
                self._end(child)
        self.bar.setVisible(self._child is not None)
        self._show_buttons()

    def _end(self, child: Child) -> None:
        self._child = None
        self._bench.busy.discard("sweep")
        if child.is_cancelled:
            words, level = "cancelled: the runs in the table are whole", "warning"
        elif child.code:
            words, level = next(iter(child.said()[-1:]), f"ended with status {child.code}"), "error"
        else:
            words, level = f"{len({row['run'] for row in self._rows})} runs played", "info"
        shape = {"info": "good", "warning": "warning", "error": "bad"}[level]
        self.line.setText(f"{SHAPES[shape]} {words}")
        self._bench.say(level, f"sweep: {words}")

    def _take_rows(self) -> None:
        if self.folder is None:
            return
        rows = found_rows(self.folder)
        if len(rows) == len(self._rows):
            return
        self._rows = rows
        chosen = self._chosen()
        self.table.clear()
        titles = {each.name: each.words for each in OFFERED}
        for row in sorted(
            rows, key=lambda row: (row["fault"] != "none", row["fault"], row["size"])
        ):
            fault = titles.get(row["fault"], row["fault"].replace("_", " "))
            is_without = row["fault"] == "none"
            cells = ["without", ""] if is_without else [fault, f"{row['size']:g}"]
            cells.append(f"{row['seed']}")
            for _, key, factor in COLUMNS[3:]:
                value = row.get(str(key))
                cells.append("-" if value is None else f"{factor * value:.2f}")
            item = QTreeWidgetItem(cells)
            item.setData(0, RUN, row["run"])
            item.setToolTip(0, f"{row['run']}, {row['method']}")
            self.table.addTopLevelItem(item)
            item.setSelected(row["run"] == chosen)
        self._show_buttons()

    def _list_sweeps(self) -> None:
        self.choice.clear()
        for folder in kept_sweeps(self._folders.root_of(self._bench.project)):
            self.choice.addItem(folder.name, str(folder))
        self.choice.setVisible(self.choice.count() > 0)
        if self.folder is None and self.choice.count():
            self.show_sweep(Path(self.choice.itemData(0)))

    def _choose(self, _row: int) -> None:
        self.show_sweep(Path(self.choice.currentData()))

    def _items(self) -> list[QTreeWidgetItem]:
        found = (self.faults.topLevelItem(k) for k in range(self.faults.topLevelItemCount()))
        return [item for item in found if item is not None]

    def _chosen(self) -> str:
        items = self.table.selectedItems()
        return str(items[0].data(0, RUN)) if items else ""

    def _page(self) -> Path | None:
        from studio.sweep.results import SWEEP_HTML

        page = None if self.folder is None else self.folder / SWEEP_HTML
        return page if page is not None and page.is_file() else None

    def _can_play(self) -> bool:
        session = self._bench.session
        return self.folder is not None and session is not None and not session.is_playing

    def _has_page(self) -> bool:
        return self._page() is not None

    def _show_buttons(self) -> None:
        is_free = self._child is None
        self.start_button.setEnabled(is_free and self._bench.scene is not None)
        self.file_button.setEnabled(is_free and self._bench.scene is not None)
        self.cancel_button.setEnabled(not is_free)
        self.run_button.setEnabled(bool(self._chosen()) and self._can_play())
        self.page_button.setEnabled(self._has_page())

    def closeEvent(self, event: QCloseEvent) -> None:
        """A sweep ends with the window; its whole runs stay."""
        self._timer.stop()
        self._bench.stop_listening(self._show_buttons)
        self.cancel()
        event.accept()


def _table(titles: tuple[str, ...]) -> QTreeWidget:
    table = QTreeWidget()
    table.setHeaderLabels(list(titles))
    table.setRootIsDecorated(False)
    table.setMinimumHeight(MIN_PX)
    table.setEditTriggers(QTreeWidget.EditTrigger.NoEditTriggers)
    table.header().setSectionResizeMode(QHeaderView.ResizeMode.ResizeToContents)
    return table
