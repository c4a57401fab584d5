"""An offer as Chromium makes it, and people with ears."""

import pytest

from devices.hub.media.voice_room import VoiceRoom, new_voices
from devices.hub.roles import Person, Role

FINGERPRINT = "sha-256 " + ":".join(["AB"] * 32)
TRACK = """m={kind} 9 UDP/TLS/RTP/SAVPF {payloads}
c=IN IP4 0.0.0.0
a=rtcp:9 IN IP4 0.0.0.0
{candidates}a=ice-ufrag:{user}
a=ice-pwd:FyI7SBP3LySPGxNVL9fFVFPW
a=ice-options:trickle
a=fingerprint:{fingerprint}
a=setup:actpass
a=mid:{mid}
a=extmap:1 urn:ietf:params:rtp-hdrext:ssrc-audio-level
a=extmap:2/sendonly urn:ietf:params:rtp-hdrext:sdes:mid
a=extmap:9 urn:3gpp:video-orientation
a={direction}
a=rtcp-mux
{codecs}"""
AUDIO = """a=rtpmap:111 opus/48000/2
a=rtcp-fb:111 transport-cc
a=fmtp:111 minptime=10;useinbandfec=1
a=ssrc:3570614608 cname:4TOk42mSjXCkVIa6
"""
VIDEO = """a=rtpmap:96 VP8/90000
a=rtcp-fb:96 nack pli
a=rtpmap:97 rtx/90000
a=fmtp:97 apt=96
"""
CANDIDATES = """a=candidate:1 1 udp 2113937151 f00f-1.local 50123 typ host generation 0
a=candidate:2 1 tcp 1518280447 192.168.1.7 9 typ host tcptype active generation 0
a=candidate:3 1 udp 2113937150 10.1.2.3 50124 typ host generation 0
a=candidate:4 1 udp 1677729535 84.1.2.3 50125 typ srflx raddr 0.0.0.0 rport 0
"""


def offer_text(*, voices=2, videos=1, user="4ZcD", fingerprint=FINGERPRINT):
    lines = [("audio", "sendonly")] + [("audio", "recvonly")] * voices
    lines += [("video", "recvonly")] * videos
    tracks = "".join(
        TRACK.format(
            kind=kind,
            payloads="111" if kind == "audio" else "96 97",
            candidates="" if mid else CANDIDATES,
            user=user,
            fingerprint=fingerprint,
            mid=mid,
            direction=direction,
            codecs=AUDIO if kind == "audio" else VIDEO,
        )
        for mid, (kind, direction) in enumerate(lines)
    )
    mids = " ".join(str(mid) for mid in range(len(lines)))
    head = f"v=0\no=- 1 2 IN IP4 127.0.0.1\ns=-\nt=0 0\na=group:BUNDLE {mids}\n"
    return (head + tracks).replace("\n", "\r\n")


@pytest.fixture
def chromium_offer():
    return offer_text


class Ears:
    """Messages that one person gets."""

    def __init__(self, index):
        self.index = index
        self.voices = new_voices()
        self.video_ids = frozenset()
        self.texts = []

    def put(self, text):
        self.texts.append(text)


class Link:
    """A process of media that only writes down what it gets."""

    def __init__(self):
        self.is_running, self.starts, self.sent, self.orders = False, True, [], []

    def begin(self, _now_ns):
        self.is_running = self.starts
        return self.starts

    def send(self, data, *, is_order=False):
        (self.orders if is_order else self.sent).append(data)


@pytest.fixture
def room():
    return VoiceRoom(Link(), False, [].append)


@pytest.fixture
def come():
    """A function that lets somebody in: (person, ears)."""

    def enter(room, index, role=Role.REMOTE, **values):
        person = Person(f"p{index}", index, f"person {index}", role, **values)
        ears = Ears(index)
        room.enter(person, ears, address="192.168.1.7", now_ns=0)
        return person, ears

    return enter
