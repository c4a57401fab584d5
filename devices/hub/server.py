"""The hub's server: pairing, people, the room's state to all of them, what they do to the session."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from devices.clock import Clock
from devices.hub.roles import Person, Role
from scenes.state import Annotation, Avatar, LiveSurface, SceneState


@dataclass(frozen=True, slots=True)
class Asset:
    """A file of the web page: bytes, or where they lie; the type that browsers are told."""

    content: bytes | Path
    content_type: str


@dataclass(frozen=True, slots=True)
class HubSettings:
    """Where the hub listens and with which certificate.

    Attributes:
        host: "127.0.0.1" until the operator opens the hub; "0.0.0.0" for the whole network.
        port: 0 takes any free one.
        certificate_folder: root and leaf are kept there, made where they are missing; None for
            plain HTTP, which is allowed on the loopback alone.
        max_people: more are told that the room is full.
    """

    host: str = "127.0.0.1"
    port: int = 0
    certificate_folder: Path | None = None
    max_people: int = 32


@dataclass(frozen=True, slots=True)
class Invitation:
    """A way in for one person: a code of six digits, one use, two minutes."""

    code: str
    url: str
    role: Role
    expires_ns: int


@dataclass(frozen=True, slots=True, eq=False)
class Arrived:
    """Everything that people have sent since the last look, in the session's own types (z up).

    Attributes:
        avatars: newest of everybody who shows one.
        lines: new or grown lines; one without points is erased.
        surfaces: made or moved since then.
        events: (kind, text) of who came, left, was refused.
    """

    avatars: tuple[Avatar, ...] = ()
    lines: tuple[Annotation, ...] = ()
    surfaces: tuple[LiveSurface, ...] = ()
    events: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True, slots=True)
class HubCounts:
    """Figures since the start: bytes and messages out, states and bodies left out, refusals."""

    sent_bytes: int = 0
    sent_messages: int = 0
    dropped: int = 0
    refused: Mapping[str, int] = field(default_factory=dict)


class Hub:
    """People in a session. Its sockets live on a thread of its own; every method is safe anywhere.

    Args:
        settings: where it listens.
        assets: files of the page by path, "/" the page itself.
        clock: session time.
        say: takes a line for the log; never a secret.
    """

    def __init__(
        self,
        settings: HubSettings,
        assets: Mapping[str, Asset],
        *,
        clock: Clock,
        say: Callable[[str], None] = lambda _text: None,
    ) -> None:
        raise NotImplementedError

    def start(self) -> None:
        """Listen.

        Raises:
            OSError: the port is taken, or the certificate cannot be made.
        """
        raise NotImplementedError

    def close(self) -> None:
        """Say goodbye to everybody and free the port."""
        raise NotImplementedError

    @property
    def url(self) -> str:
        """Address of the page, with the machine's own address where it is open to the network."""
        raise NotImplementedError

    def publish(self, state: SceneState) -> None:
        """Send what has changed to everybody; returns at once."""
        raise NotImplementedError

    def take(self) -> Arrived:
        """Return what people have sent since the last call."""
        raise NotImplementedError

    def people(self) -> tuple[Person, ...]:
        """Return who is here, and who may come back."""
        raise NotImplementedError

    def invite(self, role: Role = Role.REMOTE) -> Invitation:
        """Make a code."""
        raise NotImplementedError

    def revoke(self, code: str) -> None:
        """Let a code be worth nothing."""
        raise NotImplementedError

    def set_role(self, person_id: str, role: Role) -> None:
        """Give a person another role; their rights change at once."""
        raise NotImplementedError

    def mute(self, person_id: str, *, is_muted: bool) -> None:
        """Refuse a person's body and operations, or take them again."""
        raise NotImplementedError

    def remove(self, person_id: str) -> None:
        """Send a person away; their token is worth nothing from then on."""
        raise NotImplementedError

    def counts(self) -> HubCounts:
        """Return figures since the start."""
        raise NotImplementedError
