"""A session that was stopped before its end: its recording says so by its last event."""

from __future__ import annotations

from devices.messages import Event

KIND = "cut-short"
"""Kind of the event."""


def cut_short_event(t_ns: int, duration_ns: int) -> Event:
    """The last event of a session that was stopped.

    Args:
        t_ns: of its last frame.
        duration_ns: of the whole session as it was planned; 0 if nobody knows.
    """
    of = f" of {duration_ns / 1e9:.1f} s" if duration_ns else ""
    return Event(t_ns, "session", KIND, f"stopped by the user after {t_ns / 1e9:.1f} s{of}")


def is_cut_short(event: Event) -> bool:
    """Whether it says that the session was stopped before its end."""
    return event.kind == KIND
