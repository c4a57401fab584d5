"""People's avatars, lines and surfaces into a session, and its state out to them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Generic, Protocol, TypeVar

import numpy as np

from devices.hub.contract import Arrived
from devices.messages import Event, Frame
from scenes.quad import quad_of
from scenes.state import (
    Annotation,
    Avatar,
    AvatarGone,
    LiveSurface,
    Placed,
    SceneState,
    id_of,
    is_there,
)
from studio.session.live_surfaces import live_surface
from studio.session.pipeline import PEOPLE, SessionMessage

T = TypeVar("T")

HIDDEN_AFTER_NS = 2_000_000_000
"""Session time without a body after which a person's avatar ends, as in every client."""

DIGITS = 4
"""Of metres that are kept of hands and rays, chosen: a tenth of a millimetre, less than a hand
tracker's error, in a third of the bytes."""

MAX_LINES = 2_000
"""Lines of people in one session, chosen: twenty each of a hundred people. More are refused."""

MAX_LINES_A_FRAME = 256
"""Lines that enter with one frame; the others come with the next ones. A session takes 1,024."""

MAX_SURFACES = 16
"""Live surfaces of people in one session, chosen: each takes some 5 ms of every frame."""

MAX_SURFACES_A_FRAME = 16
"""Surfaces that enter with one frame; the others come with the next ones. A session takes 64."""

MAX_PLACED = 320
"""Primitives and proposals of people in one session, chosen: more than a hub takes."""

MAX_PLACED_A_FRAME = 64
"""Primitives and proposals that enter with one frame; the others come with the next ones."""

MAX_EVENTS_A_FRAME = 32
"""Events of people that enter with one frame; of more, only the number is said."""


class People(Protocol):
    """Part of a hub that a session needs."""

    def take(self) -> Arrived:
        """Return what people have sent since the last call."""
        ...

    def publish(self, state: SceneState) -> None:
        """Send what has changed to everybody; returns at once."""
        ...

    def show(self, surface_id: str, jpeg: bytes) -> None:
        """Send what a live surface shows to everybody; returns at once."""
        ...


@dataclass(frozen=True, slots=True, eq=False)
class _Shown:
    """A person's newest avatar and the session time at which it came."""

    avatar: Avatar
    t_ns: int


