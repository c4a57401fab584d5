"""The headset's wearer among a session's people: stands for its hub, with one person more."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Protocol

from devices.hololens.values import HeadAndHands
from devices.hub.contract import Arrived
from devices.hub.elsewhere import Elsewhere
from devices.hub.protocol.wire import WireError, encode_body
from devices.hub.roles import Person, Role
from scenes.pose import Pose
from scenes.state import Avatar, SceneState
from studio.live.hololens.body import avatar_of, body_of
from studio.live.people.entering import People

WEARER = "hololens"
"""Id of the wearer among people, and the way by which they came."""


class Meeting(Protocol):
    """Part of a hub that shows its people somebody else."""

    def meet(self, others: Sequence[Elsewhere], *, way: str = ...) -> None:
        """Show people who are in the session another way."""
        ...


class WithLocalUser:
    """People of a session and the wearer; used like a hub.

    Args:
        inner: all others; None where nobody can join.
        wearer: returns the wearer's avatar now; None while it is not known where they are.
        take_events: returns events of the headset since the last call: kind and text.
        publish: takes every new state.
    """

    def __init__(
        self,
        inner: People | None,
        *,
        wearer: Callable[[], Avatar | None],
        take_events: Callable[[], tuple[tuple[str, str], ...]],
        publish: Callable[[SceneState], None],
    ) -> None:
        self._inner, self._wearer = inner, wearer
        self._take_events, self._publish = take_events, publish

    def take(self) -> Arrived:
        """Return what people have sent since the last call, and where the wearer is."""
        arrived = Arrived() if self._inner is None else self._inner.take()
        avatar = self._wearer()
        more = () if avatar is None else (avatar,)
        events = (*arrived.events, *self._take_events())
        return replace(arrived, avatars=(*arrived.avatars, *more), events=events)

    def publish(self, state: SceneState) -> None:
        """Send what has changed to everybody; returns at once."""
        self._publish(state)
        if self._inner is not None:
            self._inner.publish(state)

    def show(self, surface_id: str, jpeg: bytes) -> None:
        """Send what a live surface shows to everybody; returns at once."""
        if self._inner is not None:
            self._inner.show(surface_id, jpeg)


def wearer_now(
    sample: HeadAndHands | None, device_from_world: Pose | None, *, name: str
) -> Avatar | None:
    """Return the wearer's avatar; None without a sample or an origin."""
    if sample is None or device_from_world is None:
        return None
    return avatar_of(sample, device_from_world.inverse(), user_id=WEARER, name=name)


def show_to(
    hub: Meeting, sample: HeadAndHands | None, *, device_from_world: Pose | None, name: str
) -> None:
    """Show the wearer to the people of a hub, without a body while it is not known where they are.

    They have no page on which to hand over what is theirs: whoever asks gets it.
    """
    person = Person(WEARER, 0, name, Role.LOCAL, is_yielding=True)
    data = b""
    if sample is not None and device_from_world is not None:
        body = body_of(sample, device_from_world.inverse())
        try:
            data = b"" if body is None else encode_body(body)
        except WireError:
            data = b""  # a headset that is lost says that it is kilometres away
    hub.meet([Elsewhere(person, data)], way=WEARER)
