"""The bench as a panel of a plug-in has it: what the panel listens to ends with the panel."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from studio.app.model.workbench import Topic, Workbench


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
