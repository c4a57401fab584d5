"""Read-out of the instant under the mouse, in words and units."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from studio.app.model.documents.document import Marker
from studio.app.scenario.fields import fault_title
from studio.app.shell.theme import figures
from studio.app.timeline.opening import OpenRecording
from studio.app.timeline.recorded.columns import STATE, STATES, last_at
from studio.console.spoken import with_names

NEAR_NS = 150_000_000
"""Events and markers as near as this are named: one or two frames of a slow camera."""


def read_out(
    shown: OpenRecording,
    t_ns: int,
    object_id: str,
    *,
    markers: Sequence[Marker],
    name: Callable[[str], str],
) -> str:
    """One line.

    Args:
        shown: the recording.
        t_ns: the instant.
        object_id: of the row under the mouse, or empty.
        markers: the document's.
        name: gives what an object of an id is called.
    """
    words = [f"{figures((t_ns - shown.index.origin_ns) / 1e9, '7.2f')} s"]
    tracks = shown.index.tracks.get(object_id)
    number = -1 if tracks is None else tracks.newest(t_ns)
    if tracks is not None and number >= 0:
        words.append(f"{name(object_id)} {STATES[int(tracks.row(number)[STATE])]}")
    curve = shown.curves.get(object_id)
    at = -1 if curve is None else last_at(curve.t_ns, t_ns)
    if curve is not None and at >= 0:
        words.append(f"off by {curve.world_cm[at]:.1f} cm, {curve.yaw_deg[at]:.1f}°")
    words += [
        f"{fault_title(span.name)} {span.largest:g}"
        for span in shown.faults
        if span.from_ns <= t_ns < span.to_ns
    ]
    words += [m.text for m in markers if abs(m.t_ns - t_ns) <= NEAR_NS]
    ids = shown.index.tracks
    near = [e.text for e in shown.index.events if abs(e.t_ns - t_ns) <= NEAR_NS]
    return "   ".join([*words, *(with_names(text, ids, name) for text in near[:2])])
