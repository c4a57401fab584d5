"""Turns of a room: a defect is said once, and the looks go on."""

import time

from studio.live.sites.turns import MAX_DEFECTS, Turns


def test_looks_go_on_through_defects_and_each_is_said_once():
    said, looks = [], []

    def turn():
        looks.append(1)
        raise ValueError(f"no room {len(looks) % 2}")

    turns = Turns("site", turn, say=said.append)
    turns.start()
    until = time.monotonic() + 120
    while len(looks) < 6 and time.monotonic() < until:
        time.sleep(0.005)
    turns.end()
    assert len(looks) >= 6
    assert said == ["site: ValueError: no room 1", "site: ValueError: no room 0"]
    ended = len(looks)
    time.sleep(0.05)
    assert len(looks) == ended


def test_ever_new_defects_fill_no_log(monkeypatch):
    monkeypatch.setattr("studio.live.sites.turns.TICK_S", 0.0)
    said, looks = [], []

    def turn():
        looks.append(1)
        raise ValueError(f"picture {len(looks)}")

    turns = Turns("sites", turn, say=said.append)
    turns.start()
    until = time.monotonic() + 120
    while len(looks) < 2 * MAX_DEFECTS and time.monotonic() < until:
        time.sleep(0.005)
    turns.end()
    assert len(looks) >= 2 * MAX_DEFECTS
    assert len(said) == MAX_DEFECTS
