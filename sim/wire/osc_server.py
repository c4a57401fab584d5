"""A simulated Insta360 camera's HTTP interface on a socket; `osc_camera.py` is what it does.

Real cameras listen on port 80, and some programs ask only there. Loopback unless another address is
given; the protocol has no password.
"""

from __future__ import annotations

import json
import socket
import threading
from dataclasses import dataclass
from http.server import BaseHTTPRequestHandler, HTTPServer
from random import Random
from socketserver import TCPServer, ThreadingMixIn
from typing import Any, cast

from scenes.workers.task import Task
from sim.wire.osc_camera import OscCamera

LARGEST_REQUEST_BYTES = 1 << 16
"""Limit of a request's body; the longest that a client sends is about 1 kB."""

MAX_CONNECTIONS = 16
"""Connections at a time; further ones are closed at once."""

WAIT_S = 5.0
"""How long a client may say nothing before the camera hangs up."""

REQUEST_S = 15.0
"""How long a whole request may take."""


@dataclass(frozen=True, slots=True)
class OscFaults:
    """Faults of the camera; may be exchanged while it runs.

    Attributes:
        delay_s: replies are that late.
        half_open: requests are taken and never answered.
        garbage: random bytes instead of replies.
    """

    delay_s: float = 0.0
    half_open: bool = False
    garbage: bool = False


class OscServer:
    """Listens from the start until `close`.

    Args:
        camera: what it does.
        host: address to listen at.
        port: 0 for any free one.
        seed: of garbage.

    Attributes:
        faults: what is wrong now.

    Raises:
        OSError: the port is taken.
    """

    def __init__(
        self, camera: OscCamera, *, host: str = "127.0.0.1", port: int = 0, seed: int = 0
    ) -> None:
        self.faults = OscFaults()
        self._camera, self._random = camera, Random(seed)
        self._lock = threading.Lock()
        self._task = Task("camera HTTP", lambda _: self._http.serve_forever(0.1))
        self._http = _Http((host, port), self)
        self._task.start()

    @property
    def address(self) -> tuple[str, int]:
        """Address at which it listens."""
        host, port = self._http.server_address[:2]
        return str(host), port

    @property
    def failures(self) -> int:
        """Requests that broke off on the way."""
        return self._http.failures

    def close(self) -> None:
        """Stop listening; harmless when closed."""
        self._task.cancel()
        self._http.shutdown()
        self._task.join()
        self._http.server_close()

    def answer(self, path: str, value: dict[str, Any], base_url: str) -> tuple[int, bytes]:
        """HTTP status and body of a reply."""
        with self._lock:
            status, reply = self._camera.answer(path, value, base_url)
        return status, json.dumps(reply).encode()

    def file(self, path: str) -> bytes | None:
        """Contents of a file on the card."""
        with self._lock:
            return self._camera.file(path)

    def garbage(self) -> bytes:
        """Random bytes."""
        with self._lock:
            return self._random.randbytes(2048)

    def wait(self, seconds: float) -> None:
        """Wait, but not longer than the server lives."""
        self._task.pause(seconds)


class _Http(ThreadingMixIn, HTTPServer):
    """A thread a connection, but not more than `MAX_CONNECTIONS`; silent about broken ones."""

    daemon_threads = True
    allow_reuse_address = True
    request_queue_size = 2 * MAX_CONNECTIONS

    def __init__(self, address: tuple[str, int], osc: OscServer) -> None:
        self.osc = osc
        self.failures = 0
        self._room = threading.BoundedSemaphore(MAX_CONNECTIONS)
        super().__init__(address, _Handler)

    def server_bind(self) -> None:
        """Without asking a name server for the machine's name, as `HTTPServer` does."""
        TCPServer.server_bind(self)

    def process_request(self, request: Any, client_address: Any) -> None:
        if not self._room.acquire(blocking=False):
            self.shutdown_request(request)
            return
        super().process_request(request, client_address)

    def process_request_thread(self, request: Any, client_address: Any) -> None:
        late = threading.Timer(REQUEST_S, _hang_up, (request,))
        late.daemon = True
        late.start()
        try:
            super().process_request_thread(request, client_address)
        finally:
            late.cancel()
            self._room.release()

    def handle_error(self, request: Any, client_address: Any) -> None:
        self.failures += 1


def _hang_up(connection: socket.socket) -> None:
    try:
        connection.shutdown(socket.SHUT_RDWR)
    except OSError:
        return  # it was over already


class _Handler(BaseHTTPRequestHandler):
    """One request; the connection is closed after it."""

    timeout = WAIT_S
    protocol_version = "HTTP/1.0"
    server_version, sys_version = "camera", ""

    def log_message(self, format: str, *args: Any) -> None:
        return

    def do_GET(self) -> None:
        """`/osc/info` and files."""
        osc = cast(_Http, self.server).osc
        contents = osc.file(self.path)
        if contents is not None:
            self._reply(200, contents, "application/octet-stream")
        elif self.path == "/osc/info":
            self._answer({})
        else:
            self._reply(404, b"{}")

    def do_POST(self) -> None:
        """`/osc/state` and commands."""
        try:
            size = int(self.headers.get("Content-Length", ""))
        except ValueError:
            size = -1
        if self.headers.get("X-XSRF-Protected") != "1":
            self._reply(403, b'{"error": {"code": "missingHeader"}}')
        elif size < 0:
            self._reply(411, b"{}")
        elif size > LARGEST_REQUEST_BYTES:
            self._reply(413, b"{}")
        else:
            self._answer(_object(self.rfile.read(size)))

    def _answer(self, value: dict[str, Any] | None) -> None:
        if value is None:
            self._reply(400, b'{"error": {"code": "invalidParameterValue"}}')
            return
        osc = cast(_Http, self.server).osc
        host, port = osc.address
        status, body = osc.answer(self.path, value, f"http://{host}:{port}")
        self._reply(status, body)

    def _reply(
        self, status: int, body: bytes, kind: str = "application/json;charset=utf-8"
    ) -> None:
        osc = cast(_Http, self.server).osc
        faults = osc.faults
        osc.wait(REQUEST_S if faults.half_open else faults.delay_s)
        if faults.half_open:
            return
        if faults.garbage:
            self.wfile.write(osc.garbage())
            return
        self.send_response(status)
        self.send_header("Content-Type", kind)
        self.send_header("Content-Length", str(len(body)))
        self.end_headers()
        self.wfile.write(body)


def _object(body: bytes) -> dict[str, Any] | None:
    """A request's JSON object, empty for an empty body; None for anything else."""
    if not body.strip():
        return {}
    try:
        value = json.loads(body)
    except (ValueError, RecursionError):
        return None
    return cast(dict[str, Any], value) if isinstance(value, dict) else None
