"""People in a study's session: without names, and with the room as a condition shows it."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from dataclasses import replace
from types import MappingProxyType

from devices.clock import Clock
from devices.hub.contract import Arrived
from scenes.state import Placed, Proposal, SceneState
from studio.live.people.entering import People
from studio.study.plan import Condition

MAX_WAITING = 1024
"""States and pictures that wait for their time: ten seconds of sixty states and of four surfaces
at ten pictures."""

MAX_EVENTS = 64
"""Events of the study that wait for a picture."""

OTHER = "other"
"""Begin of what those are called who are in the session and not its participant."""


class StudyPeople:
    """A hub's people between it and a session; used on the session's thread, `note` on any.

    What enters the session, and so its recording, has the participant's anonymous id in place of
    what people call themselves; events keep their kind and lose their words.

    Args:
        inner: the hub.
        condition: how people see the room.
        participant: anonymous id.
        person: returns the participant's id in the session; empty while that is unknown.
        clock: session time.
    """

    def __init__(
        self,
        inner: People,
        condition: Condition,
        *,
        participant: str,
        person: Callable[[], str],
        clock: Clock,
    ) -> None:
        self._inner, self._condition, self._clock = inner, condition, clock
        self._participant, self._person = participant, person
        self._waiting: deque[tuple[int, Callable[[], None]]] = deque(maxlen=MAX_WAITING)
        self._notes: deque[tuple[str, str]] = deque(maxlen=MAX_EVENTS)
        self._renamed: dict[str, tuple[Placed, Placed]] = {}
        """Proposals by id, as they enter and as the hub has given them."""
        self._others: dict[str, str] = {}
        self._last_ns: dict[str, int] = {}

    def note(self, kind: str, text: str) -> None:
        """Let an event enter the session with its next picture."""
        self._notes.append((kind, text))

    def called(self, user_id: str) -> str:
        """Return what somebody is called in the recording."""
        if user_id == self._person():
            return self._participant
        return self._others.setdefault(user_id, f"{OTHER}-{len(self._others) + 1}")

    def take(self) -> Arrived:
        """Return what people have sent since the last call, without names."""
        arrived = self._inner.take()
        notes: list[tuple[str, str]] = []
        while self._notes:
            notes.append(self._notes.popleft())
        return replace(
            arrived,
            avatars=tuple(replace(a, name=self.called(a.user_id)) for a in arrived.avatars),
            placed=tuple(self._without_name(item) for item in arrived.placed),
            events=(*((kind, kind) for kind, _ in arrived.events), *notes),
        )

    def publish(self, state: SceneState) -> None:
        """Send a new state to everybody as the condition has it; returns at once."""
        shown = replace(state, proposals=MappingProxyType(self._as_given(state)))
        if not self._condition.shows_objects:
            shown = replace(shown, objects=MappingProxyType({}))
        self._send("", lambda: self._inner.publish(shown))
        now_ns = self._clock.now_ns()
        while self._waiting and self._waiting[0][0] <= now_ns:
            self._waiting.popleft()[1]()

    def show(self, surface_id: str, jpeg: bytes) -> None:
        """Send what a live surface shows to everybody as the condition has it; returns at once."""
        self._send(surface_id, lambda: self._inner.show(surface_id, jpeg))

    def _send(self, channel: str, send: Callable[[], None]) -> None:
        """Let something wait for its time; what comes too soon after the last is left out."""
        now_ns = self._clock.now_ns()
        every_ns, delay_ns = (
            round(1e9 * s) for s in (self._condition.every_s, self._condition.delay_s)
        )
        last_ns = self._last_ns.get(channel)
        if last_ns is not None and now_ns - last_ns < every_ns:
            return
        self._last_ns[channel] = now_ns
        self._waiting.append((now_ns + delay_ns, send))

    def _without_name(self, item: Placed) -> Placed:
        if not isinstance(item, Proposal):
            return item
        renamed = replace(item, user_name=self.called(item.user_id) if item.object_id else "")
        self._renamed[item.proposal_id] = (renamed, item)
        if not item.object_id:
            del self._renamed[item.proposal_id]
        return renamed

    def _as_given(self, state: SceneState) -> dict[str, Proposal]:
        """Return proposals in which the hub finds its people's own: the very same values."""
        found = dict(state.proposals)
        for key, (entered, given) in self._renamed.items():
            if found.get(key) is entered and isinstance(given, Proposal):
                found[key] = given
        return found
