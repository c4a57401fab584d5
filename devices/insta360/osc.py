"""Control of an Insta360 camera over HTTP (Open Spherical Camera): stills, recording, clock, files.

The interface has no live preview: that is `preview.py`. One request at a time, each on a connection
of its own; the vendor asks for no more than one a second. There is neither password nor encryption.
"""

from __future__ import annotations

import http.client
import json
import socket
import threading
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Literal, TypeVar, cast

from devices.clock import Clock
from devices.insta360.errors import (
    CameraProtocolError,
    CameraRefusedError,
    CameraTimeoutError,
    CameraUnreachableError,
    printable,
)
from devices.insta360.osc_replies import (
    MAX_BODY_BYTES,
    OscCommand,
    OscFile,
    OscInfo,
    OscState,
    read_command,
    read_files,
    read_info,
    read_state,
    read_urls,
)

PORT = 80
"""Port that cameras listen on."""

HEADERS = {
    "Accept": "application/json",
    "Content-Type": "application/json;charset=utf-8",
    "X-XSRF-Protected": "1",
    "Connection": "close",
}

REQUEST_S = 5.0
"""How long a whole request may take, the reply included."""

POLL_S = 1.0
"""Time between two questions about a command, as the vendor asks."""

COMMAND_S = 60.0
"""How long a command may take; a stitched HDR picture takes about 10 s."""

T = TypeVar("T")


