"""The tracker's settings in a session: asked for, tried beside, followed, recorded, replayed."""

from __future__ import annotations

import threading
from collections.abc import Iterator, Mapping, MutableMapping
from typing import Any

from devices.messages import Event, Frame
from devices.streams import BoundedQueue
from tracking.options import TrackerOptions, options_from_text, options_text
from tracking.output import Adjustable, TrackingMethod, TrackOutput

SOURCE, KIND = "tracker", "settings"
"""Of the events that record a change."""

WAITING = 64
"""Changes that may have been asked for and are not followed yet."""


def settings_event(t_ns: int, options: TrackerOptions) -> Event:
    """Return the event that records settings, which hold from a frame on."""
    return Event(t_ns, SOURCE, KIND, options_text(options))


def is_settings(event: Event) -> bool:
    """Whether an event is a change of the tracker's settings."""
    return (event.source, event.kind) == (SOURCE, KIND)


class TrackerSettings:
    """Settings of one session's methods; those that have none are left as they are.

    Args:
        methods: of the session, by name.
        first: to begin with; None for the usual ones, or those of what is replayed.
    """

    def __init__(
        self, methods: Mapping[str, TrackingMethod[Any]], first: TrackerOptions | None
    ) -> None:
        self._methods = methods
        self._ignores_recorded = first is not None
        self._asked: BoundedQueue[TrackerOptions] = BoundedQueue(WAITING, name="tracker settings")
        self._lock = threading.Lock()
        self._wanted_trial: TrackerOptions | None = None
        self._trial: tuple[TrackerOptions, Any] | None = None
        if first is not None and first != TrackerOptions():
            self._asked.put(first)

    def ask(self, options: TrackerOptions) -> None:
        """Follow these from the next frame on; any thread may ask.

        Raises:
            StreamFullError: too many wait.
        """
        self._asked.put(options)

    def take(self, event: Event) -> bool:
        """Whether an event of what is replayed is a change; it is followed then.

        Raises:
            ValueError: it is of another version of the program.
        """
        if not is_settings(event):
            return False
        if not self._ignores_recorded:
            try:
                self._asked.put(options_from_text(event.text))
            except ValueError as error:
                raise ValueError(
                    f"the recording's tracker settings at {event.t_ns / 1e9:g} s: {error}; they "
                    "are of another version of the program, with which it can be tracked again"
                ) from None
        return True

    def apply(self, states: MutableMapping[str, Any]) -> Iterator[TrackerOptions]:
        """Put what was asked for into the methods' states; gives each change."""
        while (options := self._asked.take()) is not None:
            for name, method in self._methods.items():
                if isinstance(method, Adjustable):
                    states[name] = method.adjusted(states[name], options)
            yield options

    def try_out(self, options: TrackerOptions | None) -> None:
        """Try these beside what is followed; None ends it."""
        with self._lock:
            self._wanted_trial = options

    def tried(self, states: Mapping[str, Any], frame: Frame, now_ns: int) -> TrackOutput | None:
        """Return the first adjustable method's answer with the settings that are tried."""
        with self._lock:
            wanted = self._wanted_trial
        if wanted is None:
            self._trial = None
            return None
        for name, method in self._methods.items():
            if isinstance(method, Adjustable):
                if self._trial is None or self._trial[0] != wanted:
                    self._trial = wanted, method.adjusted(states[name], wanted)
                state, output = method.step(self._trial[1], frame, now_ns)
                self._trial = wanted, state
                return output
        return None
