"""Where a session's frames come from: the simulator or a recording, in one form."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from devices.messages import EncodedFrame, Event, Frame
from devices.recording import read_recording
from devices.recording_codec import (
    RecordedAvatar,
    RecordedTrack,
    RecordedTruth,
    RecordedValue,
    SessionInfo,
)
from devices.replay import FrameAssembler
from scenes.state import Avatar, TrackedObject
from studio.evaluate.perfect_detector import Masks

if TYPE_CHECKING:
    from sim.rehearsal import SimulatedStep


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
    """

    frame: Frame
    packet: EncodedFrame
    avatars: tuple[Avatar, ...] = ()
    events: tuple[Event, ...] = ()
    truth: RecordedTruth | None = None
    recorded: tuple[tuple[str, TrackedObject], ...] = ()
    masks: Masks | None = None

    @property
    def t_ns(self) -> int:
        """When the session gets to see the frame."""
        return self.frame.received_ns


def simulated_inputs(steps: Iterator[SimulatedStep]) -> Iterator[SessionInput]:
    """The inputs of a simulated session, in order."""
    for step in steps:
        truth = RecordedTruth(
            seq=step.truth.seq,
            t_ns=step.truth.t_ns,
            world_from_object=step.truth.world_from_object,
            visible_fraction=step.truth.visible_fraction,
            moved=step.truth.moved,
            world_from_rig=step.truth.world_from_rig,
        )
        yield SessionInput(
            step.frame, step.packet, step.avatars, step.events, truth, masks=step.truth.masks
        )


def recorded_inputs(path: Path, session: SessionInfo) -> Iterator[SessionInput]:
    """The inputs of a recorded session, in order.

    Raises:
        RecordingError: the recording is damaged.
        ValueError: a video packet cannot be decoded.
    """
    assembler = FrameAssembler(session.rig)
    same_time: list[RecordedValue] = []
    events: list[Event] = []
    for value in read_recording(path):
        if same_time and _time(value) != _time(same_time[0]):
            yield from _grouped(same_time, assembler, events)
            same_time = []
        same_time.append(value)
    yield from _grouped(same_time, assembler, events)


def _time(value: RecordedValue) -> int:
    return value.track.t_ns if isinstance(value, RecordedTrack) else value.t_ns


def _grouped(
    values: list[RecordedValue], assembler: FrameAssembler, events: list[Event]
) -> Iterator[SessionInput]:
    """The input that these values of one time make; `events` carries those between two frames."""
    events += [v for v in values if isinstance(v, Event)]
    for value in values:
        frame = assembler.feed(value)
        if frame is None or not isinstance(value, EncodedFrame):
            continue
        yield SessionInput(
            frame=frame,
            packet=value,
            avatars=tuple(v.avatar for v in values if isinstance(v, RecordedAvatar)),
            events=tuple(events),
            truth=next((v for v in values if isinstance(v, RecordedTruth)), None),
            recorded=tuple((v.method, v.track) for v in values if isinstance(v, RecordedTrack)),
        )
        events.clear()
