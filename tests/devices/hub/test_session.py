"""A session as its people share it, without sockets and at a time that the test sets."""

import json

import numpy as np
import pytest

from devices.hub.attendance import AWAY_NS, SHOWN_NS
from devices.hub.entry.admission import Refused
from devices.hub.entry.pairing import PairingRefused
from devices.hub.entry.tokens import TOKEN_NS
from devices.hub.inbox import Avatars
from devices.hub.protocol.messages import Hello
from devices.hub.protocol.wire import Body, Hand, decode_body, encode_body, unpack_bodies
from devices.hub.roles import Op, Role
from devices.hub.session import MAX_FAULTS, RENEW_NS, Visit
from scenes.pose import Pose
from scenes.state import Annotation, SceneState, reduce_state

LINE = {"kind": "do", "id": 1, "op": "line", "line": "a", "points": [[0, 1, 0], [1, 1, 0]]}
SECOND = 10**9


def kinds(messages):
    return [it["kind"] for it in messages if isinstance(it, dict)]


def body(room, guest, outbox, data):
    return room.session.see_body(Visit(guest, outbox), data, now_ns=room.now_ns)


def avatars_of(room):
    return Avatars().of(room.session.attendance.shown(room.now_ns))


def test_a_body_is_shown_for_two_seconds(room, body_at):
    guest, outbox, _ = room.join()
    body(room, guest, outbox, body_at(1.0))
    room.now_ns = SHOWN_NS
    assert len(avatars_of(room)) == 1
    room.now_ns += 1
    assert avatars_of(room) == ()


def test_the_welcome_says_everything(room, state_at):
    room.session.publish(state_at(1.0))
    guest, _outbox, welcome = room.join("Anna", Role.REMOTE)
    assert welcome["kind"] == "welcome"
    assert welcome["you"] == guest.person.person_id == "p1"
    assert (welcome["role"], welcome["name"]) == ("remote", "Anna")
    assert welcome["rights"] == ["give", "line", "primitive", "propose", "surface", "undo", "speak"]
    assert welcome["people"] == [
        {
            "id": "p1",
            "index": 1,
            "name": "Anna",
            "role": "remote",
            "muted": False,
            "pen": True,
            "microphone": False,
            "takes": True,
            "yields": False,
        }
    ]
    assert welcome["state"]["objects"]["cup"][0] == 1
    assert (welcome["state"]["lines"], welcome["state"]["surfaces"]) == ({}, {})
    assert (welcome["log_seq"], welcome["resumed"]) == (0, False)


def test_lines_go_to_everybody_in_order_and_to_the_session(room):
    anna, hers, _ = room.join("Anna")
    _ben, his, _ = room.join("Ben")
    assert room.hear(anna, hers, **LINE)
    assert room.hear(anna, hers, **{**LINE, "id": 2, "points": []})
    mine = [it for it in room.drain(hers) if it["kind"] != "people"]
    theirs = [it for it in room.drain(his) if it["kind"] != "people"]
    assert kinds(mine) == ["log", "done", "log", "done"]
    assert kinds(theirs) == ["log", "log"]
    assert [it["seq"] for it in theirs] == [1, 2]
    assert theirs[0]["line"] == "p1/a"
    assert theirs[0]["by"] == "p1"
    arrived = room.session.take()
    assert [(it.annotation_id, len(it.points_in_world)) for it in arrived.lines] == [("p1/a", 0)]
    _cleo, _outbox, welcome = room.join("Cleo")
    assert welcome["log_seq"] == 2


def test_a_newcomer_sees_what_is_there(room):
    anna, hers, _ = room.join()
    room.hear(anna, hers, **LINE)
    corners = [[0, 1, 0], [1, 1, 0], [1, 0, 0], [0, 0, 0]]
    room.hear(anna, hers, kind="do", id=2, op="surface", surface="tv", corners=corners)
    _ben, _his, welcome = room.join("Ben")
    assert welcome["state"]["lines"]["p1/a"]["points"] == LINE["points"]
    assert welcome["state"]["surfaces"]["p1/tv"] == {"by": "p1", "corners": corners}
    assert room.session.take().surfaces[0].surface_id == "p1/tv"


