"""The transport over zenoh: by way of a router, over mutual TLS or on this computer alone."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Mapping
from typing import Any, cast

import zenoh

from devices.transport.access import LINK
from devices.transport.passes import Pass
from devices.transport.transport import (
    ASK_S,
    MAX_ANSWER_BYTES,
    MAX_MESSAGE_BYTES,
    MAX_QUESTION_BYTES,
    Answer,
    Handler,
    TransportError,
    check_length,
)

OPEN_S = 5.0
"""Longest time to reach the router at first, seconds."""

RETRY_MS = {"period_init_ms": 100, "period_max_ms": 300, "period_increase_factor": 1.5}
"""Pauses between tries to reach a router again, chosen: all are back within 2 s of it."""


# zenoh's own types leave results out: its objects are `Any` here.


class ZenohTransport:
    """A `Transport` by way of a router, which it reaches again by itself.

    Args:
        address: host and port of the router, such as "10.0.0.5:7447".
        given: the pass by which the router knows this machine; None for a router without TLS, on
            this computer.

    Raises:
        TransportError: the router is not reached, or refuses the pass.
    """

    def __init__(self, address: str, given: Pass | None) -> None:
        self._address = address
        self._ends: list[Callable[[], None]] = []
        self._lock = threading.Lock()
        try:
            self._session = cast(Any, zenoh.open(_config(client_fields(address, given))))
        except zenoh.ZError as error:
            raise TransportError(
                f"router {address} is not reached, or does not know this pass; "
                f"is `nexus sites router` running there? ({_first_line(error)})"
            ) from None

    def put(self, key: str, data: bytes) -> None:
        """Send a message; one that an overfull link cannot take is lost."""
        check_length(key, data)
        try:
            self._session.put(
                key, data, congestion_control=zenoh.CongestionControl.DROP, express=True
            )
        except zenoh.ZError:
            return  # closed, or no way: whoever misses it asks for it

    def subscribe(self, pattern: str, handler: Handler) -> Callable[[], None]:
        """Hear messages; return what ends it."""

        def hear(sample: zenoh.Sample) -> None:
            if sample.kind == zenoh.SampleKind.PUT and len(sample.payload) <= MAX_MESSAGE_BYTES:
                handler(str(sample.key_expr), sample.payload.to_bytes())

        subscriber = self._session.declare_subscriber(pattern, hear)
        return self._ended_by(subscriber.undeclare)

    def serve(self, pattern: str, answer: Answer) -> Callable[[], None]:
        """Answer questions; return what ends it."""

        def respond(query: Any) -> None:
            payload = query.payload
            if payload is None or len(payload) > MAX_QUESTION_BYTES:
                return
            data = answer(str(query.key_expr), payload.to_bytes())
            if data is not None and len(data) <= MAX_ANSWER_BYTES:
                query.reply(query.key_expr, data)

        queryable = self._session.declare_queryable(pattern, respond)
        return self._ended_by(queryable.undeclare)

    def ask(self, key: str, question: bytes, *, answered: Callable[[bytes], None]) -> None:
        """Ask; the answer comes on a thread of zenoh's."""
        check_length(key, question, limit=MAX_QUESTION_BYTES)

        def take(reply: zenoh.Reply) -> None:
            sample = reply.ok
            if sample is not None and len(sample.payload) <= MAX_ANSWER_BYTES:
                answered(sample.payload.to_bytes())

        try:
            self._session.get(key, take, payload=question, timeout=ASK_S)
        except zenoh.ZError:
            return  # closed, or no way: it is asked again

    def close(self) -> None:
        """End the connection."""
        with self._lock:
            self._ends.clear()
        self._session.close()

    def _ended_by(self, undeclare: Callable[[], None]) -> Callable[[], None]:
        def end() -> None:
            with self._lock:
                if end not in self._ends:
                    return
                self._ends.remove(end)
            undeclare()

        with self._lock:
            self._ends.append(end)
        return end


class ZenohRouter:
    """A router in this process.

    Args:
        fields: its configuration, as `access.router_fields` makes it.

    Raises:
        TransportError: its port is taken, or a file of its certificates cannot be read.
    """

    def __init__(self, fields: Mapping[str, Any]) -> None:
        try:
            self._session = cast(Any, zenoh.open(_config(fields)))
        except zenoh.ZError as error:
            where = ", ".join(fields["listen"]["endpoints"])
            raise TransportError(f"router at {where}: {_first_line(error)}") from None

    def close(self) -> None:
        """End it; machines that are connected try again until one is there."""
        self._session.close()


def client_fields(address: str, given: Pass | None) -> dict[str, Any]:
    """Return the configuration of a machine that connects to a router, in zenoh's words."""
    fields: dict[str, Any] = {
        "mode": "client",
        "connect": {
            "endpoints": [f"{'tcp' if given is None else 'tls'}/{address}"],
            "timeout_ms": round(1000 * OPEN_S),
            "exit_on_failure": True,
            "retry": RETRY_MS,
        },
        "scouting": {"multicast": {"enabled": False}, "gossip": {"enabled": False}},
        "transport": {"unicast": LINK["unicast"], "link": dict(LINK["link"])},
    }
    if given is not None:
        fields["transport"]["link"]["tls"] = {
            "root_ca_certificate_base64": given.root_base64,
            "connect_private_key_base64": given.key_base64,
            "connect_certificate_base64": given.certificate_base64,
            "enable_mtls": True,
            "verify_name_on_connect": True,
        }
    return fields


def _config(fields: Mapping[str, Any]) -> zenoh.Config:
    return zenoh.Config.from_json5(json.dumps(dict(fields)))


def _first_line(error: Exception) -> str:
    """Return what zenoh says without the places in its own source."""
    return str(error).partition(" at /")[0].splitlines()[0][:200]
