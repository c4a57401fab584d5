"""A script to a film: every picture is drawn once, and encoded forward and backward.

Shown forward and then backward it goes on for as long as a camera streams, without a jump: drawing
takes five times as long as the film, and half a minute of it is enough for hours.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import closing
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from devices.video import H264Encoder
from scenes.mesh import PhysicalRoom
from sim.faults.device import Freeze
from sim.faults.fault import Fault, WayFault
from sim.faults.settings import Faults
from sim.reality.scanned import Scanned
from sim.rehearsal import SimulatedStep, simulate
from sim.scenarios.scenario import Scenario
from sim.wire.film.film import FilmFormat, PictureTruth
from sim.wire.film.film_file import FilmWriter
from sim.wire.film.layouts import Layout, lens_size_px, packed

Progress = Callable[[float, str], None]
"""Takes the share that is done and a note; whatever it raises cancels the film."""

NANOSECONDS = 1_000_000_000

LONGEST_S = 120.0
"""Longest film that is drawn, seconds: forward and backward 0.7 GB at 24 Mbit a second."""


@dataclass(frozen=True, slots=True)
class FilmOptions:
    """How a script is filmed.

    Attributes:
        size_px: width and height of the whole picture.
        fps: pictures a second.
        seconds: how much of the script, from its beginning; all of it if that is shorter.
        layout: how the lens pictures lie in the picture.
        bitrate: bits per second; that of the scenarios' cameras.
        keyframe_s: from one keyframe to the next, seconds. A receiver that connects, or lost a
            picture, waits up to that long. Ours is between what phones send, and what costs a
            tracker least (`devices/video.py`).

    Raises:
        ValueError: a value is out of range.
    """

    size_px: tuple[int, int] = (2880, 1440)
    fps: float = 30.0
    seconds: float = LONGEST_S
    layout: Layout = Layout.SIDE_BY_SIDE
    bitrate: int = 24_000_000
    keyframe_s: float = 1.0

    def __post_init__(self) -> None:
        lens_size_px(self.layout, self.size_px)
        limits = (("fps", 1.0, 120.0), ("seconds", 0.1, LONGEST_S), ("keyframe_s", 0.0, 10.0))
        for name, low, high in limits:
            value = float(getattr(self, name))
            if not low <= value <= high:
                raise ValueError(f"film: {name} {value:g}, wanted {low:g} to {high:g}")
        if not 100_000 <= self.bitrate <= 200_000_000:
            raise ValueError(f"film: {self.bitrate} bit/s, wanted 0.1 to 200 Mbit/s")

    @property
    def keyframe_interval(self) -> int:
        """Pictures from one keyframe to the next."""
        return max(1, round(self.keyframe_s * self.fps))


def filmed_scenario(scenario: Scenario, options: FilmOptions, more: tuple[Fault, ...]) -> Scenario:
    """The scenario as the film's camera has it.

    What a scenario has happen on the way (loss, delay) or to the video (a freeze) is left out:
    that is the wire's, which has faults of its own.
    """
    kept = [f for f in scenario.faults.each if not isinstance(f, WayFault | Freeze)]
    camera = replace(
        scenario.camera,
        fps=options.fps,
        lens_size_px=lens_size_px(options.layout, options.size_px),
        bitrate_mbps=options.bitrate / 1e6,
    )
    duration_s = min(scenario.duration_s, options.seconds)
    faults = Faults((*kept, *more))
    return replace(scenario, camera=camera, duration_s=duration_s, faults=faults)


def draw_film(
    folder: Path,
    room: PhysicalRoom,
    scenario: Scenario,
    *,
    seed: int,
    options: FilmOptions,
    scanned: Scanned | None = None,
    progress: Progress = lambda _done, _note: None,
) -> None:
    """Write the film of a script into a folder.

    Args:
        folder: an empty one.
        room: the physical room.
        scenario: as `filmed_scenario` gives it.
        seed: decides everything random.
        options: how it is filmed.
        scanned: needed for a room that is made of splats.
        progress: see `Progress`.

    Raises:
        ScenarioError: the scenario doesn't fit the room.
        OSError: the disk is full.
    """
    form = FilmFormat(*options.size_px, options.fps, options.layout.value, options.bitrate)
    writer = FilmWriter(folder, scenario.name, form)
    steps = simulate(
        room,
        scenario,
        seed=seed,
        scanned=scanned,
        keyframe_interval=options.keyframe_interval,
    )
    try:
        with closing(steps):  # pyright: ignore[reportArgumentType] - it is a generator
            _write(writer, steps, scenario.frame_count, options=options, progress=progress)
    finally:
        writer.close()


def _write(
    writer: FilmWriter,
    steps: Iterator[SimulatedStep],
    frames: int,
    *,
    options: FilmOptions,
    progress: Progress,
) -> None:
    forward = _Forward(options)
    backward = _Backward(options)
    for count, step in enumerate(steps):
        picture = packed(step.taken, options.layout, step.frame.rig.lenses[0])
        data, keyframe = forward.encode(picture, step)
        writer.add_unit(data, t_ns=_time(count, options.fps), keyframe=keyframe, shows=count)
        writer.add_picture(_truth(step))
        writer.add_events([e for e in step.events if e.kind not in QUIET])
        backward.take(picture, count)
        progress(min(1.0, (count + 1) / frames), f"picture {count + 1} of {frames}")
    backward.end()
    number = backward.last + 1
    for shows, data, keyframe in backward.units():
        writer.add_unit(data, t_ns=_time(number, options.fps), keyframe=keyframe, shows=shows)
        number += 1
    writer.finish(_time(number, options.fps))


QUIET = frozenset({"action"})
"""Kinds of events that are not of the camera: what people begin to do."""


def _time(number: int, fps: float) -> int:
    return round(number * NANOSECONDS / fps)


def _truth(step: SimulatedStep) -> PictureTruth:
    truth = step.truth.recorded
    return PictureTruth(
        truth.t_ns,
        truth.world_from_object,
        truth.visible_fraction,
        truth.world_from_rig,
        truth.faults,
    )


class _Forward:
    """Access units in the order of the script: the rehearsal's own where it packs as we do."""

    def __init__(self, options: FilmOptions) -> None:
        own = options.layout is not Layout.SIDE_BY_SIDE
        self._encoder = _encoder(options) if own else None

    def encode(self, picture: NDArray[np.uint8], step: SimulatedStep) -> tuple[bytes, bool]:
        packet = step.packet
        if self._encoder is not None:
            packet = self._encoder.encode(picture, packet.seq, packet.t_ns)[0]
        return packet.data, packet.keyframe


