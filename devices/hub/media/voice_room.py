"""Media of a session as everybody shares it: voices in and out, who speaks, who sees what how.

No socket here: whoever calls holds the session's lock, and wakes the connections afterwards.
"""

from __future__ import annotations

import json
import threading
from collections import deque
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

from devices.hub.entry.rates import Bucket
from devices.hub.media import frames
from devices.hub.media.floor import PLACES, Floor
from devices.hub.media.link import EXTRA, MediaLink
from devices.hub.media.signals import VIDEOS, MediaSignal, OfferSignal, Way
from devices.hub.media.voice_wire import Voice, decode_voice, pack_voices
from devices.hub.roles import Person, may_speak
from devices.messages import VoicePacket

OFFERS_HZ, OFFERS_BURST = 0.5, 6.0
"""Offers of one person: each makes keys and opens a port; a network that comes and goes asks for
one in five seconds."""

SIGNALS_HZ, SIGNALS_BURST = 10.0, 40.0
"""Media as one person has them, by their own word."""

VOICE_HZ, VOICE_BURST = 60.0, 60.0
"""Moments of one voice: 50 a second, and what a stalled network delivers together."""

MAX_WAITING_VOICES = 60
"""Moments that wait for one listener: 200 ms of all places; of more, the oldest goes."""

MAX_RECORDED = 3000
"""Moments that wait for the recording: ten seconds of all places; of more, the oldest goes."""


class Listener(Protocol):
    """Part of an outbox that media need."""

    index: int
    voices: deque[tuple[int, Voice]]
    video_ids: frozenset[str]

    def put(self, text: str) -> None:
        """Let a text follow those that wait."""
        ...


@dataclass(slots=True)
class _Client:
    """One connection's media.

    Attributes:
        person: whose it is.
        listener: its outbox.
        address: from which it comes.
        way: how voices go to it.
        has_microphone: whether theirs is on.
        offer: number of its newest offer.
        is_connected: whether WebRTC is.
    """

    person: Person
    listener: Listener
    address: str
    offers: Bucket
    signals: Bucket
    voices: Bucket
    way: Way = Way.OFF
    has_microphone: bool = False
    offer: int = 0
    is_connected: bool = False


def new_voices() -> deque[tuple[int, Voice]]:
    """Return a queue of moments that wait for one listener."""
    return deque(maxlen=MAX_WAITING_VOICES)


def take_voices(waiting: deque[tuple[int, Voice]]) -> bytes:
    """Return everything that waits as one message."""
    message = pack_voices(tuple(waiting))
    waiting.clear()
    return message


