"""How soon any instant of a five-minute recording is there."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from devices.messages import EncodedFrame, Event
from devices.recorded.people import RecordedAvatar
from devices.recording import Recorder
from devices.recording_codec import FrameStamp, RecordedTrack, RecordedTruth
from devices.session_info import SessionInfo
from devices.video import KEYFRAME_S, H264Encoder
from scenes.cameras import Fisheye, Rig
from scenes.frames import FRONT_FROM_BACK_LENS
from scenes.pose import Pose
from scenes.state import Avatar, TrackedObject, TrackState
from studio.app.timeline.pictures.proxies import Proxies
from studio.app.timeline.pictures.thread import PictureThread
from studio.app.timeline.recorded.index import RecordingIndex
from studio.app.timeline.recorded.reading import read_index
from studio.console.rows import Row, at_most

DURATION_S, FPS, LENS_PX, BITRATE = 300.0, 10.0, 1440, 24_000_000
"""Of the recording: five minutes with the camera of a scenario that says nothing of it."""

GROUPS = 4
"""Groups of pictures that are encoded; the rest of the recording repeats them."""

OBJECTS = tuple(f"object-{number}" for number in range(5))
SEEKS = 60
"""Instants that are gone to, at random with `SEED`."""

SEED = 3
BAR_MS = 200.0
"""A seek's state and a picture of exactly that instant together."""

LIMIT_S = 900.0
"""After so long something hangs."""


