"""Films that exist already: a recorded session's video with its truth, or any video file.

H.264 without B-frames is taken as it is; anything else is decoded and encoded again.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, cast

import av
import numpy as np
from av.error import FFmpegError
from numpy.typing import NDArray

from devices.camera.address import CameraAddress, parse_address
from devices.camera.container_units import ContainerUnits
from devices.camera.units import SourceError, Unit
from devices.messages import EncodedFrame, Event
from devices.recording import read_recording, read_session
from devices.recording_codec import RecordedTruth
from devices.video import H264Decoder, H264Encoder
from sim.wire.film.film import FilmFormat, PictureTruth
from sim.wire.film.film_file import FilmWriter
from sim.wire.film.layouts import Layout

RECORDING_SUFFIX = ".mcap"
"""How recordings are named."""

UNKNOWN_LAYOUT = "unknown"
"""Layout of a video, unknown: its receiver has to find it out."""

BITRATE = 24_000_000
"""Bits per second where a video is encoded again; as of a drawn film."""

NANOSECONDS = 1_000_000_000


@dataclass(frozen=True, slots=True)
class _Timed:
    """An access unit and its time from any origin."""

    t_ns: int
    data: bytes
    keyframe: bool


def film_recording(folder: Path, recording: Path) -> None:
    """Write the film of a recorded session, its video as it was sent.

    Where its truth was recorded for every picture, the film has it, too.

    Raises:
        RecordingError: the file is not a whole recording of ours.
        ValueError: it holds no video that begins with a keyframe.
        OSError: it cannot be read, or the disk is full.
    """
    session = read_session(recording)
    packets: list[EncodedFrame] = []
    truth: dict[int, RecordedTruth] = {}
    events: list[Event] = []
    for value in read_recording(recording):
        if isinstance(value, EncodedFrame) and (packets or value.keyframe):
            packets.append(value)
        elif isinstance(value, RecordedTruth):
            truth[value.seq] = value
        elif isinstance(value, Event) and value.kind in ("bumped", "fault"):
            events.append(value)
    packets = _growing(packets)
    if not packets:
        raise ValueError(f"{recording}: no video that begins with a keyframe, nothing to stream")
    width, height = picture_size(packets[0])
    form = FilmFormat(width, height, session.fps, Layout.SIDE_BY_SIDE.value)
    writer = FilmWriter(folder, recording.name, form)
    try:
        for number, packet in enumerate(packets):
            t_ns = packet.t_ns - packets[0].t_ns
            writer.add_unit(packet.data, t_ns=t_ns, keyframe=packet.keyframe, shows=number)
        for each in _truth_of(packets, truth):
            writer.add_picture(each)
        writer.add_events(events)
        last_ns = packets[-1].t_ns - packets[0].t_ns
        writer.finish(last_ns + round(NANOSECONDS / session.fps))
    finally:
        writer.close()


def film_video(folder: Path, video: Path) -> None:
    """Write the film of a video file; of one with a track a lens, both side by side.

    Raises:
        ValueError: it cannot be read or holds no picture.
        OSError: the disk is full.
    """
    address = parse_address(str(video))
    taken = _as_it_is(address)
    if taken is None:
        taken = list(_encoded_again(video))
    if not taken:
        raise ValueError(f"{video}: no picture in it, nothing to stream")
    step_ns = round(float(np.median([b.t_ns - a.t_ns for a, b in pairwise(taken)] or [40_000_000])))
    width, height = picture_size(EncodedFrame("film", 0, 0, taken[0].data, True))
    form = FilmFormat(width, height, NANOSECONDS / step_ns, UNKNOWN_LAYOUT)
    writer = FilmWriter(folder, video.name, form)
    try:
        for number, unit in enumerate(taken):
            t_ns = unit.t_ns - taken[0].t_ns
            writer.add_unit(unit.data, t_ns=t_ns, keyframe=unit.keyframe, shows=number)
        writer.finish(taken[-1].t_ns - taken[0].t_ns + step_ns)
    finally:
        writer.close()


def picture_size(keyframe: EncodedFrame) -> tuple[int, int]:
    """Width and height of a keyframe's picture.

    Raises:
        ValueError: it cannot be decoded.
    """
    picture = H264Decoder().decode(keyframe)
    if picture is None:
        raise ValueError(f"{keyframe.stream_id}: its first picture is not whole")
    return picture.shape[1], picture.shape[0]


def _growing(packets: list[EncodedFrame]) -> list[EncodedFrame]:
    """Packets in the order of their encoding, their times growing where a fault set them back."""
    packets.sort(key=lambda packet: packet.seq)
    grown: list[EncodedFrame] = []
    for packet in packets:
        earliest = grown[-1].t_ns + 1 if grown else packet.t_ns
        grown.append(replace(packet, t_ns=max(packet.t_ns, earliest)))
    return grown


def _truth_of(
    packets: list[EncodedFrame], truth: Mapping[int, RecordedTruth]
) -> Iterator[PictureTruth]:
    """The truth of every packet; none at all where one has none or other objects."""
    found = [truth.get(packet.seq) for packet in packets]
    names = None if found[0] is None else set(found[0].world_from_object)
    if any(each is None or set(each.world_from_object) != names for each in found):
        return
    for each in found:
        assert each is not None
        t_ns = each.t_ns if each.captured_ns is None else each.captured_ns
        yield PictureTruth(
            t_ns,
            each.world_from_object,
            each.visible_fraction,
            each.world_from_rig,
            each.faults,
        )


def _as_it_is(address: CameraAddress) -> list[_Timed] | None:
    """The units of a single H.264 track whose times grow; None if it is not that."""
    taken: list[_Timed] = []
    try:
        container = ContainerUnits(address)
    except SourceError as error:
        raise ValueError(str(error)) from None
    try:
        if container.tracks != 1:
            return None
        for unit in container:
            if not _fits(unit, taken):
                return None
            if taken or unit.keyframe:
                taken.append(_Timed(cast("int", unit.pts_ns), unit.data, unit.keyframe))
    except SourceError as error:
        raise ValueError(str(error)) from None
    finally:
        container.close()
    return taken


def _fits(unit: Unit, before: list[_Timed]) -> bool:
    if unit.format.codec != "h264" or unit.pts_ns is None:
        return False
    return not before or unit.pts_ns > before[-1].t_ns


def _encoded_again(video: Path) -> Iterator[_Timed]:
    encoder: H264Encoder | None = None
    last_ns = -1
    for seq, (t_ns, picture) in enumerate(_decoded(video)):
        height, width = picture.shape[:2]
        if encoder is None:
            encoder = H264Encoder(width, height, 30.0, BITRATE, keyframe_interval=30)
        last_ns = max(t_ns, last_ns + 1)
        packet = encoder.encode(picture, seq, last_ns)[0]
        yield _Timed(last_ns, packet.data, packet.keyframe)


def _decoded(video: Path) -> Iterator[tuple[int, NDArray[np.uint8]]]:
    try:
        with av.open(str(video)) as container:
            # Both lenses' tracks where a camera writes one a lens, else the only one.
            streams = [cast("Any", stream) for stream in container.streams.video][:2]
            waiting: dict[int, list[tuple[int, NDArray[np.uint8]]]] = {s.index: [] for s in streams}
            for packet in container.demux(streams):
                for frame in cast("list[Any]", packet.decode()):
                    t_ns = round(float(frame.time or 0.0) * NANOSECONDS)
                    waiting[packet.stream_index].append(
                        (t_ns, _even(frame.to_ndarray(format="rgb24")))
                    )
                while all(waiting.values()):
                    taken = [pictures.pop(0) for pictures in waiting.values()]
                    yield taken[0][0], np.concatenate([picture for _, picture in taken], axis=1)
    except (FFmpegError, OSError) as error:
        raise ValueError(f"{video}: cannot be decoded ({error})") from None


def _even(picture: NDArray[np.uint8]) -> NDArray[np.uint8]:
    height, width = picture.shape[:2]
    return np.ascontiguousarray(picture[: height & ~1, : width & ~1])