@dataclass(slots=True, eq=False)
class VoiceRoom:
    """Voices and videos of one session.

    Attributes:
        link: the process of WebRTC; None where it is not installed.
        is_recorded: whether voices are kept for the recording.
        refuse: counts something refused, by its kind.
    """

    link: MediaLink | None
    is_recorded: bool
    refuse: Callable[[str], None]
    _clients: dict[int, _Client] = field(default_factory=dict[int, _Client])
    _floor: Floor = field(default_factory=Floor)
    _speaking: frozenset[int] = frozenset()
    _places: str = ""
    _surfaces: tuple[str, ...] = ()
    _kept: deque[VoicePacket] = field(
        default_factory=lambda: deque[VoicePacket](maxlen=MAX_RECORDED)
    )

    def welcome(self) -> dict[str, Any]:
        """Return what a page is told first."""
        is_there = self.link is not None
        return {
            "rtc": is_there,
            "why": "" if is_there else f"the studio is without its extra {EXTRA!r}",
            "recorded": self.is_recorded,
            "voices": PLACES,
            "videos": VIDEOS,
        }

    def enter(self, person: Person, listener: Listener, *, address: str, now_ns: int) -> None:
        """Take somebody's connection; media of an older one end."""
        self.leave(person.index)
        self._clients[person.index] = _Client(
            person,
            listener,
            address,
            Bucket(OFFERS_HZ, OFFERS_BURST, now_ns=now_ns),
            Bucket(SIGNALS_HZ, SIGNALS_BURST, now_ns=now_ns),
            Bucket(VOICE_HZ, VOICE_BURST, now_ns=now_ns),
        )

    def record(self, *, is_recorded: bool) -> None:
        """Begin to keep voices for the recording, or end; everybody is told."""
        self.is_recorded = is_recorded
        self._kept.clear()
        for client in self._clients.values():
            client.listener.put(_text({"kind": "media", "recorded": is_recorded}))

    def leave(self, index: int) -> None:
        """End somebody's media."""
        client = self._clients.pop(index, None)
        self._floor.drop(index)
        if client is not None and client.offer:
            self._order({"do": "close", "person": index})

    def change(self, person: Person) -> None:
        """Note that somebody may do something else: a voice ends at once, at the hub."""
        client = self._clients.get(person.index)
        if client is None:
            return
        client.person = person
        if not may_speak(person):
            self._floor.drop(person.index)
        if client.offer:
            may = may_speak(person)
            self._order({"do": "speaks", "person": person.index, "may": may})

    def seen(self, person: Person) -> Person:
        """Return somebody with what they do with their voice."""
        client = self._clients.get(person.index)
        if client is None or not client.has_microphone or not may_speak(person):
            return person
        return replace(person, has_microphone=True, is_speaking=person.index in self._speaking)

    def take_signal(self, index: int, signal: OfferSignal | MediaSignal, *, now_ns: int) -> bool:
        """Take what somebody says about their media; return whether the list of people changes."""
        client = self._clients.get(index)
        if client is None:
            return False
        if isinstance(signal, OfferSignal):
            self._take_offer(client, signal.sdp, now_ns=now_ns)
            return False
        if not client.signals.take(now_ns):
            self.refuse("rate")
            return False
        client.way, client.listener.video_ids = signal.way, signal.videos
        if signal.way is not Way.SOCKET:
            client.listener.voices.clear()
        had, client.has_microphone = client.has_microphone, signal.has_microphone
        return had != client.has_microphone

    def hear(self, index: int, data: bytes, *, now_ns: int) -> bool:
        """Take a moment of somebody's voice from their WebSocket; return whether others get it.

        Raises:
            WireError: it cannot be read.
        """
        client = self._clients.get(index)
        if client is None or not may_speak(client.person):
            self.refuse("muted")
            return False
        if not client.voices.take(now_ns):
            self.refuse("rate")
            return False
        voice = decode_voice(data)
        if self.link is not None and self.link.is_running:
            self.link.send(frames.pack_voice(index, voice))
        return self._spread(client, voice, now_ns=now_ns)

    def take_frame(self, kind: int, data: bytes, *, now_ns: int) -> bool:
        """Take a frame of the process of WebRTC; return whether connections have news."""
        if kind == frames.VOICE:
            index, voice = frames.read_voice(data)
            client = self._clients.get(index)
            if client is None or not may_speak(client.person):
                return False
            return self._spread(client, voice, now_ns=now_ns)
        said = frames.read_order(data)
        if said["say"] == "places":
            self._places = _text({"kind": "places", **{k: said[k] for k in ("voices", "videos")}})
            for client in self._clients.values():
                if client.offer:
                    client.listener.put(self._places)
            return True
        client = self._clients.get(int(said.get("person", -1)))
        if client is None or said.get("number") != client.offer:
            return False
        if said["say"] == "answer":
            self._take_answer(client, said)
        elif said["say"] == "state":
            client.is_connected = said["state"] == "connected"
        return True

    def process_died(self) -> None:
        """Tell everybody who had WebRTC that it is gone."""
        for client in self._clients.values():
            if client.offer:
                client.offer, client.is_connected = 0, False
                client.listener.put(_text({"kind": "answer", "why": "it has ended, try again"}))

    def show(self, surface_id: str, jpeg: bytes) -> None:
        """Let a surface's picture go to those who see it as video."""
        if self.link is not None and self.link.is_running:
            self.link.send(frames.pack_picture(surface_id, jpeg))

    def keep_surfaces(self, surface_ids: Iterable[str]) -> None:
        """Note which surfaces there are."""
        surfaces = tuple(surface_ids)
        if surfaces != self._surfaces:
            self._surfaces = surfaces
            self._order({"do": "surfaces", "ids": surfaces})

    def speaking_news(self, now_ns: int) -> str | None:
        """Return the message of who speaks if it has changed since the last call."""
        speaking = self._floor.speaking(now_ns)
        if speaking == self._speaking:
            return None
        self._speaking = speaking
        ids = [c.person.person_id for i, c in self._clients.items() if i in speaking]
        return _text({"kind": "speaking", "people": ids})

    def take_recorded(self) -> tuple[VoicePacket, ...]:
        """Return moments for the recording since the last call; none unless it is switched on."""
        kept = tuple(self._kept)
        self._kept.clear()
        return kept

    def _take_offer(self, client: _Client, sdp: str, *, now_ns: int) -> None:
        index = client.person.index
        if not sdp:
            if client.offer:
                client.offer, client.is_connected = 0, False
                self._order({"do": "close", "person": index})
            return
        why = ""
        if not client.offers.take(now_ns):
            self.refuse("rate")
            why = "too many offers, wait"
        elif self.link is None:
            why = self.welcome()["why"]
        else:
            was_running = self.link.is_running
            if not self.link.begin(now_ns):
                why = "WebRTC does not start"
            elif not was_running:
                self._order({"do": "surfaces", "ids": self._surfaces})
        if why:
            client.listener.put(_text({"kind": "answer", "why": why}))
            return
        client.offer += 1
        order = {"do": "offer", "person": index, "number": client.offer, "sdp": sdp}
        may = may_speak(client.person)
        self._order({**order, "address": client.address, "may": may})

    def _take_answer(self, client: _Client, said: dict[str, Any]) -> None:
        if "sdp" not in said:
            self.refuse("offer")
            why = str(said.get("why", ""))
            client.listener.put(_text({"kind": "answer", "why": why}))
            return
        client.listener.put(_text({"kind": "answer", "sdp": said["sdp"]}))
        if self._places:
            client.listener.put(self._places)

    def _spread(self, speaker: _Client, voice: Voice, *, now_ns: int) -> bool:
        index = speaker.person.index
        if self._floor.take(index, level_db=voice.level_db, now_ns=now_ns) is None:
            return False
        if self.is_recorded:
            person_id = speaker.person.person_id
            self._kept.append(
                VoicePacket(now_ns, now_ns, person_id, voice.seq, voice.time, voice.opus)
            )
        has_news = False
        for client in self._clients.values():
            if client is not speaker and client.way is Way.SOCKET:
                client.listener.voices.append((index, voice))
                has_news = True
        return has_news

    def _order(self, fields: dict[str, Any]) -> None:
        if self.link is not None and self.link.is_running:
            self.link.send(frames.pack_order(fields), is_order=True)


def _text(fields: dict[str, Any]) -> str:
    return json.dumps(fields, separators=(",", ":"), allow_nan=False)


def link_to(
    room: VoiceRoom,
    addresses: Sequence[str],
    *,
    lock: threading.RLock,
    now_ns: Callable[[], int],
    say: Callable[[str], None],
    wake: Callable[[], None],
) -> MediaLink:
    """Return a link by which a room gets and sends voices; the room has it from then on.

    Args:
        room: takes what the process says.
        addresses: of this machine, at which the process takes connections.
        lock: held whenever the room is used.
        now_ns: gives session time.
        say: takes a line for the log.
        wake: lets everybody have what is new; on any thread.
    """

    def took(kind: int, data: bytes) -> None:
        with lock:
            is_news = room.take_frame(kind, data, now_ns=now_ns())
        if is_news:
            wake()

    def died() -> None:
        say("people: the process of media has ended; it begins again when it is needed")
        with lock:
            room.process_died()
        wake()

    link = room.link = MediaLink(addresses, took=took, died=died)
    return link
