"""Port 3810 of a simulated HoloLens: its camera, drawn while it is asked for."""

from __future__ import annotations

import logging
from collections import deque
from contextlib import suppress
from dataclasses import dataclass, replace

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
from sim.hololens.drawing.drawer import Drawer, DrawingError
from sim.hololens.drawing.scenery import Scenery, Shot
from sim.hololens.faults import HoloLensFaultKind
from sim.hololens.ports.camera import calibration_of, lens_at, trailer_of
from sim.hololens.ports.serving import Guest, HeadsetPort
from sim.hololens.world import Counts, HeadsetWorld

log = logging.getLogger(__name__)

STARTS_NS = 300_000_000
"""Time that the camera takes to start, nanoseconds; a real one takes a second or two."""

SHARED_FORM = (1504, 846, 30)
"""Width, height and rate of a camera that another app on the headset has chosen: in shared mode a
client's own wishes do not count, and it reads the size from each picture's trailer."""

AHEAD = 4
"""Pictures that are made before their time, so that one of 0.1 s delays none. The head's place then
is known; what moves is drawn where it is once a picture is ordered."""

REMEMBERED = 16
"""Pictures by which the next are ordered, chosen: of half a second. Where only the lateness of the
last one counted, one in twenty came 0.5 to 0.8 s late in three sessions on two busy cores."""

HANG_UP_S = 2.0
"""Longest wait for a client that has said all it can say."""

SPARED_BYTES = 16
"""Bytes at a picture's beginning that stay whole where others break: its delimiter and header."""

MAX_BROKEN = 8
"""Most wrong bytes of a broken picture."""


@dataclass(frozen=True, slots=True, eq=False)
class _Ordered:
    """A picture that is drawn beside: for which time, through which lens."""

    t_ns: int
    lens: Pinhole


class Leads:
    """How long before their time pictures are to be ordered, `AHEAD` at once.

    Args:
        least_ns: where drawing takes no time.
    """

    def __init__(self, least_ns: int) -> None:
        self._least_ns = least_ns
        self._took_ns: deque[int] = deque(maxlen=REMEMBERED)

    def add(self, took_ns: int) -> None:
        """Take how long the next picture was drawn."""
        self._took_ns.append(took_ns)

    @property
    def lead_ns(self) -> int:
        """As long as the slowest `AHEAD` in a row of the last pictures were drawn."""
        took = list(self._took_ns)
        in_a_row = (sum(took[first : first + AHEAD]) for first in range(len(took)))
        return max((self._least_ns, *in_a_row))


