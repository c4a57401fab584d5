"""Plug-ins in the studio: their actions, their panels as docks, their errors in the log."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from studio.app.model.actions import Action
from studio.app.model.offered import Offered
from studio.app.model.workbench import Topic, Workbench
from studio.app.plugins.plugin_folder import Plugin, PluginFolder, default_folder, last_lines
from studio.app.plugins.registration import Registration

if TYPE_CHECKING:  # Qt's docks: not where there is no window
    from studio.app.plugins.panel_docks import PanelPlaces


class PanelBench:
    """Everything that the bench has; its listeners are the panel's own.

    One that raises is said and not called again: it must not keep others from hearing.

    Args:
        bench: the bench.
        words: what is being handled, as file, line and message.
        title: of the panel.
    """

    def __init__(self, bench: Workbench, title: str, *, words: Callable[[], str]) -> None:
        self._bench, self._title, self._words = bench, title, words
        self._listeners: list[_Listener] = []

    def __getattr__(self, name: str) -> Any:
        """Whatever the bench has."""
        return getattr(self._bench, name)

    def listen(self, topic: Topic, callback: Callable[[], None]) -> None:
        """See `Workbench.listen`."""
        listener = _Listener(self, callback)
        self._listeners.append(listener)
        self._bench.listen(topic, listener.call)

    def stop_listening(self, callback: Callable[[], None]) -> None:
        """See `Workbench.stop_listening`."""
        for listener in [each for each in self._listeners if each.callback == callback]:
            self._drop(listener)

    def release(self) -> None:
        """The panel goes: nothing is called any more."""
        for listener in list(self._listeners):
            self._drop(listener)

    def failed(self, listener: _Listener) -> None:
        """A listener has raised what is being handled."""
        self._drop(listener)
        text = f"panel {self._title}: {self._words()}; it hears no more of that until it is saved"
        self._bench.say("error", text)

    def _drop(self, listener: _Listener) -> None:
        self._listeners.remove(listener)
        self._bench.stop_listening(listener.call)


class _Listener:
    """One callback of a panel."""

    def __init__(self, bench: PanelBench, callback: Callable[[], None]) -> None:
        self._bench, self.callback = bench, callback

    def call(self) -> None:
        try:
            self.callback()
        except Exception:  # noqa: BLE001 - the window lives on whatever a panel does
            self._bench.failed(self)


class PluginHost:
    """Keeps a bench's actions in step with a folder of plug-ins; `poll` is the window's to call.

    Args:
        bench: gets the actions and the log's lines.
        folder: of the plug-ins; None for the user's settings, or the usual place.
        places: where panels are shown; None for windows of their own.
    """

    def __init__(
        self, bench: Workbench, folder: Path | None = None, *, places: PanelPlaces | None = None
    ) -> None:
        self._bench = bench
        self._places = places
        self._benches: dict[str, PanelBench] = {}
        named = bench.settings.plugin_folder
        place = folder or (Path(named) if named else default_folder())
        self.folder = PluginFolder(place, changed=self._change, say=bench.say)
        self.panels: dict[str, Any] = {}
        """Widgets of panels that are open, by title."""

    def start(self) -> None:
        """Begin to watch."""
        self.folder.start()

    def poll(self) -> None:
        """Take what was loaded since, and what the user has closed."""
        self.folder.poll()
        if self._places is not None:
            for title in self._places.closed():
                self._close_panel(title)
                self._remember(title, is_open=False)

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
        """Show a panel in its dock, or bring it to the front; the next window shows it, too.

        Raises:
            ValueError: no plug-in offers it, or it raises.
        """
        if title not in self.panels:
            # One that hangs the window must not hang the next one.
            self._remember(title, is_open=False)
            self._make_panel(title)
            self._remember(title, is_open=True)
        self._where().raise_panel(title)

    def _make_panel(self, title: str) -> None:
        """Make a panel; one of that title that is open gives way to it.

        Raises:
            ValueError: no plug-in offers it, or it raises.
        """
        make = self.offers.panels.get(title)
        if make is None:
            raise ValueError(f"no plug-in offers a panel {title!r}")
        file = self._file_of(title)
        bench = PanelBench(self._bench, title, words=partial(last_lines, file))
        try:
            panel = make(bench)
            self._where().put(title, panel)
        except Exception:  # noqa: BLE001 - the window lives on whatever a panel does
            bench.release()
            raise ValueError(f"panel {title}: {last_lines(file)}") from None
        self._let_go(title)
        self.panels[title], self._benches[title] = panel, bench

    def _where(self) -> PanelPlaces:
        if self._places is None:
            from studio.app.plugins.panel_docks import PanelWindows

            self._places = PanelWindows()
        return self._places

    def _remember(self, title: str, *, is_open: bool) -> None:
        """Whether the next window shows a panel."""
        before = self._bench.settings.panels
        others = tuple(name for name in before if name != title)
        panels = (*others, title) if is_open else others
        if panels != before:
            self._bench.set(panels=panels)

    def _change(self, old: Plugin | None, new: Plugin | None) -> None:
        table = self._bench.actions
        offers = self.offers
        self._bench.offer(Offered(offers.trackers, offers.faults))
        if old is not None:
            for action in self._actions(old.offers):
                table.remove(action.id)
            for title in old.offers.panels:
                if new is None or title not in new.offers.panels:
                    self._close_panel(title)
        if new is None:
            return
        for action in self._actions(new.offers):
            table.add(action)
        for title in new.offers.panels:
            if title in self.panels:
                self._make_panel(title)  # it keeps its place
            elif title in self._bench.settings.panels:
                self.open_panel(title)

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
        if title in self.panels:
            self._where().remove(title)
            self._let_go(title)

    def _let_go(self, title: str) -> None:
        """The panel is shown no more: it hears nothing, and goes."""
        panel, bench = self.panels.pop(title, None), self._benches.pop(title, None)
        if bench is not None:
            bench.release()
        if panel is not None:
            panel.close()
            panel.deleteLater()


def panel_id(title: str) -> str:
    """The id of the action that shows a panel."""
    name = "".join(letter if letter.isalnum() and letter.isascii() else "_" for letter in title)
    return f"plugin_panel.{name.lower()}"