def test_undo_comes_as_the_line_it_leads_to(room):
    anna, hers, _ = room.join()
    room.hear(anna, hers, **LINE)
    room.drain(hers)
    room.hear(anna, hers, kind="do", id=2, op="undo")
    log, done = room.drain(hers)
    assert (log["op"], log["line"], log["points"]) == ("line", "p1/a", [])
    assert done == {"kind": "done", "id": 2}
    room.hear(anna, hers, kind="do", id=3, op="undo")
    (refused,) = room.drain(hers)
    assert refused == {"kind": "refused", "id": 3, "why": "there is nothing to undo"}


def test_who_comes_back_gets_the_rest_of_the_log(room):
    anna, hers, _ = room.join("Anna")
    ben, his, welcome = room.join("Ben")
    room.hear(anna, hers, **LINE)
    room.session.leave(Visit(ben, his), room.now_ns)
    room.hear(anna, hers, **{**LINE, "line": "b"})
    again, outbox = room.enter(welcome["token"], log_seq=1)
    first, *rest = room.drain(outbox)
    assert again is ben
    assert (first["you"], first["log_seq"], first["resumed"]) == ("p2", 1, True)
    assert set(first["state"]["lines"]) == {"p1/a", "p1/b"}
    assert [it["line"] for it in rest if it["kind"] == "log"] == ["p1/b"]
    newest, outbox = room.enter(first["token"], log_seq=77)
    (first, *_rest) = room.drain(outbox)
    assert (first["log_seq"], first["resumed"]) == (2, False)
    assert newest is ben


def test_a_spectator_shows_a_head_and_may_do_nothing(room):
    guest, outbox, welcome = room.join("Sam", Role.SPECTATOR)
    _anna, hers, _ = room.join()
    assert welcome["rights"] == []
    assert not welcome["people"][0]["pen"]
    for op in Op:
        names = {"surface": "s", "primitive": "b", "proposal": "c", "to": "p2"}
        room.hear(guest, outbox, **{**LINE, "op": op, **names})
        (answer,) = [it for it in room.drain(outbox) if it["kind"] == "refused"]
        assert answer["why"] == "a spectator may not change the room"
    hand = Hand(np.zeros((25, 3)), np.zeros(25))
    whole = encode_body(Body(1, 2, Pose.identity(), hands=(hand, hand), ray=np.zeros((2, 3))))
    assert body(room, guest, outbox, whole)
    (bundle,) = [it for it in room.drain(hers) if isinstance(it, bytes)]
    ((index, data),) = unpack_bodies(bundle)
    seen = decode_body(data)
    assert index == guest.person.index
    assert seen.hands == (None, None)
    assert seen.ray is None
    (avatar,) = avatars_of(room)
    assert avatar.hands == ()
    assert room.session.log.seq == 0
    assert room.session.refused["op"] == len(Op)


def test_a_muted_person_is_refused_and_hidden(room, body_at):
    guest, outbox, _ = room.join()
    _ben, his, _ = room.join("Ben")
    body(room, guest, outbox, body_at(1.0))
    room.session.change("p1", 0, is_muted=True)
    assert not body(room, guest, outbox, body_at(2.0))
    room.hear(guest, outbox, **LINE)
    found = room.drain(outbox)
    assert {"kind": "rights", "role": "remote", "rights": [], "muted": True} in found
    assert [it["why"] for it in found if it["kind"] == "refused"] == ["you are muted"]
    assert not [it for it in room.drain(his) if isinstance(it, bytes)]
    assert avatars_of(room) == ()
    room.session.change("p1", 0, is_muted=False)
    assert body(room, guest, outbox, body_at(3.0))


