"""Letting people in: a code becomes a person and a token, a token a connection."""

from __future__ import annotations

from dataclasses import dataclass

from devices.hub.attendance import Attendance, Guest
from devices.hub.entry.pairing import PairingCodes
from devices.hub.entry.tokens import Ticket, TokenRefused, Tokens

MAX_ARRIVING = 64
"""People who have paired and not joined, at the same time."""


class Refused(Exception):
    """Somebody is not let in; says why.

    Args:
        why: in words for the person.
        kind: under which it is counted.
    """

    def __init__(self, why: str, *, kind: str) -> None:
        super().__init__(why)
        self.kind = kind


@dataclass(slots=True)
class Admission:
    """The door of a session.

    A token is good until a newer one of its person has been used, or is known to have come: of
    a token that was overheard, the second use is refused.

    Attributes:
        attendance: everybody who was let in.
        codes: ways in.
        tokens: ways back in.
        max_people: listed at the same time.
    """

    attendance: Attendance
    codes: PairingCodes
    tokens: Tokens
    max_people: int

    def pair(self, code: str, *, name: str, address: str, now_ns: int) -> Guest:
        """Return somebody new for a code, which is used up.

        Raises:
            PairingRefused: it is wrong.
            Refused: the room is full.
        """
        if self._is_full(now_ns) or self.attendance.arriving() >= MAX_ARRIVING:
            raise Refused("the room is full", kind="full")
        role = self.codes.redeem(code, address=address, now_ns=now_ns)
        return self.attendance.add(name, role, now_ns=now_ns)

    def admit(self, token: str, now_ns: int) -> Guest:
        """Return whose token it is, for whom there is room; older ones are worth nothing from then.

        Raises:
            Refused: it is not good, or the room is full.
        """
        guest, number = self.read(token, now_ns)
        if not guest.is_listed(now_ns) and self._is_full(now_ns):
            raise Refused("the room is full", kind="full")
        guest.oldest_token = number
        return guest

    def known_by(self, token: str, now_ns: int) -> str:
        """Return the id of whose token is good, without using it; empty where it is nobody's."""
        try:
            return self.read(token, now_ns)[0].person.person_id
        except Refused:
            return ""

    def read(self, token: str, now_ns: int) -> tuple[Guest, int]:
        """Return whose token it is, and its number.

        Raises:
            Refused: it is not good.
        """
        try:
            ticket = self.tokens.read(token, now_ns)
        except TokenRefused as error:
            raise Refused(str(error), kind="token") from None
        guest = self.attendance.find(ticket.person_id)
        if guest is None:
            raise Refused("the person was removed or away too long, pair again", kind="token")
        if not guest.oldest_token <= ticket.number <= guest.newest_token:
            raise Refused("the token was replaced by a newer one", kind="token")
        return guest, ticket.number

    def new_token(self, guest: Guest, now_ns: int) -> str:
        """Return the next token of somebody."""
        guest.newest_token += 1
        guest.renewed_ns = now_ns
        person = guest.person
        ticket = Ticket(person.person_id, person.role, guest.newest_token)
        return self.tokens.make(ticket, now_ns)

    def _is_full(self, now_ns: int) -> bool:
        return len(self.attendance.listed(now_ns)) >= self.max_people
