"""Height of the timeline: low while it has nothing to show, until it has or a hand changes it."""

from __future__ import annotations

from typing import Any

from PySide6.QtCore import Qt
from PySide6.QtWidgets import QSplitter

from studio.app.model.workbench import Topic, Workbench
from studio.app.shell.docking.layouts import FIRST_SHARES

EMPTY_PX = 114
"""Height of its tab, its buttons and one line of words, at the system's size of text."""

RAISED_PX = 260
"""Least height with a recording, at that size of text: two rows, the curves and the legend."""

MAX_SHARE = 0.5
"""Of the window's docks: what the raised timeline takes at most."""

SLACK_PX = 2
"""A height that differs by more was chosen by hand."""

PLAY = "timeline.play"
"""The action that is available as soon as there is something to look at."""


class TimelineHeight:
    """Lowers the empty timeline of a first layout, and raises it to its share once it is needed.

    A timeline that stands as low as it was made here is raised; any other height is the user's.

    Args:
        bench: whose sessions and recordings need it.
        dock: the timeline's, as the docks' library has it.
    """

    def __init__(self, bench: Workbench, dock: Any) -> None:
        self._bench, self._dock = bench, dock
        self._low_px = self._wanted_px
        for topic in (Topic.RECORDING, Topic.SESSION):
            bench.listen(topic, self._raise_if_needed)
        bench.listen(Topic.SETTINGS, self._follow_text)

    def lower(self) -> None:
        """Make it low, unless there is something to look at."""
        if not self._is_needed:
            self._low_px = self._wanted_px
            self._set_height(self._low_px)

    @property
    def _text_scale(self) -> float:
        return self._bench.settings.text_scale

    @property
    def _wanted_px(self) -> int:
        return round(EMPTY_PX * self._text_scale)

    @property
    def _is_needed(self) -> bool:
        actions = self._bench.actions
        can_play = PLAY in actions and actions.get(PLAY).is_available
        return can_play or self._bench.standing.is_session

    def _is_low(self) -> bool:
        splitter = self._splitter()
        return splitter is not None and abs(self._height(splitter) - self._low_px) <= SLACK_PX

    def _raise_if_needed(self) -> None:
        splitter = self._splitter()
        if splitter is not None and self._is_needed and self._is_low():
            whole_px = sum(splitter.sizes())
            wanted_px = max(FIRST_SHARES[0][1] * whole_px, RAISED_PX * self._text_scale)
            self._set_height(round(min(wanted_px, MAX_SHARE * whole_px)))

    def _follow_text(self) -> None:
        if self._low_px != self._wanted_px and self._is_low():
            self.lower()

    def _splitter(self) -> QSplitter | None:
        """The splitter that has views above and the timeline below; None elsewhere."""
        area = self._dock.dockAreaWidget()
        splitter = None if area is None else area.parentWidget()
        if not isinstance(splitter, QSplitter) or splitter.count() != 2:
            return None
        is_below = splitter.orientation() == Qt.Orientation.Vertical and splitter.widget(1) is area
        return splitter if is_below else None

    def _height(self, splitter: QSplitter) -> int:
        return splitter.sizes()[1]

    def _set_height(self, height_px: int) -> None:
        splitter = self._splitter()
        if splitter is not None:
            splitter.setSizes([sum(splitter.sizes()) - height_px, height_px])
