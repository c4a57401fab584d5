"""Opening a recording: its index and all that is drawn of it, made on a thread."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from devices.recorded.index import is_whole
from scenes.package import ScenePackage
from scenes.state import ObjectModel
from scenes.workers.task import Task
from studio.app.timeline.recorded.errors import (
    ErrorCurve,
    Failure,
    error_curves,
    first_failure,
    symmetries,
)
from studio.app.timeline.recorded.index import RecordingIndex
from studio.app.timeline.recorded.reading import read_index
from studio.app.timeline.recorded.spans import FaultSpan, StateSpan, fault_spans, state_spans
from studio.session.opening import scene_hash
from studio.session.records.cut_short import is_cut_short
from studio.session.records.outputs import RECORDING
from studio.session.records.recorded_scene import as_recorded


@dataclass(frozen=True, slots=True, eq=False)
class OpenRecording:
    """A recording as it is shown.

    Attributes:
        index: all but its pictures.
        states: spans by object id.
        faults: spans of what went wrong.
        curves: errors by object id; empty without truth.
        failure: the first one, or None.
        stranger: why it does not suit the scene that is open, in words; empty if it does.
        cut: how it came to an early end, in words; empty if it was played and written to its end.
    """

    index: RecordingIndex
    states: Mapping[str, Sequence[StateSpan]]
    faults: Sequence[FaultSpan]
    curves: Mapping[str, ErrorCurve]
    failure: Failure | None
    stranger: str
    cut: str


def recording_file(path: Path) -> Path:
    """The recording that a path stands for: itself, or that of a rehearsal's folder."""
    return path / RECORDING if path.is_dir() else path


def opening(path: Path, scene: ScenePackage | None) -> Task[OpenRecording | None]:
    """Begin to open a recording; the result is None if it was cancelled.

    Args:
        path: of the file.
        scene: that is open, for its objects' symmetry, or None.
    """

    def work(task: Task[OpenRecording | None]) -> OpenRecording | None:
        index = read_index(path, progress=task.report, cancelled=task.cancelled)
        return None if index is None else open_recording(index, scene)

    return Task("opening a recording", work, expected=Exception).start()


def open_recording(index: RecordingIndex, scene: ScenePackage | None) -> OpenRecording:
    """All that is drawn of an index.

    Args:
        index: of the recording.
        scene: that is open, or None.
    """
    objects: Sequence[ObjectModel] = () if scene is None else scene.objects
    curves = error_curves(index, symmetries(objects))
    return OpenRecording(
        index=index,
        states={key: state_spans(rows, end_ns=index.end_ns) for key, rows in index.tracks.items()},
        faults=fault_spans(index),
        curves=curves,
        failure=first_failure(index, curves),
        stranger=_stranger(index, scene),
        cut=_cut(index),
    )


def _cut(index: RecordingIndex) -> str:
    if not is_whole(index.path):
        return "cut off"
    return "stopped early" if any(map(is_cut_short, index.events)) else ""


def _stranger(index: RecordingIndex, scene: ScenePackage | None) -> str:
    if scene is None:
        return ""
    found = scene_hash(as_recorded(scene, index.session))
    if found == index.session.scene_hash:
        return ""
    name = Path(index.session.scene).name
    if name != scene.name:
        return (
            f"{index.path.name}: recorded in scene {name!r}, open is {scene.name!r}: it is shown "
            f"all the same, objects may be missing; open the scene {name!r} to see it right"
        )
    return (
        f"{index.path.name}: recorded with another version of scene {name!r} "
        f"({index.session.scene_hash[:12]}, open is {found[:12]}): it is shown all the same, "
        "objects may be elsewhere"
    )