def write_recording(path: Path, *, duration_s: float = DURATION_S, lens_px: int = LENS_PX) -> None:
    """A synthetic recording: moving noise in the pictures, objects and people that turn.

    Args:
        path: of the file.
        duration_s: how long it is.
        lens_px: side of each of its two lenses' pictures.
    """
    lens = Fisheye.from_fov(lens_px, np.radians(200))
    rig = Rig((lens, lens), (Pose.identity(), FRONT_FROM_BACK_LENS))
    info = SessionInfo("none", "0", 0, "", "", "exact", ("own",), {}, rig, FPS)
    packets = _packets(lens_px)
    hand = np.random.default_rng(SEED).normal(size=(21, 3))
    with Recorder(path, info) as recorder:
        for seq in range(round(duration_s * FPS)):
            t_ns = round(seq * 1e9 / FPS)
            recorder.write(FrameStamp("camera-360", seq, t_ns, t_ns, Pose.identity()))
            recorder.write(replace(packets[seq % len(packets)], seq=seq, t_ns=t_ns))
            pose = Pose.from_yaw(0.01 * seq, (0.001 * seq, 0.0, 0.0))
            true = dict.fromkeys(OBJECTS, pose)
            visible = dict.fromkeys(OBJECTS, 1.0)
            moved_ids = frozenset(OBJECTS)
            recorder.write(RecordedTruth(seq, t_ns, true, visible, moved_ids, Pose.identity()))
            for object_id in OBJECTS:
                state = tuple(TrackState)[seq // 40 % 4]
                track = TrackedObject(object_id, t_ns, pose, np.eye(4) * 1e-4, 1.0, state, 0.9, seq)
                recorder.write(RecordedTrack("own", track))
            for user_id in ("ana", "maya"):
                avatar = Avatar(user_id, "local", pose, (hand, hand))
                recorder.write(RecordedAvatar(t_ns, avatar))
            if seq % 100 == 0:
                recorder.write(Event(t_ns, "ana", "push", f"push {seq}"))


def _packets(lens_px: int) -> list[EncodedFrame]:
    """Whole groups of pictures in which everything moves."""
    interval = round(KEYFRAME_S * FPS)
    encoder = H264Encoder(2 * lens_px, lens_px, FPS, BITRATE, keyframe_interval=interval)
    coarse = np.random.default_rng(SEED).integers(0, 256, (lens_px // 8, lens_px // 4, 3))
    picture = np.kron(coarse, np.ones((8, 8, 1))).astype(np.uint8)
    return [
        encoder.encode(np.roll(picture, 3 * seq, axis=1), seq, round(seq * 1e9 / FPS))[0]
        for seq in range(GROUPS * interval)
    ]


@dataclass(frozen=True, slots=True)
class Seen:
    """A picture that came after a seek.

    Attributes:
        is_exact: whether it is of the instant that was gone to; else of the keyframe before it.
        is_full: whether it has all its pixels.
    """

    is_exact: bool
    is_full: bool


@dataclass(frozen=True, slots=True)
class SeekTimes:
    """How long seeks took until each was there, 95 % of them, milliseconds.

    Attributes:
        state: the room.
        first: any picture, from then on.
        exact: a picture of exactly that instant, of whatever size, from then on.
        full: the same with all its pixels, from then on.
        whole: room and exact picture together.
    """

    state: float
    first: float
    exact: float
    full: float
    whole: float


def measure_seeks(
    span_ns: tuple[int, int],
    *,
    state_at: Callable[[int], object],
    pictures_at: Callable[[int], Iterable[Seen]],
    seeks: int = SEEKS,
) -> SeekTimes:
    """Go to instants at random.

    Args:
        span_ns: first and last time of the recording.
        state_at: makes the room at a time.
        pictures_at: asks for the camera's picture at a time; yields what comes until the full one.
        seeks: how many.
    """
    times = np.random.default_rng(SEED).integers(span_ns[0], span_ns[1], seeks, endpoint=True)
    parts: list[tuple[float, float, float, float]] = []
    for t_ns in times.tolist():
        begin = time.perf_counter()
        state_at(t_ns)
        middle = time.perf_counter()
        came = [(seen, time.perf_counter() - middle) for seen in pictures_at(t_ns)]
        exact_s = next(at_s for seen, at_s in came if seen.is_exact)
        full_s = next(at_s for seen, at_s in came if seen.is_exact and seen.is_full)
        parts.append((middle - begin, came[0][1], exact_s, full_s))
    taken_ms = 1e3 * np.array(parts)
    state, first, exact, full = np.percentile(taken_ms, 95, axis=0).tolist()
    whole = float(np.percentile(taken_ms[:, 0] + taken_ms[:, 2], 95))
    return SeekTimes(state, first, exact, full, whole)


def seek_rows_of(before: SeekTimes, after: SeekTimes) -> list[Row]:
    """The figures of seeks.

    Args:
        before: while there are no reduced pictures yet.
        after: when there is one of every packet.
    """
    return [
        Row("studio.seek.state_ms.p95", after.state, "ms"),
        Row("studio.seek.before_proxies.first_picture_ms.p95", before.first, "ms"),
        Row("studio.seek.before_proxies.seek_ms.p95", before.whole, "ms"),
        Row("studio.seek.reduced_picture_ms.p95", after.exact, "ms"),
        Row("studio.seek.exact_picture_ms.p95", after.full, "ms"),
        at_most("studio.seek_ms.p95", after.whole, "ms", bar=BAR_MS),
    ]


def seek_rows(folder: Path) -> list[Row]:
    """Write the recording into a folder, and go to instants of it at random.

    First as right after opening; then once all reduced pictures are there, which is timed with
    nothing else to do.
    """
    path = folder / "long.mcap"
    write_recording(path)
    index = read_index(path)
    assert index is not None, "reading ends early only when it is cancelled"
    assert index.packets is not None, "the recording holds pictures"
    before = _seeks(index, None)
    proxies = Proxies(path, index.packets.topics[0], folder / "pictures", begin_after_s=0.0)
    try:
        taken_s, size_mb = _made(proxies)
        after = _seeks(index, proxies)
    finally:
        proxies.stop()
    return [
        Row("studio.seek.proxies_s", taken_s, "s"),
        Row("studio.seek.proxies_mb", size_mb, "MB"),
        *seek_rows_of(before, after),
    ]


def pictures_at(thread: PictureThread, t_ns: int) -> Iterator[Seen]:
    """Ask for the picture at a time; what comes, until the full one.

    Raises:
        TimeoutError: it does not come.
    """
    thread.ask(t_ns)
    while True:
        picture = thread.pictures.take(timeout_s=30.0)
        if picture is None:
            raise TimeoutError(f"no picture at {t_ns / 1e9:.2f} s within 30 s")
        if picture.asked_ns == t_ns:
            yield Seen(picture.is_exact, picture.is_full)
            if picture.is_exact and picture.is_full:
                return


def _seeks(index: RecordingIndex, proxies: Proxies | None) -> SeekTimes:
    thread = PictureThread(index, proxies=proxies)
    try:
        return measure_seeks(
            (index.start_ns, index.end_ns),
            state_at=index.state_at,
            pictures_at=lambda t_ns: pictures_at(thread, t_ns),
        )
    finally:
        thread.stop()


def _made(proxies: Proxies) -> tuple[float, float]:
    """Seconds until all reduced pictures were there, and their MB."""
    begin = time.monotonic()
    while not proxies.is_done:
        if time.monotonic() - begin > LIMIT_S:
            raise TimeoutError(f"the reduced pictures are not there in {LIMIT_S:.0f} s")
        time.sleep(0.1)
    if proxies.problem or proxies.path is None:
        raise ValueError(f"no reduced pictures: {proxies.problem}")
    return time.monotonic() - begin, proxies.path.stat().st_size / 1e6
