import json
from dataclasses import replace

import pytest

from devices.hub.channels import StateChannel, people_of, rights_of, rights_text, whole_text
from devices.hub.entities.board import Board
from devices.hub.roles import Pen, Person, Role

ANN = Person("p1", 1, "Ann", Role.REMOTE)


@pytest.mark.parametrize(
    ("person", "holder", "wanted"),
    [
        (ANN, "", ["give", "line", "primitive", "propose", "surface", "undo", "speak"]),
        (ANN, "p1", ["give", "line", "primitive", "propose", "surface", "undo", "speak"]),
        (ANN, "p2", ["speak"]),
        (replace(ANN, is_muted=True), "", []),
        (replace(ANN, role=Role.SPECTATOR), "", []),
    ],
)
def test_rights_are_those_of_the_role_the_pen_and_the_voice(person, holder, wanted):
    assert rights_of(person, Pen(holder)) == wanted
    assert json.loads(rights_text(person, Pen(holder))) == {
        "kind": "rights",
        "role": str(person.role),
        "rights": wanted,
        "muted": person.is_muted,
    }


def test_everybody_is_told_who_has_the_pen_and_a_microphone():
    ben = Person("p2", 2, "Ben", Role.REMOTE, has_microphone=True)
    ann, of_ben = people_of([ANN, ben], Pen("p2"))
    assert (ann["id"], ann["pen"], ann["microphone"]) == ("p1", False, False)
    assert (of_ben["name"], of_ben["pen"], of_ben["microphone"]) == ("Ben", True, True)


def test_a_welcome_ends_with_the_whole_state():
    said = json.loads(whole_text({"kind": "welcome"}, states=StateChannel(), board=Board()))
    assert said["kind"] == "welcome"
    assert said["state"]["version"] == 0
    assert said["state"]["objects"] == said["state"]["lines"] == {}
