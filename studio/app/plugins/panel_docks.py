"""Docks that hold the panels of plug-ins, as tabs beside the studio's own on the right."""

from __future__ import annotations

from typing import Any, Protocol

import PySide6QtAds as ads
from PySide6.QtWidgets import QLabel, QWidget


class PanelPlaces(Protocol):
    """Places of panels."""

    def put(self, title: str, panel: QWidget) -> None:
        """Show a panel; one of that title that is there gives way and keeps its place."""
        ...

    def remove(self, title: str) -> None:
        """Take a panel away."""
        ...

    def closed(self) -> list[str]:
        """Titles of panels that the user has closed."""
        ...

    def raise_panel(self, title: str) -> None:
        """Bring a panel to the front."""
        ...


class PanelDocks:
    """A dock for each panel.

    Args:
        manager: of the window's docks.
        beside: the dock whose tabs the first one joins.
    """

    def __init__(self, manager: Any, beside: Any) -> None:
        self._manager, self._beside = manager, beside
        self.docks: dict[str, Any] = {}
        """By title."""
        self._colour = ""

    def colour(self, colour: str) -> None:
        """Write the tabs in the theme's colour: the docks' library has one of its own."""
        self._colour = colour
        for dock in self.docks.values():
            for label in dock.tabWidget().findChildren(QLabel):
                label.setStyleSheet(f"color: {colour}")

    def put(self, title: str, panel: QWidget) -> None:
        """See `PanelPlaces`."""
        dock = self.docks.get(title)
        if dock is not None:
            dock.takeWidget()
            dock.setWidget(panel)
            return
        dock = ads.CDockWidget(self._manager, title)
        dock.setObjectName(f"plug-in {title}")
        dock.setWidget(panel)
        area = self._beside.dockAreaWidget()
        if area is None:
            self._manager.addDockWidget(ads.RightDockWidgetArea, dock)
        else:
            self._manager.addDockWidgetTabToArea(dock, area)
        self.docks[title] = dock
        self.colour(self._colour)

    def remove(self, title: str) -> None:
        """See `PanelPlaces`."""
        dock = self.docks.pop(title, None)
        if dock is not None:
            dock.takeWidget()
            self._manager.removeDockWidget(dock)
            dock.deleteLater()

    def closed(self) -> list[str]:
        """See `PanelPlaces`."""
        return [title for title, dock in self.docks.items() if dock.isClosed()]

    def raise_panel(self, title: str) -> None:
        """See `PanelPlaces`."""
        dock = self.docks[title]
        dock.toggleView(True)
        dock.setAsCurrentTab()


class PanelWindows:
    """A window for each panel: where there is no main window."""

    def __init__(self) -> None:
        self._panels: dict[str, QWidget] = {}

    def put(self, title: str, panel: QWidget) -> None:
        """See `PanelPlaces`."""
        self.remove(title)
        panel.setWindowTitle(title)
        panel.show()
        self._panels[title] = panel

    def remove(self, title: str) -> None:
        """See `PanelPlaces`."""
        panel = self._panels.pop(title, None)
        if panel is not None:
            panel.hide()

    def closed(self) -> list[str]:
        """See `PanelPlaces`."""
        return [title for title, panel in self._panels.items() if not panel.isVisible()]

    def raise_panel(self, title: str) -> None:
        """See `PanelPlaces`."""
        self._panels[title].raise_()