class OscClient:
    """One camera; holds no connection.

    Args:
        host: name or address of the camera.
        port: where it listens.
        clock: for the time between two questions.
        request_s: how long a request may take.
    """

    def __init__(
        self, host: str, port: int = PORT, *, clock: Clock, request_s: float = REQUEST_S
    ) -> None:
        self._host, self._port = host, port
        self._clock = clock
        self._request_s = request_s
        self._where = f"camera http://{host}:{port}"

    def info(self) -> OscInfo:
        """Model, serial number, firmware.

        Raises:
            CameraUnreachableError, CameraTimeoutError, CameraProtocolError: see `errors.py`.
        """
        return self._read("GET", "/osc/info", None, read_info)

    def state(self) -> OscState:
        """Battery and card.

        Raises:
            CameraUnreachableError, CameraTimeoutError, CameraProtocolError: see `errors.py`.
        """
        return self._read("POST", "/osc/state", {}, read_state)

    def options(self, names: Sequence[str]) -> Mapping[str, Any]:
        """Values of options, such as "captureMode" or "_sysTimestamp".

        Raises:
            CameraRefusedError: there is no such option. The others: see `errors.py`.
        """
        done = self.execute("camera.getOptions", {"optionNames": list(names)})
        options = done.results.get("options")
        return cast(dict[str, Any], options) if isinstance(options, dict) else {}

    def set_options(self, options: Mapping[str, Any]) -> None:
        """Change options.

        Raises:
            CameraRefusedError: there is no such option or value. The others: see `errors.py`.
        """
        self.execute("camera.setOptions", {"options": dict(options)})

    def take_picture(self, limit_s: float = COMMAND_S) -> tuple[str, ...]:
        """Take a picture and wait for it; where it is on the camera.

        Raises:
            CameraRefusedError: it is in video mode, not activated, or has no card.
            CameraTimeoutError: it is not done in time. The others: see `errors.py`.
        """
        return read_urls(self.finish(self.execute("camera.takePicture"), limit_s).results)

    def start_capture(self) -> None:
        """Start recording; set the option "captureMode" to "video" before.

        Raises:
            CameraRefusedError: it is in image mode, or records. The others: see `errors.py`.
        """
        self.execute("camera.startCapture")

    def stop_capture(self, limit_s: float = COMMAND_S) -> tuple[str, ...]:
        """Stop recording; where the videos are on the camera.

        Raises:
            CameraRefusedError: it does not record. The others: see `errors.py`.
        """
        return read_urls(self.finish(self.execute("camera.stopCapture"), limit_s).results)

    def files(
        self, kind: Literal["image", "video", "all"] = "all", *, most: int = 100
    ) -> tuple[OscFile, ...]:
        """List the files on the card, newest first, without thumbnails.

        Raises:
            CameraRefusedError: there is no card. The others: see `errors.py`.
        """
        wanted = {"fileType": kind, "entryCount": most, "maxThumbSize": 0}
        return read_files(self.execute("camera.listFiles", wanted).results)[:most]

    def execute(self, name: str, parameters: Mapping[str, Any] | None = None) -> OscCommand:
        """Send any command; done or in progress.

        Raises:
            CameraRefusedError: the camera's words are in the message. The others: see `errors.py`.
        """
        body: dict[str, Any] = {"name": name}
        if parameters is not None:
            body["parameters"] = dict(parameters)
        return self._accepted(name, self._read("POST", "/osc/commands/execute", body, read_command))

    def finish(self, command: OscCommand, limit_s: float = COMMAND_S) -> OscCommand:
        """Ask once a second until a command is done.

        Raises:
            CameraRefusedError: it failed. CameraTimeoutError: it is not done in time.
        """
        until_ns = self._clock.now_ns() + round(1e9 * limit_s)
        while command.state == "inProgress":
            now_ns = self._clock.now_ns()
            if now_ns >= until_ns:
                raise CameraTimeoutError(
                    f"{self._where}: {command.name} is not done after {limit_s:g} s "
                    f"({100 * command.completion:.0f} %)"
                )
            self._clock.sleep_until(min(now_ns + round(1e9 * POLL_S), until_ns))
            asked = {"id": command.command_id}
            now = self._read("POST", "/osc/commands/status", asked, read_command)
            command = self._accepted(command.name, now)
        return command

    def _accepted(self, name: str, command: OscCommand) -> OscCommand:
        if command.state == "error":
            words = printable(f"{command.error_code} {command.error_text}") or "without a reason"
            raise CameraRefusedError(f"{self._where}: refused {name}: {words}")
        return command

    def _read(
        self, method: str, path: str, value: Mapping[str, Any] | None, read: Callable[[bytes], T]
    ) -> T:
        """One request and its reply."""
        body = None if value is None else json.dumps(value).encode()
        status, reply = self._request(method, path, body)
        try:
            result = read(reply)
        except CameraProtocolError as error:
            said = f"HTTP status {status}" if status != http.client.OK else str(error)
            raise CameraProtocolError(
                f"{self._where}{path}: {said}; is this the camera's address?"
            ) from None
        if status != http.client.OK and not isinstance(result, OscCommand):
            raise CameraProtocolError(f"{self._where}{path}: HTTP status {status}")
        return result

    def _request(self, method: str, path: str, body: bytes | None) -> tuple[int, bytes]:
        connection = http.client.HTTPConnection(self._host, self._port, timeout=self._request_s)
        late = threading.Event()
        watch = threading.Timer(self._request_s, _hang_up, (connection, late))
        watch.daemon = True
        try:
            connection.connect()
            watch.start()
            reply = exchange(connection, method, path, body)
        except OSError as error:
            if late.is_set() or isinstance(error, TimeoutError):
                raise self._late(path) from None
            raise CameraUnreachableError(
                f"{self._where}: {error.strerror or error}; is the camera on, its Wi-Fi joined, "
                "and the address right?"
            ) from None
        except CameraProtocolError as error:
            if late.is_set():
                raise self._late(path) from None
            raise CameraProtocolError(
                f"{self._where}{path}: {error}; is this the camera's address?"
            ) from None
        finally:
            watch.cancel()
            connection.close()
        if late.is_set():
            raise self._late(path)
        return reply

    def _late(self, path: str) -> CameraTimeoutError:
        return CameraTimeoutError(
            f"{self._where}{path}: no whole reply within {self._request_s:g} s; the camera is busy "
            "or the Wi-Fi too weak"
        )


def exchange(
    connection: http.client.HTTPConnection, method: str, path: str, body: bytes | None
) -> tuple[int, bytes]:
    """Send a request over an open connection; the reply's status and body.

    At most one byte more than `MAX_BODY_BYTES` is read of a body.

    Raises:
        CameraProtocolError: the reply is no HTTP.
        OSError: the connection broke.
    """
    try:
        connection.request(method, path, body=body, headers=HEADERS)
        response = connection.getresponse()
        return response.status, response.read(MAX_BODY_BYTES + 1)
    except (http.client.HTTPException, ValueError, AttributeError) as error:
        # AttributeError: the connection was closed below a reply that was being read.
        why = printable(f"{type(error).__name__}: {error}")
        raise CameraProtocolError(f"no HTTP reply ({why})") from None


def _hang_up(connection: http.client.HTTPConnection, late: threading.Event) -> None:
    """End a request that takes too long, whatever it waits for."""
    late.set()
    try:
        connection.sock.shutdown(socket.SHUT_RDWR)
    except (OSError, AttributeError):
        return  # it was over already
