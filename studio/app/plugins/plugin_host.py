"""Plug-ins in the studio: their actions, their panels as windows, their errors in the log."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

from studio.app.model.actions import Action
from studio.app.model.offered import Offered
from studio.app.model.workbench import Workbench
from studio.app.plugins.plugin_folder import Plugin, PluginFolder, default_folder, last_lines
from studio.app.plugins.registration import Registration


class PluginHost:
    """Keeps a bench's actions in step with a folder of plug-ins; `poll` is the window's to call.

    Args:
        bench: gets the actions and the log's lines.
        folder: of the plug-ins; None for the user's settings, or the usual place.
    """

    def __init__(self, bench: Workbench, folder: Path | None = None) -> None:
        self._bench = bench
        named = bench.settings.plugin_folder
        place = folder or (Path(named) if named else default_folder())
        self.folder = PluginFolder(place, changed=self._change, say=bench.say)
        self.panels: dict[str, Any] = {}
        """Widgets of panels that were opened, by title."""

    def start(self) -> None:
        """Begin to watch."""
        self.folder.start()

    def poll(self) -> None:
        """Take what was loaded since."""
        self.folder.poll()

    def close(self) -> None:
        """Stop watching and close the panels."""
        self.folder.close()
        for title in list(self.panels):
            self._close_panel(title)

    @property
    def offers(self) -> Registration:
        """Trackers, faults, panels and actions of all plug-ins."""
        return self.folder.offers()

    def open_panel(self, title: str) -> None:
        """Show a panel as a window of its own.

        Raises:
            ValueError: no plug-in offers it, or it raises.
        """
        make = self.offers.panels.get(title)
        if make is None:
            raise ValueError(f"no plug-in offers a panel {title!r}")
        self._close_panel(title)
        try:
            panel = make(self._bench)
            panel.setWindowTitle(title)
            panel.show()
        except Exception:  # noqa: BLE001 - the window lives on whatever a panel does
            raise ValueError(f"panel {title}: {last_lines(self._file_of(title))}") from None
        self.panels[title] = panel

    def _change(self, old: Plugin | None, new: Plugin | None) -> None:
        table = self._bench.actions
        shown: list[str] = []
        if old is not None:
            for action in self._actions(old.offers):
                table.remove(action.id)
            shown = [title for title in old.offers.panels if title in self.panels]
            for title in shown:
                self._close_panel(title)
        if new is not None:
            for action in self._actions(new.offers):
                table.add(action)
            for title in shown:
                if title in new.offers.panels:
                    self.open_panel(title)
        offers = self.offers
        self._bench.offer(Offered(offers.trackers, offers.faults))

    def _actions(self, offers: Registration) -> list[Action]:
        panels = [
            Action(panel_id(title), f"Show {title}", "Plug-ins", partial(self.open_panel, title))
            for title in offers.panels
        ]
        return [*offers.actions, *panels]

    def _file_of(self, title: str) -> Path:
        loaded = self.folder.plugins.values()
        return next(item.path for item in loaded if title in item.offers.panels)

    def _close_panel(self, title: str) -> None:
        panel = self.panels.pop(title, None)
        if panel is not None:
            panel.close()


def panel_id(title: str) -> str:
    """The id of the action that shows a panel."""
    name = "".join(letter if letter.isalnum() and letter.isascii() else "_" for letter in title)
    return f"plugin_panel.{name.lower()}"
