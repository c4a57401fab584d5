"""Values that the hub is given and gives: settings, files of the page, invitations, figures."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path

from devices.hub.protocol.messages import Wish
from devices.hub.roles import Role
from devices.messages import VoicePacket
from scenes.state import Annotation, Avatar, LiveSurface, Placed


@dataclass(frozen=True, slots=True)
class Asset:
    """A file of the web page.

    Attributes:
        content: its bytes, or where they lie.
        content_type: of the HTTP answer.
        is_private: whether it is given to people in the session alone, who send their token as
            `Authorization: Bearer TOKEN`: the room itself, say.
        takes: takes what a person in the session posts to it, their id first, on the hub's thread;
            returns why it is not taken, empty if it is. None where nothing may be posted.
    """

    content: bytes | Path
    content_type: str
    is_private: bool = False
    takes: Callable[[str, bytes], str] | None = None


@dataclass(frozen=True, slots=True)
class HubSettings:
    """Address at which the hub listens, and its certificate.

    Attributes:
        host: "127.0.0.1" until the operator opens the hub; "0.0.0.0" for the whole network.
        port: 0 takes any free one.
        certificate_folder: root and leaf are kept there, made where they are missing; None for
            plain HTTP, which is allowed on the loopback alone.
        max_people: more are refused, as the room is full.
        names: further host names under which browsers reach this machine.
        is_voice_recorded: whether voices are handed to the session, which records them; everybody
            is told.
    """

    host: str = "127.0.0.1"
    port: int = 0
    certificate_folder: Path | None = None
    max_people: int = 32
    names: tuple[str, ...] = ()
    is_voice_recorded: bool = False


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
        surfaces: made or moved since then; one without corners, (0, 3), is removed.
        placed: primitives and proposals, likewise; see `scenes.state.is_there`.
        events: (kind, text) of who came, left, was refused.
        voices: what was heard; none unless it is recorded.
        wishes: of a site's people, for the room that decides whose shapes are.
    """

    avatars: tuple[Avatar, ...] = ()
    lines: tuple[Annotation, ...] = ()
    surfaces: tuple[LiveSurface, ...] = ()
    placed: tuple[Placed, ...] = ()
    events: tuple[tuple[str, str], ...] = ()
    voices: tuple[VoicePacket, ...] = ()
    wishes: tuple[Wish, ...] = ()


@dataclass(frozen=True, slots=True)
class HubCounts:
    """Figures since the start: bytes and messages out, states and bodies left out, refusals."""

    sent_bytes: int = 0
    sent_messages: int = 0
    dropped: int = 0
    refused: Mapping[str, int] = field(default_factory=dict[str, int])
