"""Signed tokens by which a person who has paired comes in, and comes back."""

from __future__ import annotations

import secrets
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import jwt

from devices.hub.roles import Role

ALGORITHM = "HS256"
"""Signature: only the hub makes tokens and only the hub reads them."""

KEY_BYTES = 32
"""Length of the key, drawn anew for every session: the hash's own length."""

TOKEN_NS = 15 * 60 * 10**9
"""Life of a token; chosen: longer than a headset is laid down for. A fresh one comes in time."""

MAX_TOKEN_CHARACTERS = 1024
"""Longest token that is looked at; the hub's own have below 400."""

_CLAIMS = ("session", "person", "role", "number", "until_ns")
"""All that is in a token."""


class TokenRefused(Exception):
    """A token is not accepted; says why, and never the token."""


@dataclass(frozen=True, slots=True)
class Ticket:
    """A token that was read.

    Attributes:
        person_id: whose.
        role: as it was given.
        number: counts a person's tokens.
    """

    person_id: str
    role: Role
    number: int


class Tokens:
    """The tokens of one session.

    Args:
        random_bytes: so many that nobody can foretell.
    """

    def __init__(self, random_bytes: Callable[[int], bytes] = secrets.token_bytes) -> None:
        self._key = random_bytes(KEY_BYTES)
        self._session_id = random_bytes(8).hex()

    def make(self, ticket: Ticket, now_ns: int, *, life_ns: int = TOKEN_NS) -> str:
        """Return a token.

        Args:
            ticket: whose.
            now_ns: session time.
            life_ns: how long it is good.
        """
        claims = {
            "session": self._session_id,
            "person": ticket.person_id,
            "role": ticket.role.value,
            "number": ticket.number,
            "until_ns": now_ns + life_ns,
        }
        return jwt.encode(claims, self._key, algorithm=ALGORITHM)

    def read(self, token: str, now_ns: int) -> Ticket:
        """Return whose token it is.

        Raises:
            TokenRefused: it is not the hub's own, of another session, or expired.
        """
        if len(token) > MAX_TOKEN_CHARACTERS:
            raise TokenRefused("the token is too long")
        try:
            # Times are the session's own: the library would read the computer's clock.
            claims: dict[str, Any] = jwt.decode(
                token,
                self._key,
                algorithms=[ALGORITHM],
                options={"verify_exp": False, "verify_iat": False, "verify_nbf": False},
            )
        except (jwt.PyJWTError, ValueError, RecursionError):
            raise TokenRefused("the token is not of this session") from None
        if set(claims) != set(_CLAIMS) or claims["session"] != self._session_id:
            raise TokenRefused("the token is of another session")
        if now_ns >= claims["until_ns"]:
            raise TokenRefused("the token has expired, pair again")
        return Ticket(claims["person"], Role(claims["role"]), claims["number"])
