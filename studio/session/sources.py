"""Where a session's frames come from: the simulator or a recording, in one form."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from numpy.typing import ArrayLike

from devices.messages import EncodedFrame, Event, Frame
from devices.recording import read_recording
from devices.recording_codec import (
    RecordedAvatar,
    RecordedSurface,
    RecordedTrack,
    RecordedTruth,
    RecordedValue,
    SessionInfo,
)
from devices.replay import FrameAssembler
from scenes.state import Avatar, LiveSurface, TrackedObject
from studio.evaluate.filmed.perfect_detector import Masks
from studio.session.live_surfaces import live_surface

if TYPE_CHECKING:
    from sim.rehearsal import SimulatedStep


Corners = Mapping[str, ArrayLike]
"""(4, 3) corners in the world by surface id."""


@dataclass(frozen=True, slots=True, eq=False)
class SessionInput:
    """One camera frame and everything that came with it.

    Attributes:
        frame: what the tracker sees.
        packet: the frame as it left the camera.
        avatars: people at that time.
        events: what happened since the frame before.
        truth: where things really are; only the report looks at it.
        recorded: tracks found in a recording, with the name of their method.
        masks: per body id, where each lens really sees it; only of a simulation, and only for
            `PerfectDetector`.
        surfaces: what has become live since the frame before.
    """

    frame: Frame
    packet: EncodedFrame
    avatars: tuple[Avatar, ...] = ()
    events: tuple[Event, ...] = ()
    truth: RecordedTruth | None = None
    recorded: tuple[tuple[str, TrackedObject], ...] = ()
    masks: Masks | None = None
    surfaces: tuple[LiveSurface, ...] = ()

    @property
    def t_ns(self) -> int:
        """When the session gets to see the frame."""
        return self.frame.received_ns


def simulated_inputs(
    steps: Iterator[SimulatedStep], corners_of_surfaces: Corners | None = None
) -> Iterator[SessionInput]:
    """The inputs of a simulated session, in order.

    Args:
        steps: of the simulator.
        corners_of_surfaces: what is live from the first frame on, by surface id.
    """
    waiting = dict(corners_of_surfaces or {})
    for step in steps:
        surfaces = tuple(live_surface(key, at, step.frame) for key, at in waiting.items())
        waiting.clear()
        truth = RecordedTruth(
            seq=step.truth.seq,
            t_ns=step.truth.t_ns,
            world_from_object=step.truth.world_from_object,
            visible_fraction=step.truth.visible_fraction,
            moved=step.truth.moved,
            world_from_rig=step.truth.world_from_rig,
        )
        yield SessionInput(
            frame=step.frame,
            packet=step.packet,
            avatars=step.avatars,
            events=step.events,
            surfaces=surfaces,
            truth=truth,
            masks=step.truth.masks,
        )


def recorded_inputs(path: Path, session: SessionInfo) -> Iterator[SessionInput]:
    """The inputs of a recorded session, in order.

    Raises:
        RecordingError: the recording is damaged.
        ValueError: a video packet cannot be decoded.
    """
    assembler = FrameAssembler(session.rig)
    same_time: list[RecordedValue] = []
    waiting: list[Event | RecordedSurface] = []
    for value in read_recording(path):
        if same_time and _time(value) != _time(same_time[0]):
            yield from _grouped(same_time, assembler, waiting)
            same_time = []
        same_time.append(value)
    yield from _grouped(same_time, assembler, waiting)


def _time(value: RecordedValue) -> int:
    return value.track.t_ns if isinstance(value, RecordedTrack) else value.t_ns


def _grouped(
    values: list[RecordedValue],
    assembler: FrameAssembler,
    waiting: list[Event | RecordedSurface],
) -> Iterator[SessionInput]:
    """The input that these values of one time make; what comes between two frames is `waiting`."""
    waiting += [v for v in values if isinstance(v, Event | RecordedSurface)]
    for value in values:
        frame = assembler.feed(value)
        if frame is None or not isinstance(value, EncodedFrame):
            continue
        yield SessionInput(
            frame=frame,
            packet=value,
            avatars=tuple(v.avatar for v in values if isinstance(v, RecordedAvatar)),
            events=tuple(v for v in waiting if isinstance(v, Event)),
            surfaces=tuple(v.surface for v in waiting if isinstance(v, RecordedSurface)),
            truth=next((v for v in values if isinstance(v, RecordedTruth)), None),
            recorded=tuple((v.method, v.track) for v in values if isinstance(v, RecordedTrack)),
        )
        waiting.clear()
