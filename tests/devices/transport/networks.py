"""Networks that fail on command: within this process, and a real router behind relays."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from pathlib import Path

from benchmarks.wire.relay import TcpRelay
from devices.transport.access import FOLDER
from devices.transport.keys import MemberRole
from devices.transport.local import Exchange, LocalTransport
from devices.transport.passes import Admitted, admit, keep_building, read_pass
from scenes.workers.child_process import ChildProcess, module_environment

ROUTER_FILE = Path(__file__).resolve().parents[3] / "docs" / "deployment" / "router.json5"
"""The configuration that the documentation shows: tests run this very file."""

START_S = 60.0
CODE = """
import json, sys
from devices.transport.zenoh_transport import ZenohRouter
router = ZenohRouter(json.loads(sys.stdin.readline()))
print("up", flush=True)
sys.stdin.read()
"""


class Cuttable:
    """A transport that can be cut off, as by a cable that is pulled."""

    def __init__(self, inner):
        self.inner, self.is_cut = inner, False

    def put(self, key, data):
        if not self.is_cut:
            self.inner.put(key, data)

    def subscribe(self, pattern, handler):
        return self.inner.subscribe(pattern, lambda k, d: None if self.is_cut else handler(k, d))

    def serve(self, pattern, answer):
        return self.inner.serve(pattern, lambda k, q: None if self.is_cut else answer(k, q))

    def ask(self, key, question, *, answered):
        if not self.is_cut:
            self.inner.ask(key, question, answered=answered)

    def close(self):
        self.inner.close()


class LocalNetwork:
    """All in one process; `split` cuts the last one off, a killed router everybody."""

    def __init__(self):
        self._exchange = Exchange()
        self._made = []

    def open(self, role, name):
        made = Cuttable(LocalTransport(self._exchange))
        self._made.append(made)
        return made

    def split(self):
        self._made[-1].is_cut = True

    def heal(self):
        for made in self._made:
            made.is_cut = False

    def kill_router(self):
        for made in self._made:
            made.is_cut = True

    start_router = heal

    def close(self):
        for made in self._made:
            made.close()


def without_comments(text):
    return "".join(line for line in text.splitlines(True) if not line.lstrip().startswith("//"))


class ZenohNetwork:
    """A router in a process of its own with the rules of the documentation's file.

    Everybody has a relay of their own; `split` makes a black hole of the last one.
    """

    def __init__(self, folder):
        keep_building(folder, names=("127.0.0.1",))
        self.folder = folder
        self._fields = json.loads(
            without_comments(ROUTER_FILE.read_text().replace(FOLDER, str(folder)))
        )
        self._port = 0
        self._router = None
        self._relays = []
        self._made = []
        self.start_router()

    @property
    def address(self):
        return f"127.0.0.1:{self._port}"

    def start_router(self):
        if not self._port:
            import socket

            with socket.create_server(("127.0.0.1", 0)) as probe:
                self._port = probe.getsockname()[1]
        self._fields["listen"]["endpoints"] = [f"tls/{self.address}"]
        lines = []
        self._router = ChildProcess(
            [sys.executable, "-c", CODE],
            stdin=subprocess.PIPE,
            on_line=lines.append,
            last_words=20,
            environment=module_environment(),
        )
        self._router.say(json.dumps(self._fields))
        deadline = time.monotonic() + START_S
        while not lines:
            if time.monotonic() > deadline or not self._router.is_running:
                raise AssertionError(f"the router does not start: {self._router.last_words()}")
            time.sleep(0.01)

    def kill_router(self):
        self._router.kill()
        self._router.join(120)
        self._router.end()

    def pass_for(self, role, name):
        return read_pass(admit(self.folder, Admitted(MemberRole(role), name)))

    def open(self, role, name):
        from devices.transport.zenoh_transport import ZenohTransport

        relay = TcpRelay(("127.0.0.1", self._port))
        self._relays.append(relay)
        made = ZenohTransport(f"127.0.0.1:{relay.address[1]}", self.pass_for(role, name))
        self._made.append(made)
        return made

    def split(self):
        self._relays[-1].begin_hole()

    def heal(self):
        self._relays[-1].end_hole()

    def close(self):
        for made in self._made:
            made.close()
        for relay in self._relays:
            relay.close()
        self.kill_router()
