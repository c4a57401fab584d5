"""The headset's camera: received and decoded in a process of its own, handed to every consumer."""

from __future__ import annotations

import subprocess
import threading
from contextlib import suppress
from dataclasses import replace
from io import BufferedIOBase

from devices.adapter import Sink
from devices.clock import Clock
from devices.hololens.axes import camera_of, camera_pose
from devices.hololens.camera.process import READY, order_of
from devices.hololens.camera.received import (
    PICTURE,
    STATUS,
    UNIT,
    WANTS_CAMERA,
    read_message,
    read_picture,
    read_status,
    read_unit,
)
from devices.hololens.camera.stream import DecodedVideo, video_request
from devices.hololens.configuration import Configuration
from devices.hololens.links.connection import Connection, HeadsetError
from devices.hololens.links.fan_out import FanOut
from devices.hololens.links.health import StreamHealth
from devices.hololens.plan import MAX_RETRY_S, VideoOptions
from devices.hololens.values import PersonalVideoFrame, StreamState, StreamStatus
from devices.hololens.wire.personal_video import StartVideo, StopVideo, encode_opening
from devices.hololens.wire.remote_configuration import Request, Setting
from devices.hololens.wire.taking import WireError
from devices.messages import EncodedFrame
from devices.streams import StreamClosedError, StreamFullError
from scenes.workers.child_process import ChildProcess, module_command, module_environment
from scenes.workers.task import Task

READY_S, POLL_S = 10.0, 0.1
"""Longest wait for the camera to start, and how often it is asked, seconds; it takes 1 to 2 s."""

ASK_S = 1.0
"""Longest wait for one answer."""

STREAM_ID = "hololens-video"
"""Name of its packets in recordings."""

AGAIN_S = 1.0
"""Wait before a process that has died is started anew, seconds."""

LEAVING_S = 5.0
"""Longest wait for the process and the threads to end, seconds."""

LAST_WORDS = 20
"""Lines that the process says on standard error that are kept, for the message where it dies."""


