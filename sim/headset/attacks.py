"""People who try what they may not, on a hub of one's own: each attempt has to be refused."""

from __future__ import annotations

import asyncio
import base64
import json
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from typing import Any, Protocol

import aiohttp

from devices.hub.contract import Invitation
from devices.hub.roles import Role
from sim.headset.connection import (
    ANSWER_S,
    HubAddress,
    HubConnection,
    HubRefusedError,
    connect,
    pair,
)

FOREIGN = "https://elsewhere.example"
"""Origin of a page that is not the hub's."""

WRONG_CODES = 8
"""Codes that are guessed, chosen: more than a hub lets an address guess in a minute."""

LINE: dict[str, Any] = {
    "kind": "do",
    "id": 1,
    "op": "line",
    "line": "graffiti",
    "points": [[0.0, 1.0, 0.0], [0.1, 1.0, 0.0]],
    "colour": [1.0, 0.0, 0.0],
}
"""An operation that a spectator, or somebody who is muted, may not do."""


class Operator(Protocol):
    """Means of a hub's operator."""

    def invite(self, role: Role = Role.REMOTE) -> Invitation:
        """Make a code."""
        ...

    def revoke(self, code: str) -> None:
        """Let a code be worth nothing."""
        ...

    def mute(self, person_id: str, *, is_muted: bool) -> None:
        """Refuse a person's body and operations, or take them again."""
        ...

    def remove(self, person_id: str) -> None:
        """Send a person away."""
        ...


@dataclass(frozen=True, slots=True)
class Attempt:
    """One attack: its name, and whether the hub refused it."""

    name: str
    was_refused: bool


async def attack(
    address: HubAddress, operator: Operator, *, expired: Callable[[str], str]
) -> tuple[Attempt, ...]:
    """Return how a hub stands attacks; those who attack are strangers and two guests of it.

    The guesses come last: the hub lets nobody from this address pair for a minute after them.

    Args:
        address: of the hub.
        operator: lets the guests in, mutes one and removes one.
        expired: gives a token of a person (by id) whose time is over, signed by the hub.

    Raises:
        aiohttp.ClientError, TimeoutError, OSError: the hub is not reached.
    """
    async with address.opened() as http:
        attempts = await _with_foreign_origin(http, address, operator=operator)
        attempts += await _as_spectator(http, address, operator=operator)
        attempts += await _as_guest(http, address, operator=operator, expired=expired)
        attempts += await _with_bad_codes(http, address, operator=operator)
    return tuple(attempts)


async def _with_foreign_origin(
    http: aiohttp.ClientSession, address: HubAddress, *, operator: Operator
) -> list[Attempt]:
    code = operator.invite().code
    foreign = await _tried(
        "pairing by a foreign page",
        lambda: pair(http, address, code=code, name="Mallory", origin=FOREIGN),
    )
    token = await pair(http, address, code=code, name="Mallory")
    socket = await _tried(
        "connection by a foreign page",
        lambda: connect(http, address, token=token, name="Mallory", origin=FOREIGN),
    )
    return [foreign, socket]


async def _as_spectator(
    http: aiohttp.ClientSession, address: HubAddress, *, operator: Operator
) -> list[Attempt]:
    code = operator.invite(Role.SPECTATOR).code
    token = await pair(http, address, code=code, name="Mallory")
    connection = await connect(http, address, token=token, name="Mallory")
    drawn = Attempt("operation without the right", await _is_refused(connection))
    promoted = await _tried(
        "token with another role",
        lambda: connect(http, address, token=_promoted(token), name="Mallory"),
    )
    await connection.close()
    return [drawn, promoted]


async def _as_guest(
    http: aiohttp.ClientSession,
    address: HubAddress,
    *,
    operator: Operator,
    expired: Callable[[str], str],
) -> list[Attempt]:
    code = operator.invite().code
    first = await pair(http, address, code=code, name="Mallory")
    again = await _tried("code used before", lambda: pair(http, address, code=code, name="Mallory"))
    connection = await connect(http, address, token=first, name="Mallory")
    person, second = str(connection.welcome["you"]), str(connection.welcome["token"])
    operator.mute(person, is_muted=True)
    muted = Attempt("operation of somebody muted", await _is_refused(connection))
    await connection.close()
    # Coming back with the second token lets the first, which may have been overheard, end.
    connection = await connect(http, address, token=second, name="Mallory")
    third = str(connection.welcome["token"])
    replayed = await _tried(
        "token used before", lambda: connect(http, address, token=first, name="Mallory")
    )
    old = await _tried(
        "token that has expired",
        lambda: connect(http, address, token=expired(person), name="Mallory"),
    )
    operator.remove(person)
    await connection.close()
    removed = await _tried(
        "token of somebody removed", lambda: connect(http, address, token=third, name="Mallory")
    )
    return [again, muted, replayed, old, removed]


async def _with_bad_codes(
    http: aiohttp.ClientSession, address: HubAddress, *, operator: Operator
) -> list[Attempt]:
    revoked, good = operator.invite().code, operator.invite().code
    operator.revoke(revoked)
    attempts = [
        await _tried("code withdrawn", lambda: pair(http, address, code=revoked, name="Mallory"))
    ]
    for number in range(WRONG_CODES):
        wrong = f"{(int(good) + 1 + number) % 10 ** len(good):0{len(good)}d}"
        attempts.append(
            await _tried(
                "wrong code",
                lambda code=wrong: pair(http, address, code=code, name="Mallory"),
            )
        )
    # By then this address is locked out, whatever it knows.
    attempts.append(
        await _tried("code after guessing", lambda: pair(http, address, code=good, name="Mallory"))
    )
    operator.revoke(good)
    return attempts


async def _tried(name: str, attempt: Callable[[], Awaitable[object]]) -> Attempt:
    """Return how an attempt went; a connection that was given is closed again."""
    try:
        found = await attempt()
    except HubRefusedError:
        return Attempt(name, was_refused=True)
    if isinstance(found, HubConnection):
        await found.close()
    return Attempt(name, was_refused=False)


async def _is_refused(connection: HubConnection) -> bool:
    """Return whether the hub refuses to draw a line for somebody."""
    await connection.send(LINE)
    async with asyncio.timeout(ANSWER_S):
        while True:
            said = await connection.receive()
            if said is None:
                return True
            if isinstance(said, dict) and said.get("kind") in ("done", "refused"):
                return said["kind"] == "refused"


def _promoted(token: str) -> str:
    """Return a signed token in which the role is another one."""
    head, payload, signature = token.split(".")
    padded = payload + "=" * (-len(payload) % 4)
    claims = json.loads(base64.urlsafe_b64decode(padded))
    changed = json.dumps(
        {key: "operator" if value == Role.SPECTATOR else value for key, value in claims.items()}
    )
    text = base64.urlsafe_b64encode(changed.encode()).rstrip(b"=").decode()
    return f"{head}.{text}.{signature}"