def test_another_role_counts_at_once(room):
    guest, outbox, _ = room.join("Anna", Role.SPECTATOR)
    room.session.change("p1", 0, role=Role.REMOTE)
    rights, people = room.drain(outbox)
    assert rights["rights"] == ["give", "line", "primitive", "propose", "surface", "undo", "speak"]
    assert people["people"][0]["role"] == "remote"
    room.hear(guest, outbox, **LINE)
    assert kinds(room.drain(outbox)) == ["log", "done"]
    with pytest.raises(KeyError, match="nobody is 'p9'"):
        room.session.change("p9", 0, role=Role.LOCAL)


def test_a_removed_person_does_not_come_back(room):
    _guest, outbox, welcome = room.join()
    room.session.remove("p1", 0)
    assert room.drain(outbox) == [{"kind": "bye", "why": "the operator has removed you"}]
    assert room.session.people(0) == ()
    with pytest.raises(Refused, match="removed"):
        room.enter(welcome["token"])
    with pytest.raises(KeyError):
        room.session.remove("p1", 0)


def test_who_loses_the_connection_keeps_id_and_role_for_30_s(room):
    guest, outbox, welcome = room.join()
    room.session.leave(Visit(guest, outbox), 0)
    (person,) = room.session.people(AWAY_NS - 1)
    assert (person.person_id, person.is_connected) == ("p1", False)
    assert room.session.people(AWAY_NS) == ()
    room.now_ns = 10 * AWAY_NS
    again, _ = room.enter(welcome["token"])
    assert again is guest
    assert room.session.people(room.now_ns)[0].is_connected


def test_a_second_connection_takes_over(room):
    guest, old, welcome = room.join()
    again, new = room.enter(welcome["token"])
    assert again is guest
    assert kinds(room.drain(old)) == ["bye"]
    room.session.leave(Visit(guest, old), 0)
    assert guest.outbox is new
    assert room.session.people(0)[0].is_connected


def test_a_token_is_replayed_in_vain_once_the_next_one_has_come(room):
    token = room.pair()
    guest, outbox = room.enter(token)
    room.drain(outbox)
    assert room.session.known_by(token, 0)
    room.hear(guest, outbox, kind="seen", version=0)
    assert not room.session.known_by(token, 0)
    with pytest.raises(Refused, match="replaced"):
        room.enter(token)
    assert guest.outbox is outbox
    assert room.session.refused["token"] == 1


def test_connected_people_get_fresh_tokens(room):
    _guest, outbox, welcome = room.join()
    room.session.tick(RENEW_NS - 1)
    assert "token" not in kinds(room.drain(outbox))
    room.session.tick(RENEW_NS)
    (fresh,) = [it for it in room.drain(outbox) if it["kind"] == "token"]
    assert room.session.known_by(fresh["token"], TOKEN_NS + RENEW_NS - 1)
    assert not room.session.known_by(welcome["token"], TOKEN_NS)


def test_people_who_left_disappear_from_the_list(room):
    guest, outbox, _ = room.join()
    _ben, his, _ = room.join("Ben")
    room.session.leave(Visit(guest, outbox), 0)
    room.session.tick(AWAY_NS)
    lists = [it for it in room.drain(his) if it["kind"] == "people"]
    assert [it["id"] for it in lists[-1]["people"]] == ["p2"]
    room.session.tick(2 * AWAY_NS)
    kinds_of = [kind for kind, _text in room.session.take().events]
    assert kinds_of == ["paired", "joined", "paired", "joined", "away", "left"]
    room.session.tick(TOKEN_NS)
    assert room.session.attendance.find("p1") is None


def test_the_room_is_full(make_room):
    room = make_room(max_people=1)
    late = room.pair("Ben")
    room.join()
    with pytest.raises(Refused, match="full"):
        room.enter(late)
    with pytest.raises(Refused, match="full"):
        room.pair("Cleo")
    assert room.session.refused["full"] == 2


