"""Port 3810 of a simulated HoloLens: its camera, drawn while it is asked for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from devices.hololens.wire.packets import Packet, encode_packet
from devices.hololens.wire.personal_video import (
    FORMATS,
    CalibrationRequest,
    StartVideo,
    StopVideo,
    VideoRequest,
    encode_trailer,
    read_opening,
)
from devices.hololens.wire.taking import WireError
from devices.hololens.wire.video_formats import encode_calibration
from scenes.cameras import Pinhole
from sim.hololens.axes import NOT_LOCATED, camera_rows
from sim.hololens.encoder import encoder_for
from sim.hololens.faults import HoloLensFaultKind
from sim.hololens.ports.camera import calibration_of, lens_at, trailer_of
from sim.hololens.ports.serving import Guest, HeadsetPort
from sim.hololens.scenery import Painter, Scenery
from sim.hololens.time_code import burn
from sim.hololens.world import Counts, HeadsetWorld

STARTS_NS = 300_000_000
"""Time that the camera takes to start, nanoseconds; a real one takes a second or two."""

HANG_UP_S = 2.0
"""Longest wait for a client that has said all it can say."""

SPARED_BYTES = 16
"""Bytes at a picture's beginning that stay whole where others break: its delimiter and header."""

MOST_BROKEN = 8
"""Most wrong bytes of a broken picture."""


@dataclass(frozen=True, slots=True, eq=False)
class _Shot:
    """A picture that is drawn, and what it shows."""

    t_ns: int
    lens: Pinhole
    rgb: NDArray[np.uint8]


class VideoPort:
    """Personal video.

    A picture is drawn before its time, as fast as that goes, and coded and sent at its time.

    Args:
        place: host and port.
        world: what all ports share.
        scenery: what is seen.
        has_time_code: whether the machine's time is burnt into every picture.

    Raises:
        OSError: the port is taken.
    """

    def __init__(
        self,
        place: tuple[str, int],
        world: HeadsetWorld,
        *,
        scenery: Scenery,
        has_time_code: bool,
    ) -> None:
        self._world, self._scenery = world, scenery
        self._has_time_code = has_time_code
        self._painter: tuple[tuple[int, int], Painter] | None = None
        self.counts = Counts()
        self._port = HeadsetPort(
            place, world, serve=self._serve, name="hololens video port", counts=self.counts
        )

    @property
    def number(self) -> int:
        """The real number of the port."""
        return self._port.number

    def close(self) -> None:
        """Stop; waits for the thread."""
        self._port.close()

    def _serve(self, guest: Guest) -> None:
        opening = read_opening(guest.take)
        match opening:
            case StartVideo():
                if self._world.camera_on_ns is None:
                    self._world.camera_on_ns = self._world.clock.now_ns() + STARTS_NS
                guest.wait_for_end(HANG_UP_S)
            case StopVideo():
                self._world.camera_on_ns = None
                guest.wait_for_end(HANG_UP_S)
            case CalibrationRequest(width, height, fps):
                _check(width, height, fps)
                lens = lens_at(self._world.now_s(), width, height)
                guest.send(encode_calibration(calibration_of(lens)))
                self.counts.messages += 1
            case VideoRequest():
                _check(opening.width_px, opening.height_px, opening.fps)
                self._stream(guest, opening)

    def _stream(self, guest: Guest, request: VideoRequest) -> None:
        """Send pictures until the client leaves or the camera is stopped."""
        # A client may leave the start to the one who was here before.
        began_ns = self._world.camera_on_ns or self._world.clock.now_ns() + STARTS_NS
        self._world.camera_on_ns = began_ns
        painter = self._painter_of(request.width_px, request.height_px)
        encoder = encoder_for(request)
        period_ns = round(1e9 / request.fps) * max(1, request.divisor)
        # The first picture of another size takes long to draw; later ones have their time.
        self._draw(painter, request, self._world.clock.now_ns())
        due_ns = max(self._world.clock.now_ns(), began_ns) + period_ns
        while self._world.camera_is_on():
            shot = self._draw(painter, request, due_ns)
            self._world.clock.sleep_until(due_ns)
            if self._has_time_code:
                burn(shot.rgb, self._world.glass_ns() // 1000)
            self._send(guest, shot, encoder.encode(shot.rgb), has_pose=request.has_pose)
            late = max(0, self._world.clock.now_ns() - due_ns) // period_ns
            due_ns += period_ns * (1 + late)

    def _draw(self, painter: Painter, request: VideoRequest, t_ns: int) -> _Shot:
        t_s = self._world.seconds(t_ns)
        lens = lens_at(t_s, request.width_px, request.height_px)
        rgb = painter.draw(lens, self._world.room_from_camera(t_s))
        return _Shot(t_ns, lens, np.array(rgb))

    def _send(self, guest: Guest, shot: _Shot, unit: bytes, *, has_pose: bool) -> None:
        world, t_s = self._world, self._world.seconds(shot.t_ns)
        if guest.random.random() < world.faults.size_of(HoloLensFaultKind.BROKEN, t_s):
            unit = _broken(unit, guest)
        payload = unit + encode_trailer(trailer_of(shot.lens, t_s))
        pose = None
        if has_pose:
            room_from_world = world.room_from_world(t_s)
            seen_from = room_from_world.inverse() @ world.room_from_camera(t_s)
            pose = NOT_LOCATED if world.is_lost(t_s) else camera_rows(seen_from)
        if guest.random.random() < world.faults.size_of(HoloLensFaultKind.DROP, t_s):
            return
        guest.send(encode_packet(Packet(world.ticks(shot.t_ns), payload, pose)))
        self.counts.messages += 1

    def _painter_of(self, width_px: int, height_px: int) -> Painter:
        if self._painter is None or self._painter[0] != (width_px, height_px):
            if self._painter is not None:
                self._painter[1].close()
            painter = self._scenery.painter(width_px, height_px)
            self._painter = ((width_px, height_px), painter)
        return self._painter[1]


def _check(width_px: int, height_px: int, fps: int) -> None:
    rates = FORMATS.get((width_px, height_px), ())
    if fps not in rates:
        raise WireError(f"personal video: {width_px}×{height_px} at {fps}, no format of the camera")


def _broken(unit: bytes, guest: Guest) -> bytes:
    damaged = bytearray(unit)
    for _ in range(guest.random.randint(1, MOST_BROKEN)):
        if len(damaged) > SPARED_BYTES:
            at = guest.random.randrange(SPARED_BYTES, len(damaged))
            damaged[at] = guest.random.getrandbits(8)
    return bytes(damaged)
