"""A bench whose live session has doors that are made of nothing."""

from __future__ import annotations

import time
from dataclasses import replace
from types import SimpleNamespace

import pytest

from devices.hub.contract import Invitation
from devices.hub.roles import Person, Role
from studio.app.model.documents.document import Document
from studio.app.model.runs.guests import Guests
from studio.app.model.settings import Settings
from studio.app.model.workbench import Workbench

S = 1_000_000_000


class FakeHub:
    """Codes and people in lists."""

    def __init__(self, doors, url):
        self.doors, self.url = doors, url
        self.here: dict[str, Person] = {}
        self.codes: list[str] = []
        self.revoked: list[str] = []
        self.is_voice_recorded = False

    def record_voices(self, *, is_recorded):
        self.is_voice_recorded = is_recorded

    def people(self):
        return tuple(self.here.values())

    def invite(self, role=Role.REMOTE):
        code = f"{123456 + len(self.codes)}"
        self.codes.append(code)
        return Invitation(code, f"{self.url}#code={code}", role, self.doors.now_ns() + 120 * S)

    def revoke(self, code):
        self.revoked.append(code)

    def set_role(self, person_id, role):
        self.here[person_id] = replace(self.here[person_id], role=role)

    def mute(self, person_id, *, is_muted):
        self.here[person_id] = replace(self.here[person_id], is_muted=is_muted)

    def give_pen(self, person_id):
        if person_id is not None and self.here[person_id].role is Role.SPECTATOR:
            raise ValueError("hub: draws nothing")
        self.here = {
            key: replace(each, has_pen=key == person_id) for key, each in self.here.items()
        }

    def remove(self, person_id):
        del self.here[person_id]

    def come(self, name, role=Role.REMOTE, **values):
        number = len(self.here) + 1
        person = Person(f"p{number}", number, name, role, **values)
        self.here[person.person_id] = person
        return person


class FakeDoors:
    """Doors without sockets; `fails` is raised by the next opening."""

    def __init__(self):
        self.hub = self.hosting = self.fails = None
        self.t_ns = 0

    def open(self, hosting):
        if self.fails is not None:
            raise self.fails
        host = "https://192.168.1.20:8443/" if hosting.is_open else "http://127.0.0.1:8080/"
        self.hub, self.hosting = FakeHub(self, host), hosting
        return self.hub

    def close(self):
        self.hub = self.hosting = None

    def now_ns(self):
        return self.t_ns


class NoHistory:
    undoes = redoes = ""

    def push(self, change):
        pass

    def clear(self):
        pass


@pytest.fixture
def stage():
    """`bench`, `guests`, `doors` (None of them before `play`), `open` and wait for it."""
    bench = Workbench(Document("tiny"), Settings(), NoHistory())
    found = SimpleNamespace(bench=bench, doors=None)
    found.guests = Guests(bench, lambda: found.doors)
    bench.share(found.guests)

    def play():
        found.doors = FakeDoors()
        return found.doors

    def wait():
        deadline = time.monotonic() + 120
        found.guests.poll()
        while found.guests.state == "opening":
            assert time.monotonic() < deadline
            time.sleep(0.001)
        found.guests.poll()

    def opened(*, network=False):
        play()
        if network:
            found.guests.open_to_network()
        else:
            found.guests.let_in()
        wait()
        return found.doors.hub

    found.play, found.wait, found.open = play, wait, opened
    found.lines = lambda: [line.text for line in bench.log.lines()]
    return found
