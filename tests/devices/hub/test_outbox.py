"""The freshest first, the log in order, and no queue without an end."""

import json

import pytest

from devices.hub import outbox as outbox_module
from devices.hub.channels import BodyChannel, StateChannel
from devices.hub.outbox import BODY_PAUSE_NS, MAX_TEXTS, MAX_UNSEEN, Outbox, Sent
from devices.hub.protocol.wire import unpack_bodies


class Desk:
    """An outbox with channels of its own."""

    def __init__(self, state_at):
        self.states, self.bodies, self.sent = StateChannel(), BodyChannel(), Sent()
        self.outbox = Outbox(1, self.sent)
        self._state_at = state_at
        self.moved = 0

    def move(self):
        self.moved += 1
        self.states.take(self._state_at(float(self.moved)))

    def take(self, now_ns=0):
        return self.outbox.take(self.states, self.bodies, now_ns=now_ns)

    def texts(self, now_ns=0):
        found = []
        while (text := self.take(now_ns)) is not None:
            found.append(json.loads(text) if isinstance(text, str) else text)
        return found


@pytest.fixture
def desk(state_at):
    made = Desk(state_at)
    made.outbox.begin(['{"kind":"welcome"}'], version=0, token_number=2)
    assert made.texts() == [{"kind": "welcome"}]
    return made


def test_two_states_are_on_their_way_and_then_only_the_newest_waits(desk):
    for _ in range(10):
        desk.move()
        desk.texts()
    assert desk.sent.messages == 1 + MAX_UNSEEN
    desk.outbox.see(1)
    (state,) = desk.texts()
    assert state["version"] == 10
    assert state["objects"]["cup"][0] == 10
    assert desk.sent.dropped == 7
    desk.outbox.see(10)
    assert desk.texts() == []


def test_a_client_that_says_nothing_gets_two_states(desk):
    for _ in range(100):
        desk.move()
    assert len(desk.texts()) == 1
    desk.move()
    assert len(desk.texts()) == 1
    desk.move()
    assert desk.texts() == []


def test_seeing_a_state_proves_that_the_welcome_came(desk):
    assert desk.outbox.see(0)
    assert not desk.outbox.see(5)
    late = Outbox(1, Sent())
    late.begin(["{}"], version=7, token_number=1)
    assert not late.see(6)
    assert late.see(7)


def test_bodies_go_together_at_most_90_times_a_second(desk):
    desk.bodies.put(1, b"own")
    assert desk.texts(0) == []
    bundles = []
    for step in range(1000):
        desk.bodies.put(2, b"a%d" % step)
        desk.bodies.put(3, b"b%d" % step)
        bundles += desk.texts(step * 1_000_000)
    assert len(bundles) == 90
    assert dict(unpack_bodies(bundles[1])) == {2: b"a12", 3: b"b12"}
    assert desk.sent.dropped == 2 * (990 - 90), "990 of each were there when the last was sent"


def test_a_late_body_is_followed_by_one_in_time(desk):
    at = 100 * BODY_PAUSE_NS
    for now_ns, is_sent in (
        (at, True),
        (at + 1, True),
        (at + 2, False),
        (at + BODY_PAUSE_NS, True),
    ):
        desk.bodies.put(2, b"a")
        assert bool(desk.texts(now_ns)) is is_sent


def test_a_body_is_sent_once(desk):
    desk.bodies.put(2, b"a")
    assert len(desk.texts(0)) == 1
    assert desk.texts(10 * BODY_PAUSE_NS) == []


def test_texts_are_sent_in_order_before_what_can_be_late(desk):
    desk.move()
    desk.bodies.put(2, b"a")
    desk.outbox.put_people('{"kind":"people"}')
    for number in range(3):
        desk.outbox.put(json.dumps({"kind": "log", "seq": number}))
    kinds = [it if isinstance(it, bytes) else it["kind"] for it in desk.texts()]
    assert kinds[:3] == ["log"] * 3
    assert set(kinds[3:]) - {"people", "state"} == {b"\x01\x02\x01\x00\x02\x00\x01\x00a"}


def test_of_lists_of_people_the_newest_is_sent_and_the_same_once(desk):
    for text in ('["a"]', '["b"]', '["b"]'):
        desk.outbox.put_people(text)
    assert desk.texts() == [["b"]]
    desk.outbox.put_people('["b"]')
    assert desk.texts() == []


@pytest.mark.parametrize("text", ['{"kind":"log"}', json.dumps({"kind": "x" * 10_000})])
def test_who_is_too_slow_for_the_log_is_dropped(desk, text):
    for _ in range(MAX_TEXTS + 1):
        desk.outbox.put(text)
    assert desk.outbox.is_overfull
    assert desk.outbox.is_ending
    (bye,) = desk.texts()
    assert bye["kind"] == "bye"
    assert "too slow" in bye["why"]
    desk.outbox.put("{}")
    desk.move()
    desk.bodies.put(2, b"a")
    assert desk.texts(10**12) == []


def test_one_long_text_alone_goes(desk, monkeypatch):
    monkeypatch.setattr(outbox_module, "MAX_TEXT_BYTES", 10)
    desk.outbox.put(json.dumps("x" * 100))
    assert not desk.outbox.is_overfull


def test_however_much_was_missed_is_sent_to_whoever_comes(desk):
    text = json.dumps({"kind": "log", "x": "x" * 10_000})
    desk.outbox.begin([text] * 2000, version=0, token_number=3)
    for _ in range(10):
        desk.outbox.put('{"kind":"log"}')
    assert not desk.outbox.is_overfull
    assert [len(it) for it in desk.texts()] == [2] * 2000 + [1] * 10


def test_goodbye_is_said_once_and_last(desk):
    desk.outbox.put('{"kind":"log"}')
    desk.outbox.end("why")
    desk.outbox.end("another")
    assert desk.texts() == [{"kind": "bye", "why": "why"}]


def test_bytes_and_messages_are_counted(desk):
    before = desk.sent.bytes
    desk.outbox.put('"12"')
    desk.bodies.put(2, b"abc")
    desk.texts()
    assert desk.sent.bytes - before == 4 + 4 + 4 + 3
    assert desk.sent.messages == 3