class VideoPort:
    """Personal video.

    A picture is drawn and coded before its time, as fast as that goes, and sent at its time.

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
        self._drawer: Drawer | None = None
        self._waiting = 0
        self._is_shared, self._form = False, SHARED_FORM
        self.counts = Counts()
        self._port = HeadsetPort(
            place, world, serve=self._serve, name="hololens video port", counts=self.counts
        )

    @property
    def number(self) -> int:
        """The real number of the port."""
        return self._port.number

    def close(self) -> None:
        """Stop; waits for the thread and for the process that draws."""
        self._port.close()
        self._end_drawing()

    def _serve(self, guest: Guest) -> None:
        opening = read_opening(guest.take)
        match opening:
            case StartVideo():
                self._is_shared = opening.shared
                if self._world.camera_on_ns is None:
                    self._world.camera_on_ns = self._world.clock.now_ns() + STARTS_NS
                self._begin_drawing()
                guest.wait_for_end(HANG_UP_S)
            case StopVideo():
                self._world.camera_on_ns = None
                guest.wait_for_end(HANG_UP_S)
            case CalibrationRequest(width, height, fps):
                _check(width, height, fps=fps)
                lens = lens_at(self._world.now_s(), width, height_px=height)
                guest.send(encode_calibration(calibration_of(lens)))
                self.counts.messages += 1
            case VideoRequest():
                if self._is_shared:
                    width, height, fps = self._form
                    opening = replace(opening, width_px=width, height_px=height, fps=fps)
                _check(opening.width_px, opening.height_px, fps=opening.fps)
                self._form = opening.width_px, opening.height_px, opening.fps
                try:
                    self._stream(guest, opening)
                except DrawingError as error:
                    log.warning("%s; drawing begins anew with the next client", error)
                    self._end_drawing()
                finally:
                    self._finish_drawing()

    def _stream(self, guest: Guest, request: VideoRequest) -> None:
        """Send pictures until the client leaves or the camera is stopped."""
        # A client may leave the start to the one who was here before.
        world = self._world
        began_ns = world.camera_on_ns or world.clock.now_ns() + STARTS_NS
        world.camera_on_ns = began_ns
        period_ns = round(1e9 / request.fps) * max(1, request.divisor)
        # The first picture of a size takes long to draw, and is for nobody.
        drawer = self._begin_drawing()
        drawer.code(None)
        self._order(request, world.clock.now_ns())
        self._take()
        drawer.code(request)
        due_ns, leads = max(world.clock.now_ns(), began_ns), Leads((AHEAD - 1) * period_ns)
        ordered: deque[_Ordered] = deque()
        while world.camera_is_on():
            while len(ordered) < AHEAD:
                ready_ns = world.clock.now_ns() + leads.lead_ns
                due_ns = next_due_ns(due_ns, period_ns, ready_ns=ready_ns)
                ordered.append(self._order(request, due_ns))
            unit, shown = self._take(), ordered.popleft()
            leads.add(drawer.took_ns)
            world.clock.sleep_until(shown.t_ns)
            self._send(guest, shown, unit=unit, has_pose=request.has_pose)

    def _order(self, request: VideoRequest, t_ns: int) -> _Ordered:
        """Have a picture drawn as it will be then."""
        world, t_s = self._world, self._world.seconds(t_ns)
        lens = lens_at(t_s, request.width_px, height_px=request.height_px)
        until_ns = t_ns - world.clock.now_ns()
        burnt_us = (world.glass_ns() + until_ns) // 1000 if self._has_time_code else None
        shot = Shot(lens, world.room_from_camera(t_s), self._scenery.poses(), burnt_us)
        self._begin_drawing().order(shot)
        self._waiting += 1
        return _Ordered(t_ns, lens)

    def _begin_drawing(self) -> Drawer:
        """Return what draws; it takes a second until it can."""
        if self._drawer is None:
            self._drawer = Drawer(self._scenery.drawn)
        return self._drawer

    def _take(self) -> bytes:
        """Wait for the picture that was ordered first, coded."""
        assert self._drawer is not None, "no picture was ordered"
        self._waiting -= 1
        return self._drawer.take()

    def _finish_drawing(self) -> None:
        """Let what is being drawn for a client that has left be drawn, for nobody."""
        while self._waiting and self._drawer is not None:
            with suppress(DrawingError):
                self._take()

    def _end_drawing(self) -> None:
        drawer, self._drawer, self._waiting = self._drawer, None, 0
        if drawer is not None:
            drawer.close()

    def _send(self, guest: Guest, shot: _Ordered, *, unit: bytes, has_pose: bool) -> None:
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


def next_due_ns(before_ns: int, period_ns: int, *, ready_ns: int) -> int:
    """Return the time of the picture after one, by the camera's beat.

    Where drawing is late, pictures are left out, so that none is sent late.

    Args:
        before_ns: of the picture before.
        period_ns: between two pictures.
        ready_ns: when a picture that is ordered now can be there.
    """
    return before_ns + period_ns * max(1, -((before_ns - ready_ns) // period_ns))


def _check(width_px: int, height_px: int, *, fps: int) -> None:
    rates = FORMATS.get((width_px, height_px), ())
    if fps not in rates:
        raise WireError(f"personal video: {width_px}×{height_px} at {fps}, no format of the camera")


def _broken(unit: bytes, guest: Guest) -> bytes:
    damaged = bytearray(unit)
    for _ in range(guest.random.randint(1, MAX_BROKEN)):
        if len(damaged) > SPARED_BYTES:
            at = guest.random.randrange(SPARED_BYTES, len(damaged))
            damaged[at] = guest.random.getrandbits(8)
    return bytes(damaged)
