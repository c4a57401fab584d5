"""The bottom of the window: the last line, the frame, and what is going on."""

from __future__ import annotations

from PySide6.QtWidgets import QLabel, QStatusBar

from studio.app.model.runs.session_run import SessionRun
from studio.app.model.workbench import Topic, Workbench
from studio.app.shell.theme import SHAPES


class StatusLine:
    """Follows the bench.

    Args:
        bench: whose log and session are shown.
        run: plays the sessions.
        bar: where it is shown.
    """

    def __init__(self, bench: Workbench, run: SessionRun, bar: QStatusBar) -> None:
        self._bench, self._run = bench, run
        self._line, self._state, self._count = QLabel("opening …"), QLabel(), QLabel()
        bar.addWidget(self._line, 1)
        bar.addPermanentWidget(self._count)
        bar.addPermanentWidget(self._state)
        bench.listen(Topic.SESSION, self._on_session)
        bench.listen(Topic.RECORDING, self._on_session)
        bench.listen(Topic.LOG, self._on_log)
        bench.listen(Topic.DOCUMENT, self._on_change)

    @property
    def text(self) -> str:
        """The line."""
        return self._line.text()

    def say(self, text: str) -> None:
        """Show a line that is in no log."""
        self._line.setText(text)

    def _on_session(self) -> None:
        run = self._run
        self._line.setText(run.line)
        text = ""  # the time of a recording stands over the timeline, and nowhere else
        if run.is_playing and run.output is not None:
            frame = run.output.input.frame
            text = f"{frame.t_ns / 1e9:6.1f} s   frame {frame.seq:5d}"
        self._count.setText(text)
        kind = "good" if run.is_playing else "calm"
        words = str(self._bench.standing.mode) if not run.is_opening else "opening"
        self._state.setText(f"{SHAPES[kind]} {words}")

    def _on_change(self) -> None:
        """Something was done since: what could not be done before is over."""
        lines = self._bench.log.lines()
        if lines and lines[-1].level == "error" and lines[-1].text in self._line.text():
            self._line.setText(self._run.line)

    def _on_log(self) -> None:
        line = self._bench.log.lines()[-1]
        shape = {"info": "", "warning": "▲ ", "error": "✖ "}[line.level]
        self._line.setText(shape + line.text)
        self._line.setToolTip(line.text)