class _Backward:
    """The same pictures from the last but one to the second.

    Encoded a group at a time, as soon as the group is there, so that only its pictures are held:
    each group is complete in itself, and the last one is sent first.
    """

    def __init__(self, options: FilmOptions) -> None:
        self._encoder = _encoder(options)
        self._interval = options.keyframe_interval
        self._held: list[tuple[int, NDArray[np.uint8]]] = []
        self._groups: list[list[tuple[int, bytes, bool]]] = []
        self._t_ns = 0
        self._step_ns = math.ceil(NANOSECONDS / options.fps)
        self.last = -1

    def take(self, picture: NDArray[np.uint8], number: int) -> None:
        """The next picture of the script."""
        if len(self._held) > self._interval:
            # The newest is held back: the film's last picture is shown once.
            newest = self._held.pop()
            self._encode()
            self._held = [newest]
        if number > 0:
            self._held.append((number, picture))
        self.last = number

    def end(self) -> None:
        """There are no more pictures."""
        self._held = self._held[:-1]
        self._encode()

    def units(self) -> Iterator[tuple[int, bytes, bool]]:
        """Number of each unit's picture, its bytes, and whether it is a keyframe."""
        for group in reversed(self._groups):
            yield from group

    def _encode(self) -> None:
        group: list[tuple[int, bytes, bool]] = []
        self._encoder.begin_group()
        for number, picture in reversed(self._held):
            self._t_ns += self._step_ns
            packet = self._encoder.encode(picture, number, self._t_ns)[0]
            group.append((number, packet.data, packet.keyframe))
        if group:
            self._groups.append(group)


def _encoder(options: FilmOptions) -> H264Encoder:
    return H264Encoder(
        *options.size_px,
        options.fps,
        options.bitrate,
        keyframe_interval=options.keyframe_interval,
    )