def test_ping_is_answered_with_the_hubs_time(room):
    guest, outbox, _ = room.join()
    room.now_ns = 5 * SECOND
    room.hear(guest, outbox, kind="ping", t_us=12)
    assert room.drain(outbox)[0] == {"kind": "pong", "t_us": 12.0, "hub_t_us": 5_000_000}


def test_what_cannot_be_read_ends_a_connection_in_the_end(room):
    guest, outbox, _ = room.join()
    for _ in range(MAX_FAULTS):
        room.session.hear(Visit(guest, outbox), "{", now_ns=0)
        assert not outbox.is_ending
    assert not body(room, guest, outbox, b"\1\1")
    assert outbox.is_ending
    assert room.session.refused["message"] == MAX_FAULTS + 1


def test_who_sends_too_much_is_sent_away(room):
    guest, outbox, _ = room.join()
    for _ in range(1000):
        room.hear(guest, outbox, kind="seen", version=0)
    assert kinds(room.drain(outbox))[-1] == "bye"
    guest, outbox, _ = room.join("Ben")
    for _ in range(30):
        room.session.hear(Visit(guest, outbox), '"' + "x" * 100_000 + '"', now_ns=0)
    assert outbox.is_ending


def test_too_many_operations_are_refused_and_too_many_bodies_dropped(room, body_at):
    guest, outbox, _ = room.join()
    for number in range(200):
        room.hear(guest, outbox, **{**LINE, "id": number})
    answers = room.drain(outbox)
    assert kinds(answers).count("done") == 80
    assert {it["why"] for it in answers if it["kind"] == "refused"} == {
        "too many operations at once"
    }
    seen = sum(body(room, guest, outbox, body_at(1.0, n)) for n in range(1, 200))
    assert seen == 100
    assert room.session.refused["rate"] == 99


def test_what_the_session_draws_goes_to_the_log_and_comes_not_back(room):
    guest, outbox, _ = room.join()
    room.hear(guest, outbox, **LINE)
    (theirs,) = room.session.take().lines
    state = reduce_state(SceneState(), theirs, 1)
    own = Annotation("note", "designer", np.array([[0.0, 1.0, 2.0]]), (1.0, 0.0, 0.0))
    bad = Annotation("bad", "designer", np.array([[0.0, np.nan, 2.0]]), (1.0, 0.0, 0.0))
    room.drain(outbox)
    room.session.publish(reduce_state(reduce_state(state, own, 2), bad, 3))
    (log,) = [it for it in room.drain(outbox) if it["kind"] == "log"]
    assert (log["line"], log["by"], log["points"]) == ("note", "room", [[0, 2, -1]])
    room.session.publish(SceneState())
    gone = [it for it in room.drain(outbox) if it["kind"] == "log"]
    assert sorted((it["line"], len(it["points"])) for it in gone) == [("note", 0), ("p1/a", 0)]
    assert room.session.take().lines == ()


def test_latency_is_shown(room):
    guest, _outbox, _ = room.join()
    guest.measure(12_500_000)
    assert room.session.people(0)[0].latency_ms == 12.5


def test_the_session_ends_with_goodbye(room):
    _guest, outbox, _ = room.join()
    room.session.end()
    assert room.drain(outbox) == [{"kind": "bye", "why": "the session is over"}]


def test_names_are_those_of_hello_or_of_pairing(room):
    token = room.pair("Anna")
    guest, _ = room.enter(token, name="Annika")
    assert guest.person.name == "Annika"
    room.session.enter(Hello(token, None, None), address="a", now_ns=0)
    assert guest.person.name == "Annika"


