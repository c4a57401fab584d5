"""Messages that wait for one client, and their pace: freshest first, the log in order."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field

from devices.hub.channels import BodyChannel, PictureChannel, StateChannel, to_text
from devices.hub.media.voice_room import new_voices, take_voices
from devices.hub.media.voice_wire import Voice
from devices.hub.protocol.mesh import MeshChannel
from devices.hub.protocol.wire import join_items

MAX_TEXTS = 1000
"""Texts that wait, the log's among them; more and the client is dropped."""

MAX_TEXT_BYTES = 1024 * 1024
"""Their length together, when more than one waits."""

MAX_UNSEEN = 2
"""States on their way: one that is drawn while the next one travels."""

BODY_PAUSE_NS = 10**9 // 90
"""Average time between two messages of bodies: the fastest display of the headsets meant, 90 Hz."""


@dataclass(slots=True)
class Sent:
    """Figures of everything sent: bytes, messages, states and bodies left out."""

    bytes: int = 0
    messages: int = 0
    dropped: int = 0


@dataclass(slots=True, eq=False)
class Outbox:
    """Everything that one client is still to get.

    Attributes:
        index: of its person, whose own body it does not get.
        sent: figures, shared by all clients.
        is_ending: whether the connection closes after the texts that wait.
        is_overfull: whether texts were lost because the client is too slow.
        token_number: of the token in the welcome.
        next_body_ns: session time from which bodies may be sent again.
        voices: index of a person and a moment of their voice, for whoever listens over this.
        video_ids: surfaces that come as video, of which no pictures are sent.
    """

    index: int
    sent: Sent
    is_ending: bool = False
    is_overfull: bool = False
    token_number: int = 0
    next_body_ns: int = 0
    voices: deque[tuple[int, Voice]] = field(default_factory=new_voices)
    video_ids: frozenset[str] = frozenset()
    _first: deque[str] = field(default_factory=deque[str])
    _texts: deque[str] = field(default_factory=deque[str])
    _text_bytes: int = 0
    _people: str | None = None
    _newest_people: str = ""
    _first_version: int = 0
    _sent_version: int = -1
    _unseen: deque[int] = field(default_factory=deque[int])
    _sent_bodies: int = 0
    _sent_pictures: int = 0
    _sent_cells: int = 0
    _body_numbers: dict[int, int] = field(default_factory=dict[int, int])

    def begin(self, texts: Sequence[str], *, version: int, token_number: int) -> None:
        """Put the first texts; states after that version follow them, and everybody's body.

        Args:
            texts: the welcome, and the log that was missed: however long, nobody is slow yet.
            version: of the state in it.
            token_number: of the token in it.
        """
        self._first.extend(texts)
        self._first_version = self._sent_version = version
        self.token_number = token_number

    def put(self, text: str) -> None:
        """Let a text follow those that wait."""
        if self.is_ending:
            return
        self._texts.append(text)
        self._text_bytes += len(text)
        is_long = self._text_bytes > MAX_TEXT_BYTES and len(self._texts) > 1
        if is_long or len(self._texts) > MAX_TEXTS:
            self.is_overfull = True
            self.end("your connection is too slow for what happens in the room")

    def put_people(self, text: str) -> None:
        """Let the list of people follow if it is another; one that waits is replaced."""
        if text != self._newest_people:
            self._people = self._newest_people = text

    def end(self, why: str) -> None:
        """Send nothing more but goodbye."""
        if self.is_ending:
            return
        self._first.clear()
        self._texts.clear()
        self._text_bytes = 0
        self.put(to_text({"kind": "bye", "why": why}))
        self.is_ending = True

    def see(self, version: int) -> bool:
        """Note that a state has come, and all before it; return whether the welcome has, too."""
        while self._unseen and self._unseen[0] <= version:
            self._unseen.popleft()
        return self._first_version <= version <= self._sent_version

    def take(
        self,
        states: StateChannel,
        bodies: BodyChannel,
        *,
        now_ns: int,
        pictures: PictureChannel | None = None,
        mesh: MeshChannel | None = None,
    ) -> str | bytes | None:
        """Return the next message; None where nothing is due.

        Args:
            states: newest state.
            bodies: newest bodies.
            now_ns: session time.
            pictures: newest pictures of live surfaces, which wait for all else.
            mesh: surfaces that hide, which wait for all but pictures.
        """
        message = self._next(states, bodies, now_ns=now_ns)
        if message is None and mesh is not None and not self.is_ending:
            message = self._cells(mesh)
        if message is None and pictures is not None and not self.is_ending:
            message = self._picture(pictures)
        if message is not None:
            self.sent.messages += 1
            self.sent.bytes += len(message)
        return message

    def _next(
        self, states: StateChannel, bodies: BodyChannel, *, now_ns: int
    ) -> str | bytes | None:
        if self._first:
            return self._first.popleft()
        if self._texts:
            text = self._texts.popleft()
            self._text_bytes -= len(text)
            return text
        if self.is_ending:
            return None
        if self.voices:
            return take_voices(self.voices)
        if bodies.counter > self._sent_bodies and now_ns >= self.next_body_ns:
            bundle = self._bundle(bodies)
            if bundle is not None:
                # A body that came late is followed at once by one that is in time.
                self.next_body_ns = max(self.next_body_ns, now_ns - BODY_PAUSE_NS) + BODY_PAUSE_NS
                return bundle
        if self._people is not None:
            text, self._people = self._people, None
            return text
        if states.version > self._sent_version and len(self._unseen) < MAX_UNSEEN:
            message = states.message_since(self._sent_version)
            self.sent.dropped += states.version - self._sent_version - 1
            self._sent_version = states.version
            self._unseen.append(states.version)
            return message
        return None

    def _cells(self, mesh: MeshChannel) -> bytes | None:
        found = mesh.next_after(self._sent_cells)
        if found is None:
            return None
        self._sent_cells, message = found
        return message

    def _picture(self, pictures: PictureChannel) -> bytes | None:
        found = pictures.next_after(self._sent_pictures, but=self.video_ids)
        if found is None:
            return None
        self._sent_pictures, message = found
        return message

    def _bundle(self, bodies: BodyChannel) -> bytes | None:
        newer = bodies.since(self._sent_bodies, but=self.index)
        self._sent_bodies = bodies.counter
        for index, number, _item in newer:
            self.sent.dropped += max(0, number - self._body_numbers.get(index, number - 1) - 1)
            self._body_numbers[index] = number
        return join_items([item for _index, _number, item in newer]) if newer else None
