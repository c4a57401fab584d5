"""Voices of a session: to whom, by which way, muted at the hub, recorded only if asked for."""

import json
from dataclasses import replace

import pytest

from devices.hub.media import frames
from devices.hub.media.signals import MediaSignal, OfferSignal, Way
from devices.hub.media.voice_room import MAX_WAITING_VOICES, take_voices
from devices.hub.media.voice_wire import Voice, encode_voice, unpack_voices
from devices.hub.protocol.wire import WireError
from devices.hub.roles import Role

OPUS = bytes([0b01111_0_00]) + bytes(40)
HEARS = MediaSignal(Way.SOCKET, False, frozenset())
SPEAKS = MediaSignal(Way.SOCKET, True, frozenset())


def said(seq=1, level=20):
    return encode_voice(Voice(seq, 960 * seq, level, OPUS))


def kinds(ears):
    return [json.loads(text)["kind"] for text in ears.texts]


def test_a_voice_goes_to_everybody_else_who_listens_over_the_websocket(room, come):
    come(room, 1)
    _ben, ben = come(room, 2)
    _cem, cem = come(room, 3)
    room.take_signal(2, HEARS, now_ns=0)
    assert room.hear(1, said(), now_ns=0)
    assert unpack_voices(take_voices(ben.voices)) == ((1, Voice(1, 960, 20, OPUS)),)
    assert not ben.voices
    assert not cem.voices, "who does not listen gets nothing"


def test_of_a_slow_listener_the_oldest_moments_go(room, come):
    come(room, 1)
    _ben, ben = come(room, 2)
    room.take_signal(2, HEARS, now_ns=0)
    for seq in range(200):
        room.hear(1, said(seq), now_ns=seq * 20_000_000)
    assert len(ben.voices) == MAX_WAITING_VOICES
    assert ben.voices[-1][1].seq == 199
    room.take_signal(2, MediaSignal(Way.RTC, False, frozenset({"wall"})), now_ns=0)
    assert (len(ben.voices), ben.video_ids) == (0, {"wall"})


def test_spectators_and_the_muted_are_not_heard_whatever_their_page_sends(room, come):
    come(room, 1, Role.SPECTATOR)
    ben, _ears = come(room, 2)
    _cem, cem = come(room, 3)
    room.take_signal(3, HEARS, now_ns=0)
    room.take_signal(2, SPEAKS, now_ns=0)
    assert not room.hear(1, said(), now_ns=0)
    assert room.hear(2, said(), now_ns=0)
    room.speaking_news(0)
    assert room.seen(ben).is_speaking
    cem.voices.clear()
    muted = replace(ben, is_muted=True)
    room.change(muted)
    assert not room.hear(2, said(2), now_ns=1)
    assert not room.take_frame(
        frames.VOICE, frames.pack_voice(2, Voice(2, 0, 20, OPUS))[5:], now_ns=1
    )
    assert not cem.voices
    assert json.loads(room.speaking_news(1))["people"] == []
    assert not room.seen(muted).has_microphone


def test_who_speaks_is_said_when_it_changes(room, come):
    come(room, 1)
    assert room.speaking_news(0) is None
    room.hear(1, said(), now_ns=0)
    assert json.loads(room.speaking_news(0)) == {"kind": "speaking", "people": ["p1"]}
    assert room.speaking_news(1) is None
    assert json.loads(room.speaking_news(10**9))["people"] == []


def test_too_much_is_left_out_and_what_is_no_voice_is_refused(room, come):
    come(room, 1)
    _ben, ben = come(room, 2)
    room.take_signal(2, HEARS, now_ns=0)
    for seq in range(100):
        room.hear(1, said(seq), now_ns=0)
    assert len(ben.voices) == 60
    with pytest.raises(WireError):
        room.hear(1, said()[:8], now_ns=10**9)


def test_voices_are_kept_only_while_they_are_recorded_and_everybody_is_told(room, come):
    _ada, ada = come(room, 1)
    room.hear(1, said(), now_ns=0)
    assert room.take_recorded() == ()
    room.record(is_recorded=True)
    assert json.loads(ada.texts[-1]) == {"kind": "media", "recorded": True}
    assert room.welcome()["recorded"]
    room.hear(1, said(2), now_ns=5)
    (kept,) = room.take_recorded()
    assert (kept.user_id, kept.heard_ns, kept.seq, kept.opus) == ("p1", 5, 2, OPUS)
    room.hear(1, said(3), now_ns=6)
    room.record(is_recorded=False)
    assert room.take_recorded() == (), "what waited is dropped, too"


def test_an_offer_begins_the_process_and_its_answer_comes_back(room, come):
    _ada, ada = come(room, 1)
    room.keep_surfaces(["wall"])
    assert room.link.orders == [], "nothing begins before somebody asks"
    room.take_signal(1, OfferSignal("v=0"), now_ns=0)
    orders = [json.loads(data[5:]) for data in room.link.orders]
    assert [order["do"] for order in orders] == ["surfaces", "offer"]
    assert (orders[1]["address"], orders[1]["may"]) == ("192.168.1.7", True)
    answer = {"say": "answer", "person": 1, "number": 1, "sdp": "v=0 ours"}
    assert room.take_frame(1, frames.pack_order(answer)[5:], now_ns=0)
    assert json.loads(ada.texts[-1]) == {"kind": "answer", "sdp": "v=0 ours"}
    old = {**answer, "number": 0}
    assert not room.take_frame(1, frames.pack_order(old)[5:], now_ns=0)
    room.process_died()
    assert "why" in json.loads(ada.texts[-1])


def test_offers_are_limited_and_say_why_there_is_no_webrtc(room, come):
    _ada, ada = come(room, 1)
    room.link.starts = False
    for _ in range(7):
        room.take_signal(1, OfferSignal("v=0"), now_ns=0)
    words = [json.loads(text)["why"] for text in ada.texts]
    assert words[0] == "WebRTC does not start"
    assert words[-1] == "too many offers, wait"
    room.link = None
    assert not room.welcome()["rtc"]
    assert "people-media" in room.welcome()["why"]


def test_who_leaves_leaves_nothing(room, come):
    come(room, 1)
    room.take_signal(1, OfferSignal("v=0"), now_ns=0)
    room.hear(1, said(), now_ns=0)
    room.leave(1)
    assert json.loads(room.link.orders[-1][5:]) == {"do": "close", "person": 1}
    assert not room.hear(1, said(2), now_ns=1)
    room.leave(1)