class Entrance:
    """The way between a hub's people and one session; used on the session's thread.

    What has entered is part of the session's input: recorded, shown and replayed as everything
    else. People can ask for more than a session takes: the newest of each line and surface waits.

    Args:
        people: the hub, or what stands for it.
    """

    def __init__(self, people: People) -> None:
        self._people = people
        self._shown: dict[str, _Shown] = {}
        self._lines: _Items[Annotation] = _Items(MAX_LINES)
        self._placed: _Items[Placed] = _Items(MAX_PLACED)
        self._surfaces: _Items[LiveSurface] = _Items(MAX_SURFACES)
        self._sent: dict[str, tuple[LiveSurface, LiveSurface]] = {}
        """Surfaces by id, as they entered and as people sent them."""
        self._published: tuple[Mapping[str, LiveSurface], Mapping[str, LiveSurface]] | None = None
        """Surfaces of the newest state, and as people have got them."""

    def publish(self, state: SceneState) -> None:
        """Send a new state to everybody; returns at once."""
        if self._published is None or self._published[0] is not state.surfaces:
            self._published = (state.surfaces, self._as_sent(state.surfaces))
        self._people.publish(replace(state, surfaces=self._published[1]))

    def _as_sent(self, surfaces: Mapping[str, LiveSurface]) -> Mapping[str, LiveSurface]:
        """Return surfaces in which a hub finds its people's own: the very same values."""
        found = dict(surfaces)
        for key, (entered, sent) in self._sent.items():
            if surfaces.get(key) is entered:
                found[key] = sent
        return MappingProxyType(found)

    def enter(self, message: SessionMessage) -> SessionMessage:
        """Return a message with what people have sent since the one before."""
        arrived, live = self._people.take(), message.input
        t_ns = live.frame.t_ns
        events = [Event(t_ns, PEOPLE, kind, text) for kind, text in arrived.events]
        gone = self._see(arrived.avatars, t_ns)
        lines = self._enter_lines(arrived.lines, events, t_ns=t_ns)
        surfaces = self._enter_surfaces(arrived.surfaces, events, frame=live.frame)
        placed = self._enter_placed(arrived.placed, events, t_ns=t_ns)
        more = len(events) - MAX_EVENTS_A_FRAME
        if more > 0:
            del events[MAX_EVENTS_A_FRAME:]
            events.append(Event(t_ns, PEOPLE, "more", f"{more} more events at once"))
        return replace(
            message,
            input=replace(
                live,
                avatars=(*live.avatars, *(shown.avatar for shown in self._shown.values())),
                events=(*live.events, *events),
                surfaces=(*live.surfaces, *surfaces),
                annotations=(*live.annotations, *lines),
                gone=(*live.gone, *gone),
                placed=(*live.placed, *placed),
                voices=tuple(replace(voice, t_ns=t_ns) for voice in arrived.voices),
            ),
        )

    def _see(self, avatars: Iterable[Avatar], t_ns: int) -> tuple[AvatarGone, ...]:
        """Keep the newest avatars; return the ends of those that nobody has sent for a while."""
        for avatar in avatars:
            self._shown[avatar.user_id] = _Shown(_rounded(avatar), t_ns)
        old = [key for key, shown in self._shown.items() if t_ns - shown.t_ns >= HIDDEN_AFTER_NS]
        for key in old:
            del self._shown[key]
        return tuple(AvatarGone(key) for key in old)

    def _enter_lines(
        self, arrived: Iterable[Annotation], events: list[Event], *, t_ns: int
    ) -> list[Annotation]:
        for line in arrived:
            if not self._lines.wants(line.annotation_id, line, is_there=is_there(line)):
                why = f"line {line.annotation_id}: there are {MAX_LINES}; erase some"
                events.append(Event(t_ns, PEOPLE, "refused", why))
        return list(self._lines.taken(MAX_LINES_A_FRAME).values())

    def _enter_placed(
        self, arrived: Iterable[Placed], events: list[Event], *, t_ns: int
    ) -> list[Placed]:
        for thing in arrived:
            if not self._placed.wants(id_of(thing), thing, is_there=is_there(thing)):
                why = f"{id_of(thing)}: there are {MAX_PLACED} primitives and proposals"
                events.append(Event(t_ns, PEOPLE, "refused", f"{why}; erase some"))
        return list(self._placed.taken(MAX_PLACED_A_FRAME).values())

    def _enter_surfaces(
        self, arrived: Iterable[LiveSurface], events: list[Event], *, frame: Frame
    ) -> list[LiveSurface]:
        def refuse(surface: LiveSurface, why: object) -> None:
            text = f"surface {surface.surface_id}: {why}"
            events.append(Event(frame.t_ns, PEOPLE, "refused", text))

        for surface in arrived:
            if not self._surfaces.wants(surface.surface_id, surface, is_there=is_there(surface)):
                refuse(surface, f"there are {MAX_SURFACES}; remove one")
        entered: list[LiveSurface] = []
        for key, surface in self._surfaces.taken(MAX_SURFACES_A_FRAME).items():
            try:
                seen = self._as_seen(surface, frame)
            except ValueError as error:
                if key not in self._sent:  # else it stays as it was
                    self._surfaces.forget(key)
                refuse(surface, error)
                continue
            entered.append(seen)
            self._sent[key] = (seen, surface)
            if not is_there(surface):
                del self._sent[key]
        return entered

    def _as_seen(self, surface: LiveSurface, frame: Frame) -> LiveSurface:
        """Return a surface as fine as the camera sees it; one that is removed as it is.

        Raises:
            ValueError: it cannot be shown.
        """
        if not is_there(surface):
            return replace(surface, size_px=(0, 0), stream_id=frame.stream_id)
        if surface.carried_to is not None:
            quad_of(surface.carried_to)
        known, sent = self._sent.get(surface.surface_id, (None, None))
        corners = surface.corners_in_world
        if known and sent and np.array_equal(sent.corners_in_world, corners):
            # Carried, it is filmed as before: a picture of another size would begin anew.
            return replace(known, carried_to=surface.carried_to)
        made = live_surface(surface.surface_id, corners, frame)
        return replace(made, carried_to=surface.carried_to)


class _Items(Generic[T]):
    """Items of one kind: ids of those that are in the session, and the newest of those that wait.

    Args:
        limit: of those that are there.
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._there: set[str] = set()
        self._waiting: dict[str, tuple[T, bool]] = {}

    def wants(self, key: str, item: T, *, is_there: bool) -> bool:
        """Let an item wait, or its end (not `is_there`); return whether there is room for it."""
        if key not in self._there:
            if not is_there:
                self._waiting.pop(key, None)  # it came and went between two frames
                return True
            if len(self._there | self._waiting.keys()) >= self._limit and key not in self._waiting:
                return False
        self._waiting[key] = (item, is_there)
        return True

    def taken(self, count: int) -> dict[str, T]:
        """Remove and return so many of those that wait, the oldest first; they are there then."""
        found: dict[str, T] = {}
        for key in list(self._waiting)[:count]:
            found[key], is_there = self._waiting.pop(key)
            if is_there:
                self._there.add(key)
            else:
                self._there.discard(key)
        return found

    def forget(self, key: str) -> None:
        """Count an item as not there."""
        self._there.discard(key)


def _rounded(avatar: Avatar) -> Avatar:
    """Return an avatar whose hands and ray have as many digits as are kept."""
    return replace(
        avatar,
        hands=tuple(np.round(hand, DIGITS) for hand in avatar.hands),
        gaze=None if avatar.gaze is None else np.round(avatar.gaze, DIGITS),
        ray=None if avatar.ray is None else np.round(avatar.ray, DIGITS),
    )
