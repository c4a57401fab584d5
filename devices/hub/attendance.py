"""People who were let in: connected, away for a moment, or still on their way from pairing."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field, replace

from devices.hub.entry.rates import Bucket
from devices.hub.entry.tokens import TOKEN_NS
from devices.hub.outbox import Outbox
from devices.hub.protocol.messages import DeviceSaid
from devices.hub.roles import Person, Role

AWAY_NS = 30 * 10**9
"""Time for which somebody whose connection broke is still listed: a walk through a dead spot."""

ARRIVING_NS = 120 * 10**9
"""Time between pairing and joining; chosen: the page's files have to come first."""

MAX_INDEX = 0x7FFF
"""Largest number of a person; a session of so many is over. Larger ones are for people of other
hubs."""

BODIES_HZ, BODIES_BURST = 100.0, 100.0
"""Bodies that a person may send: a headset's 90 a second, and what a stalled network delivers
together."""

TEXTS_HZ, TEXTS_BURST = 200.0, 400.0
"""Texts that a person may send: acknowledgements of 60 states, operations, and room above."""

SHOWN_NS = 2 * 10**9
"""Age of a body at which a person is hidden, two seconds."""

OPS_HZ, OPS_BURST = 40.0, 80.0
"""Operations that a person may ask for: a line that grows at 30 Hz."""

BYTES_HZ, BYTES_BURST = 1e6, 2e6
"""Bytes that a person may send in texts: a line of 1,000 points, 60 kB, at 15 Hz."""


@dataclass(frozen=True, slots=True)
class PageHeadset:
    """A headset whose wearer has joined by the page.

    Attributes:
        person: the wearer, with the round trip to them.
        said: newest of its page.
        said_age_s: time since it came.
        body_age_s: since the wearer's newest head and hands; None before the first.
    """

    person: Person
    said: DeviceSaid
    said_age_s: float
    body_age_s: float | None


@dataclass(slots=True, eq=False)
class Limits:
    """Buckets of one person; they outlast a connection."""

    bodies: Bucket
    texts: Bucket
    ops: Bucket
    text_bytes: Bucket

    @staticmethod
    def new(now_ns: int) -> Limits:
        """Return full buckets."""
        return Limits(
            Bucket(BODIES_HZ, BODIES_BURST, now_ns=now_ns),
            Bucket(TEXTS_HZ, TEXTS_BURST, now_ns=now_ns),
            Bucket(OPS_HZ, OPS_BURST, now_ns=now_ns),
            Bucket(BYTES_HZ, BYTES_BURST, now_ns=now_ns),
        )


@dataclass(slots=True, eq=False)
class Guest:
    """A person and their connection.

    Attributes:
        person: as others see them.
        limits: how much they may send.
        away_since_ns: when the connection broke, or the pairing was.
        outbox: of the connection; None while there is none.
        has_joined: whether they were ever connected.
        is_gone: whether the others know that they have left.
        oldest_token: number of the oldest token that is still good.
        newest_token: number of the newest one.
        renewed_ns: when the newest one was made.
        body: newest, as it came.
        body_ns: when that was; session time.
        faults: messages that could not be read.
        device: newest that the page of a headset has said of it, and when; None of no headset.
    """

    person: Person
    limits: Limits
    away_since_ns: int
    outbox: Outbox | None = None
    has_joined: bool = False
    is_gone: bool = False
    oldest_token: int = 1
    newest_token: int = 0
    renewed_ns: int = 0
    body: bytes = b""
    body_ns: int = 0
    faults: int = 0
    device: tuple[DeviceSaid, int] | None = None

    @property
    def called(self) -> str:
        """Name and id, as a line of the log has them."""
        return self.person.called

    def measure(self, round_trip_ns: int) -> None:
        """Note how long a ping and its answer took."""
        self.person = replace(self.person, latency_ms=round_trip_ns / 1e6)

    def is_listed(self, now_ns: int) -> bool:
        """Whether others see them among the people."""
        is_near = self.outbox is not None or now_ns - self.away_since_ns < AWAY_NS
        return self.has_joined and is_near

    def is_forgotten(self, now_ns: int) -> bool:
        """Whether nothing of them is kept any longer."""
        if self.outbox is not None:
            return False
        life_ns = TOKEN_NS if self.has_joined else ARRIVING_NS
        return now_ns - self.away_since_ns >= life_ns

    def change(
        self,
        *,
        role: Role | None = None,
        is_muted: bool | None = None,
        has_pen: bool | None = None,
    ) -> None:
        """Give the person another role, mute them, or note who has the pen."""
        person = self.person
        self.person = replace(
            person,
            role=person.role if role is None else role,
            is_muted=person.is_muted if is_muted is None else is_muted,
            has_pen=person.has_pen if has_pen is None else has_pen,
        )


