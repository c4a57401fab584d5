"""Layouts of the docks: kept as shares of the window, so that they fit a window of any size."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import PySide6QtAds as ads
from PySide6.QtCore import QByteArray, Qt
from PySide6.QtWidgets import QSplitter, QToolButton, QWidget

from studio.app.shell.docking.docks import DOCKS

Shares = Sequence[Sequence[float]]
"""Of each splitter, from the outermost inwards, the share of each of its parts."""

FIRST_SHARES: Shares = ((0.69, 0.31), (0.18, 0.47, 0.35))
"""Of a first window: views and docks above the timeline; left docks, views, right docks."""

LEFT, RIGHT, BOTTOM = ads.LeftDockWidgetArea, ads.RightDockWidgetArea, ads.BottomDockWidgetArea
AREAS = {"left": LEFT, "right": RIGHT, "bottom": BOTTOM}
"""The library's name of each side."""


@dataclass(frozen=True, slots=True)
class Layout:
    """Places of the docks.

    Attributes:
        state: as the docks' library has it.
        shares: of the window; none where they are not known.
    """

    state: bytes
    shares: Shares = ()

    @classmethod
    def of(cls, manager: Any) -> Layout:
        """The layout of a window as it is."""
        shares: list[list[float]] = []
        for splitter in _splitters(manager.rootSplitter()):
            sizes = splitter.sizes()
            shares.append([size / max(sum(sizes), 1) for size in sizes])
        return cls(bytes(manager.saveState().data()), shares)

    @classmethod
    def from_text(cls, text: str) -> Layout:
        """A layout of the settings; older ones have no shares.

        Raises:
            ValueError: it is damaged.
        """
        if not text.startswith("{"):
            return cls(base64.b64decode(text))
        try:
            values = json.loads(text)
            shares = [[float(share) for share in parts] for parts in values["shares"]]
            return cls(base64.b64decode(values["state"]), shares)
        except (KeyError, TypeError) as error:
            raise ValueError(f"the layout is damaged: {error!r}") from None

    def text(self) -> str:
        """As the settings have it; `from_text` gives the same."""
        shares = [[round(share, 4) for share in parts] for parts in self.shares]
        return json.dumps({"state": base64.b64encode(self.state).decode(), "shares": shares})

    def show(self, manager: Any) -> None:
        """Arrange a window's docks so."""
        manager.restoreState(QByteArray(self.state))
        splitters = _splitters(manager.rootSplitter())
        for splitter, parts in zip(splitters, self.shares, strict=False):
            if len(parts) == splitter.count():
                is_level = splitter.orientation() == Qt.Orientation.Horizontal
                length = splitter.width() if is_level else splitter.height()
                splitter.setSizes([round(share * length) for share in parts])


def add_dock_again(manager: Any) -> None:
    """Give windows of floating docks a button that takes them back to where they began."""
    sides = {dock.id: dock.side for dock in DOCKS}

    def take_back(floating: Any) -> None:
        for widget in floating.dockWidgets():
            side = sides.get(widget.objectName(), "right")
            beside = [
                each
                for each in manager.dockWidgetsMap().values()
                if sides.get(each.objectName()) == side
                and not each.isClosed()
                and not each.isInFloatingContainer()
            ]
            if beside:
                manager.addDockWidgetTabToArea(widget, beside[0].dockAreaWidget())
            else:
                manager.addDockWidget(AREAS[side], widget)
            widget.toggleView(True)
            widget.setAsCurrentTab()

    def add(floating: Any) -> None:
        close = floating.findChild(QWidget, "floatingTitleCloseButton")
        if close is None:
            return  # the window manager draws the title
        bar = close.parentWidget()
        again = QToolButton(bar)
        again.setObjectName("floatingTitleDockButton")
        again.setAccessibleName("Dock again")
        again.setToolTip("Dock again: take it back into the window")
        again.clicked.connect(partial(take_back, floating))
        bar.layout().insertWidget(bar.layout().indexOf(close) - 1, again)

    manager.floatingWidgetCreated.connect(add)


def _splitters(root: Any) -> Iterator[QSplitter]:
    """A splitter and those in it, from the outermost inwards."""
    yield root
    for index in range(root.count()):
        part = root.widget(index)
        if isinstance(part, ads.CDockSplitter):
            yield from _splitters(part)
