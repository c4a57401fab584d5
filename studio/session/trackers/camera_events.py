"""A tracker's notices of the camera's standing, as events of a session."""

from __future__ import annotations

from collections.abc import Sequence

from devices.messages import Event
from tracking.output import CameraMoment, CameraNotice

SOURCE = "camera-pose"
"""Of these events; a replay leaves out those of a recording and says its own."""


def event_kind(moment: CameraMoment) -> str:
    """The kind of a moment's event."""
    return f"camera-{moment}"


def camera_events(t_ns: int, notices: Sequence[CameraNotice]) -> tuple[Event, ...]:
    """The events of a frame's notices.

    Args:
        t_ns: frame time.
        notices: of the shown tracker.
    """
    return tuple(Event(t_ns, SOURCE, event_kind(n.moment), n.described()) for n in notices)


def is_camera_event(value: object) -> bool:
    """Whether something recorded is such an event."""
    return isinstance(value, Event) and value.source == SOURCE