@dataclass(frozen=True, slots=True, eq=False)
class Visit:
    """A person while one connection lasts."""

    guest: Guest
    outbox: Outbox


@dataclass(slots=True)
class Attendance:
    """Everybody, by person id."""

    _guests: dict[str, Guest] = field(default_factory=dict[str, Guest])
    _last_index: int = 0

    def add(self, name: str, role: Role, *, now_ns: int) -> Guest:
        """Let somebody in.

        Raises:
            OverflowError: no number is left.
        """
        if self._last_index >= MAX_INDEX:
            raise OverflowError(f"{MAX_INDEX} people have been here, start a new session")
        self._last_index += 1
        person = Person(f"p{self._last_index}", self._last_index, name, role, is_connected=False)
        guest = Guest(person, Limits.new(now_ns), now_ns)
        self._guests[person.person_id] = guest
        return guest

    def find(self, person_id: str) -> Guest | None:
        """Return somebody; None where nothing of them is known."""
        return self._guests.get(person_id)

    def known(self, person_id: str) -> Guest:
        """Return somebody.

        Raises:
            KeyError: nothing of them is known.
        """
        if person_id not in self._guests:
            raise KeyError(f"hub: nobody is {person_id!r}, see people()")
        return self._guests[person_id]

    def remove(self, person_id: str) -> None:
        """Forget somebody."""
        self._guests.pop(person_id, None)

    def connected(self) -> Iterator[tuple[Guest, Outbox]]:
        """Return everybody with a connection."""
        return ((g, g.outbox) for g in list(self._guests.values()) if g.outbox is not None)

    def listed(self, now_ns: int) -> list[Guest]:
        """Return who is here or may come back any moment."""
        return [guest for guest in self._guests.values() if guest.is_listed(now_ns)]

    def note_left(self, now_ns: int) -> list[Guest]:
        """Return who is not listed any longer, each once until they come back."""
        left = [
            guest
            for guest in self._guests.values()
            if guest.has_joined and not guest.is_gone and not guest.is_listed(now_ns)
        ]
        for guest in left:
            guest.is_gone = True
        return left

    def shown(self, now_ns: int) -> list[tuple[Person, bytes]]:
        """Return everybody who shows a body, and the newest of each."""
        here, since_ns = self.listed(now_ns), now_ns - SHOWN_NS
        return [(each.person, each.body) for each in here if each.body and each.body_ns >= since_ns]

    def headsets(self, now_ns: int) -> tuple[PageHeadset, ...]:
        """Return headsets of who is here, or may come back any moment."""
        found: list[PageHeadset] = []
        for guest in self.listed(now_ns):
            if guest.device is not None:
                said, said_ns = guest.device
                body_s = (now_ns - guest.body_ns) / 1e9 if guest.body else None
                found.append(PageHeadset(guest.person, said, (now_ns - said_ns) / 1e9, body_s))
        return tuple(found)

    def arriving(self) -> int:
        """Return how many have paired and not joined yet."""
        return sum(not guest.has_joined for guest in self._guests.values())

    def forget_old(self, now_ns: int) -> list[Guest]:
        """Drop whoever cannot come back; return them."""
        gone = [guest for guest in self._guests.values() if guest.is_forgotten(now_ns)]
        for guest in gone:
            del self._guests[guest.person.person_id]
        return gone