class Video:
    """Personal video of one headset; starts at once.

    Args:
        address: of the port.
        clock: session time.
        options: what is asked for.
        configuration: of the same headset.
        packets: takes every encoded picture, in order; it must not block.
        retry_s: longest wait between two attempts to connect.

    Attributes:
        frames: every consumer's newest picture.
        health: its events.

    Raises:
        ValueError: the codec is none that the headset has.
    """

    def __init__(
        self,
        address: tuple[str, int],
        clock: Clock,
        *,
        options: VideoOptions,
        configuration: Configuration,
        packets: Sink[EncodedFrame] | None = None,
        retry_s: float = MAX_RETRY_S,
    ) -> None:
        video_request(options.width_px, options.height_px, fps=options.fps, codec=options.codec)
        self.frames: FanOut[PersonalVideoFrame] = FanOut()
        self.health = StreamHealth("video", clock)
        self._clock, self._options = clock, options
        self._configuration, self._packets = configuration, packets
        self._switch = CameraSwitch(address, clock, configuration=configuration)
        self._order = order_of(address, options, retry_s=retry_s, sends_units=packets is not None)
        self._said: StreamStatus | None = None
        self._recorded = 0
        self._starting: Task[None] | None = None
        self._process: ChildProcess | None = None
        self._task = Task("hololens video", self._run).start()

    def status(self) -> StreamStatus:
        """Return how it is doing: as seen here, with what the process has counted."""
        here, said = self.health.status(), self._said
        if said is None:
            return here
        return replace(
            here,
            received=max(here.received, said.received),
            received_bytes=said.received_bytes,
            connections=max(here.connections, said.connections),
            dropped=said.dropped + self.frames.dropped,
            damaged=said.damaged + here.damaged,
        )

    def close(self) -> None:
        """Hang up, and stop the camera; waits for the process and the threads.

        Raises:
            RuntimeError: they did not end.
        """
        self._task.cancel()
        process = self._process
        if process is not None:
            # The end of its standard input is its end.
            with suppress(OSError):
                process.stdin.close()
        if not self._task.join(LEAVING_S):
            raise RuntimeError(f"{self._task.name}: did not end within {LEAVING_S:g} s")
        if self._starting is not None:
            self._starting.cancel()
            self._starting.join(LEAVING_S)
        self.frames.close()
        self._switch.stop()

    def _run(self, task: Task[None]) -> None:
        """Have the process run; begin another where it dies, as a damaged stream may kill it."""
        while not task.is_cancelled:
            process = ChildProcess(
                module_command("devices.hololens.camera.process"),
                stdin=subprocess.PIPE,
                stdout=subprocess.PIPE,
                last_words=LAST_WORDS,
                environment=module_environment(),
            )
            self._process = process
            with suppress(OSError):
                process.say(self._order)
            self._read(task, process.stdout)
            self._end(process)
            if task.is_cancelled:
                break
            words = " / ".join(process.last_words()[-2:])
            self.health.damaged(f"the process that decodes has died, {process.code}: {words}")
            task.pause(AGAIN_S)
        self.health.closed()

    def _end(self, process: ChildProcess) -> None:
        with suppress(OSError):
            process.stdin.close()
        if process.wait(LEAVING_S / 2) is None:
            process.kill()
            process.wait(LEAVING_S / 2)
        process.stdout.close()

    def _read(self, task: Task[None], out: BufferedIOBase) -> None:
        while (message := read_message(out)) is not None and not task.is_cancelled:
            kind, body = message
            arrived_ns = self._clock.now_ns()
            if kind == PICTURE:
                self._hand_out(read_picture(body, arrived_ns))
            elif kind == STATUS:
                self._notice(read_status(body))
            elif kind == UNIT:
                self._record(body, arrived_ns)
            elif kind == WANTS_CAMERA and (self._starting is None or not self._starting.is_running):
                self._starting = Task("hololens camera", self._start_camera).start()

    def _start_camera(self, task: Task[None]) -> None:
        """Start the camera beside, since pictures and word of the process go on meanwhile."""
        try:
            self._switch.start(task.cancelled)
        except HeadsetError as error:
            self.health.waits(str(error))
        process = self._process
        if process is not None:
            with suppress(OSError, ValueError):
                process.say(READY)

    def _notice(self, said: StreamStatus) -> None:
        """Tell events of what the process says has changed."""
        before, self._said = self._said, said
        connections = 0 if before is None else before.connections
        if said.connections > connections:
            self.health.connected(said.reason)
        if said.state is StreamState.WAITING and (before is None or before.reason != said.reason):
            self.health.waits(said.reason)

    def _hand_out(self, decoded: DecodedVideo) -> None:
        picture = decoded.picture
        t_ns = self._configuration.session_ns(decoded.packet.ticks)
        try:
            camera = camera_of(decoded.trailer, picture.width_px, height_px=picture.height_px)
            pose = camera_pose(decoded.packet)
        except WireError as error:
            self.health.damaged(str(error))
            return
        arrived_ns = decoded.arrived_ns
        size = picture.width_px * picture.height_px
        self.health.came(size, delay_ns=None if t_ns is None else arrived_ns - t_ns)
        taken_ns = arrived_ns if t_ns is None else t_ns
        self.frames.put(
            PersonalVideoFrame(decoded.seq, taken_ns, arrived_ns, picture, camera, pose)
        )

    def _record(self, body: bytes, arrived_ns: int) -> None:
        if self._packets is None:
            return
        ticks, is_key, begins, data = read_unit(body)
        t_ns = self._configuration.session_ns(ticks)
        taken_ns = arrived_ns if t_ns is None else t_ns
        codec = self._options.codec
        frame = EncodedFrame(
            STREAM_ID, self._recorded, taken_ns, data, is_key, codec=codec, begins=begins
        )
        self._recorded += 1
        try:
            self._packets.put(frame)
        except (StreamFullError, StreamClosedError) as error:
            self.health.damaged(f"encoded pictures are not saved: {error}")


class CameraSwitch:
    """Starts and stops the camera.

    Args:
        address: of the camera's port.
        clock: session time.
        configuration: of the same headset.
    """

    def __init__(
        self, address: tuple[str, int], clock: Clock, *, configuration: Configuration
    ) -> None:
        self._address, self._clock = address, clock
        self._configuration = configuration

    def start(self, stop: threading.Event) -> None:
        """Start the camera, if it does not run already; ends once `stop` is set.

        Raises:
            HeadsetError: it did not start.
        """
        if self._is_running() is True:
            return
        self._say(StartVideo(), stop)
        until_ns = self._clock.now_ns() + round(1e9 * READY_S)
        while not stop.wait(POLL_S):
            # Where nobody answers, the stream itself says whether there is a camera.
            if self._is_running() is not False:
                return
            if self._clock.now_ns() > until_ns:
                raise HeadsetError(
                    f"{self._address[0]}: the camera did not start within {READY_S:g} s; another "
                    "app on the headset may have it: close that"
                )

    def stop(self) -> None:
        """Stop the camera, if the headset is there."""
        with suppress(HeadsetError):
            self._say(StopVideo(), threading.Event())

    def _is_running(self) -> bool | None:
        """Whether the camera runs; None where nobody says."""
        try:
            return self._configuration.ask(Request(Setting.VIDEO_STATUS), ASK_S) == (1,)
        except HeadsetError:
            return None

    def _say(self, opening: StartVideo | StopVideo, stop: threading.Event) -> None:
        """Send one message, and wait until it was taken."""
        connection = Connection(self._address, self._clock, stop=stop, silent_s=ASK_S)
        try:
            connection.send(encode_opening(opening))
            connection.is_over(POLL_S)
        finally:
            connection.close()
