"""States of people in words."""

from dataclasses import replace

from devices.hub.roles import Person, Role
from studio.app.model.runs.guests import ROLES, DoorState
from studio.app.people.words import (
    ROLE_HINTS,
    STARTS,
    code_words,
    here_words,
    latency_words,
    state_of,
    time_words,
)

ANA = Person("p1", 1, "Ana", Role.REMOTE, latency_ms=23.4)


def test_every_state_and_role_has_its_words():
    assert set(STARTS) == set(DoorState)
    assert set(ROLES) == set(ROLE_HINTS) == {str(role) for role in Role}


def test_people_are_here_slow_muted_or_away():
    assert state_of(ANA).word == "here"
    assert state_of(replace(ANA, latency_ms=200.0)).kind == "warning"
    assert state_of(replace(ANA, latency_ms=None)).word == "just came"
    assert state_of(replace(ANA, is_muted=True)).word == "muted"
    assert state_of(replace(ANA, has_microphone=True)).word == "here, microphone on"
    assert state_of(replace(ANA, has_microphone=True, is_speaking=True)).word == "speaks"
    assert state_of(replace(ANA, is_speaking=True, is_muted=True)).word == "muted"
    assert state_of(replace(ANA, is_connected=False)).word == "away, may come back"


def test_figures_have_their_units():
    assert latency_words(ANA) == "23 ms"
    assert latency_words(replace(ANA, is_connected=False)) == "–"
    assert time_words(119.9) == "one person, 1:59 left"
    assert time_words(0.0) == "expired: make a new code"
    assert code_words("123456") == "123 456"
    assert here_words(0) == "Nobody is here yet."
    assert here_words(2) == "2 people are here"
