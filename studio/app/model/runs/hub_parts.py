"""Doors and a hub, as far as the window uses those of a live session."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:  # the hub takes a second to import: not before somebody is let in
    from devices.hub.contract import Invitation
    from devices.hub.roles import Person, Role
    from studio.live.people.hosting import Hosting


class HubLike(Protocol):
    """A hub, as far as the panel uses `devices.hub.server.Hub`."""

    @property
    def url(self) -> str:
        """Address of the page."""
        ...

    def people(self) -> tuple[Person, ...]:
        """Return who is here, and who may come back."""
        ...

    def invite(self, role: Role = ...) -> Invitation:
        """Make a code."""
        ...

    @property
    def port(self) -> int:
        """Number of the port at which it listens."""
        ...

    def give_pen(self, person_id: str | None) -> None:
        """Let one person alone draw, or everybody again."""
        ...

    def revoke(self, code: str) -> None:
        """Let a code be worth nothing."""
        ...

    def set_role(self, person_id: str, role: Role) -> None:
        """Give a person another role."""
        ...

    def mute(self, person_id: str, *, is_muted: bool) -> None:
        """Refuse a person's body and operations, or take them again."""
        ...

    @property
    def is_voice_recorded(self) -> bool:
        """Whether the session gets voices for its recording."""
        ...

    def record_voices(self, *, is_recorded: bool) -> None:
        """Let the session record voices, or no longer."""
        ...

    def remove(self, person_id: str) -> None:
        """Send a person away."""
        ...


class DoorsLike(Protocol):
    """Doors, as far as the panel uses `studio.live.people.doors.Doors`."""

    @property
    def hub(self) -> HubLike | None:
        """The hub; None while the doors are closed."""
        ...

    @property
    def hosting(self) -> Hosting | None:
        """How people join."""
        ...

    def open(self, hosting: Hosting) -> HubLike:
        """Let people in."""
        ...

    def close(self) -> None:
        """Say goodbye to everybody."""
        ...

    def now_ns(self) -> int:
        """Return session time."""
        ...
