"""Lines typed in a terminal: codes, the pen, and people by name."""

import os
import time
from dataclasses import replace

import pytest

from devices.hub.contract import Invitation
from devices.hub.roles import Person, Role
from studio.live.people import desk
from studio.live.people.desk import HELP, answer, listen
from studio.live.people.hosting import Hosting


class Hub:
    """People and codes in lists."""

    def __init__(self):
        self.here = {
            "p1": Person("p1", 1, "Ann", Role.REMOTE),
            "p2": Person("p2", 2, "Ben 2", Role.SPECTATOR),
        }
        self.made = []

    def people(self):
        return tuple(self.here.values())

    def invite(self, role=Role.REMOTE):
        code = f"{len(self.made):06d}"
        self.made.append(role)
        return Invitation(code, f"http://127.0.0.1:1/#code={code}", role, 0)

    def mute(self, person_id, *, is_muted):
        self.here[person_id] = replace(self.here[person_id], is_muted=is_muted)

    def give_pen(self, person_id):
        if person_id == "p2":
            raise ValueError("hub: Ben 2 draws nothing as spectator")
        self.here = {k: replace(p, has_pen=k == person_id) for k, p in self.here.items()}

    def remove(self, person_id):
        del self.here[person_id]


@pytest.fixture
def hub():
    return Hub()


@pytest.mark.parametrize(
    ("line", "role"),
    [("", Role.LOCAL), ("invite", Role.LOCAL), ("Invite spectator", Role.SPECTATOR)],
)
def test_another_code_is_made(hub, line, role):
    said = answer(hub, line, hosting=Hosting(role=Role.LOCAL))
    assert hub.made == [role]
    assert said.startswith("code 000000 (one use, two minutes, ")
    assert said.endswith("/#code=000000")


def test_people_are_looked_after_by_name(hub):
    hosting = Hosting()
    assert answer(hub, "people", hosting=hosting).startswith("2 people here: Ann")
    assert answer(hub, "pen ann", hosting=hosting) == "Ann has the pen"
    assert hub.here["p1"].has_pen
    assert answer(hub, "pen", hosting=hosting) == "everybody may draw"
    assert "draws nothing" in answer(hub, "pen Ben 2", hosting=hosting)
    assert answer(hub, "mute p2", hosting=hosting) == "Ben 2 is muted"
    assert answer(hub, "unmute Ben 2", hosting=hosting) == "Ben 2 is heard again"
    assert answer(hub, "remove Ben 2", hosting=hosting) == "Ben 2 was sent away"
    assert answer(hub, "mute Ben 2", hosting=hosting) == "people: person = 'Ben 2', here: Ann (p1)"


@pytest.mark.parametrize("line", ["help", "dance", "x" * 10_000])
def test_whatever_else_is_typed_is_answered_by_the_commands(hub, line):
    assert answer(hub, line, hosting=Hosting()) == HELP


def test_a_role_that_is_none_is_said(hub):
    assert "king" in answer(hub, "invite king", hosting=Hosting())


def test_lines_of_the_input_are_answered_until_it_ends(hub, monkeypatch):
    reading, writing = os.pipe()
    monkeypatch.setattr(desk, "STDIN", reading)
    said = []
    task = listen(hub, Hosting(), say=said.append)
    os.write(writing, b"people\ninv")
    os.write(writing, b"ite\n" + b"\xff" * 3000 + b"\n")
    deadline = time.monotonic() + 120
    while len(said) < 3 and time.monotonic() < deadline:
        time.sleep(0.01)
    os.close(writing)
    task.join(120)
    os.close(reading)
    assert said[0].startswith("2 people here")
    assert said[1].startswith("code 000000")
    assert said[2] == HELP


def test_nothing_is_read_where_there_is_no_input(hub, monkeypatch):
    reading, writing = os.pipe()
    os.close(reading)
    os.close(writing)
    monkeypatch.setattr(desk, "STDIN", reading)
    said = []
    task = listen(hub, Hosting(), say=said.append)
    if task is not None:
        task.join(120)
    assert said == []