def test_no_secret_is_ever_said(room):
    secrets = []
    for number in range(3):
        code, _ = room.session.codes.make(Role.REMOTE, 0)
        token = room.session.pair(code, name=f"Anna {number}", address="a", now_ns=0)
        secrets += [code, token]
        guest, outbox = room.enter(token)
        fresh = room.drain(outbox)[0]["token"]
        secrets.append(fresh)
        room.hear(guest, outbox, kind="hello", token=fresh)
        room.hear(guest, outbox, kind="do", id=1, op="line", line=fresh)
        room.hear(guest, outbox, kind=fresh)
        room.session.hear(
            Visit(guest, outbox), json.dumps({"kind": "seen", "version": fresh}), now_ns=0
        )
    for wrong in ("123456", secrets[0], secrets[3]):
        with pytest.raises(PairingRefused) as caught:
            room.session.pair(wrong, name="x", address="a", now_ns=0)
        assert wrong not in str(caught.value)
    room.session.remove("p1", 0)
    for token in (secrets[1], secrets[4] + "x"):
        with pytest.raises(Refused) as caught:
            room.enter(token)
        assert token not in str(caught.value)
    events = " ".join(text for _kind, text in room.session.take().events)
    said = "\n".join(room.said) + events + repr(dict(room.session.refused))
    assert "Anna 1" in said
    for secret in (*secrets, "123456"):
        assert secret not in said


def test_an_attack_does_not_fill_the_log(room):
    for _ in range(1000):
        with pytest.raises(PairingRefused):
            room.session.pair("x", name="x", address="a", now_ns=0)
    assert len(room.said) <= 30
    assert room.session.refused["code"] + room.session.refused["guessing"] == 1000


def test_one_person_has_the_pen_until_it_is_everybodys_again(room):
    anna, his_line = room.join()[:2], {"op": "line", "line": "a", "points": [[0, 0, 0]]}
    guest, outbox = anna
    ben, his, _ = room.join("Ben")
    room.session.give_pen("p1", 0)
    told = [it for it in room.drain(his) if it["kind"] == "rights"]
    assert told[-1]["rights"] == ["speak"]
    lists = [it for it in room.drain(outbox) if it["kind"] == "people"]
    assert [it["pen"] for it in lists[-1]["people"]] == [True, False]
    assert [it.has_pen for it in room.session.people(0)] == [True, False]
    room.hear(ben, his, kind="do", id=1, **his_line)
    (refused,) = [it for it in room.drain(his) if it["kind"] == "refused"]
    assert refused["why"] == "somebody else has the pen"
    room.hear(guest, outbox, kind="do", id=1, **his_line)
    assert "done" in kinds(room.drain(outbox))

    room.session.give_pen(None, 0)
    room.hear(ben, his, kind="do", id=2, **his_line)
    assert "done" in kinds(room.drain(his))
    with pytest.raises(KeyError):
        room.session.give_pen("p9", 0)


def test_the_pen_of_who_goes_is_everybodys(room):
    guest, outbox, _ = room.join()
    _ben, his, _ = room.join("Ben")
    room.session.give_pen("p1", 0)
    room.session.change("p1", 0, role=Role.SPECTATOR)
    assert "line" in told_rights(room, his)
    with pytest.raises(ValueError, match="spectator"):
        room.session.give_pen("p1", 0)
    room.session.give_pen("p2", 0)
    room.session.remove("p2", 0)
    room.session.change("p1", 0, role=Role.REMOTE)
    assert "line" in told_rights(room, outbox)
    room.session.give_pen("p1", 0)
    room.session.leave(Visit(guest, outbox), 0)
    _cleo, hers, _ = room.join("Cleo")
    room.session.tick(AWAY_NS)
    assert "line" in told_rights(room, hers)
    assert [it.has_pen for it in room.session.people(AWAY_NS)] == [False]


def told_rights(room, outbox):
    """The rights that somebody was sent last."""
    return [it for it in room.drain(outbox) if it["kind"] == "rights"][-1]["rights"]


def test_only_an_object_that_is_there_can_be_proposed(room):
    guest, outbox, welcome = room.join()
    assert welcome["state"]["proposals"] == {}
    copy = {"op": "propose", "proposal": "c", "pose": [0, 0, 0, 0, 0, 0, 1]}
    room.hear(guest, outbox, kind="do", id=1, **copy, object="ghost")
    (refused,) = [it for it in room.drain(outbox) if it["kind"] == "refused"]
    assert refused["why"] == "there is no such object"
