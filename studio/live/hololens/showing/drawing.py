"""The session on the headset's display, at most twenty times a second, on a thread of its own."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Protocol

import numpy as np

from devices.clock import Clock
from devices.hololens.display_list import DisplayList, Item
from devices.hub.inbox import Avatars
from devices.hub.roles import Person
from scenes.pose import Pose
from scenes.state import Avatar, ObjectModel, SceneState, SharedPrimitive
from scenes.workers.task import Task
from studio.evaluate.scores import SYMMETRY_OF_KIND
from studio.live.hololens.showing.display import Seen, items_of, steadied
from studio.live.hololens.timing import Durations
from studio.view.shared_things import met_proposals

UPDATE_S = 0.05
"""Time between two lists, seconds: the display's 20 a second, which its program keeps up with."""


PASSED_NS = 4 * 10**9
"""Time for which a name stands over a shape that has passed to somebody else: as on every page."""


class Bodies(Protocol):
    """Part of a hub by which people are seen sooner than with the next camera picture."""

    def bodies(self) -> list[tuple[Person, bytes]]:
        """Return its own people who show a body, and the newest of each."""
        ...


class Drawing:
    """Draws what there is; `publish` may be called from any thread.

    Args:
        draw: takes a whole list; never waits.
        device_from_world: returns the origin that is shown; None before it is known.
        eye: returns (3,) the wearer's head in the headset's world; None while unknown.
        hub: returns the hub of the moment; None while nobody can join.
        in_hand: returns the shape in the wearer's hand at a session time, as it is there, if any.
        models: objects of the scan by id.
        wearer: id of the wearer.
        clock: session time.
    """

    def __init__(
        self,
        draw: Callable[[DisplayList], None],
        *,
        device_from_world: Callable[[], Pose | None],
        eye: Callable[[], np.ndarray | None],
        hub: Callable[[], Bodies | None],
        in_hand: Callable[[int], SharedPrimitive | None],
        models: Mapping[str, ObjectModel],
        wearer: str,
        clock: Clock,
    ) -> None:
        self._draw, self._device_from_world, self._eye = draw, device_from_world, eye
        self._hub, self._models, self._wearer, self._clock = hub, models, wearer, clock
        self._in_hand = in_hand
        self._owners: Mapping[str, tuple[str, int]] = {}
        """Owners of shapes, and until when their names are shown."""
        self._avatars = Avatars()
        self._state = SceneState()
        self._shown: Mapping[str, Item] = {}
        self.durations = Durations()
        """Milliseconds that a list took to be made."""
        self._task = Task("headset display", self._run)

    def start(self) -> None:
        """Begin to draw."""
        self._task.start()

    def close(self) -> None:
        """Draw no more."""
        self._task.cancel()
        self._task.join(1.0)

    def publish(self, state: SceneState) -> None:
        """Draw a new state from the next list on; returns at once."""
        self._state = state

    @property
    def count(self) -> int:
        """Items that are to be seen."""
        return len(self._shown)

    def items(self) -> tuple[Item, ...]:
        """Return all that is to be seen."""
        return tuple(self._shown.values())

    def once(self) -> bool:
        """Draw what there is; return whether anything has changed."""
        device_from_world = self._device_from_world()
        if device_from_world is None:
            return False
        begun_ns = self._clock.now_ns()
        state = self._with_hand(self._state, begun_ns)
        self._owners = owners_after(self._owners, state.primitives, now_ns=begun_ns)
        passed = frozenset(key for key, (_, until) in self._owners.items() if begun_ns < until)
        poses = {key: track.world_from_object for key, track in state.objects.items()}
        met = met_proposals(
            state.proposals.values(),
            poses,
            models=self._models,
            symmetry_of_kind=SYMMETRY_OF_KIND,
        )
        seen = Seen(device_from_world, self._models, met, self._wearer, self._eye(), passed)
        items = steadied(self._shown, items_of(state, self._people(state), seen=seen))
        is_new = items.keys() != self._shown.keys() or any(
            self._shown[name] is not item for name, item in items.items()
        )
        if is_new:
            self._shown = items
            self._draw(items)
        self.durations.add((self._clock.now_ns() - begun_ns) / 1e6)
        return is_new

    def _with_hand(self, state: SceneState, now_ns: int) -> SceneState:
        """Return a state whose shape in the wearer's hand is where the hand has it now."""
        held = self._in_hand(now_ns)
        known = None if held is None else state.primitives.get(held.primitive_id)
        if held is None or known is None or known.user_id != self._wearer:
            return state
        return replace(state, primitives={**state.primitives, held.primitive_id: held})

    def _people(self, state: SceneState) -> list[Avatar]:
        """Return everybody, those of the hub as they are this moment."""
        hub = self._hub()
        found = dict(state.avatars)
        if hub is not None:
            found |= {avatar.user_id: avatar for avatar in self._avatars.of(hub.bodies())}
        return list(found.values())

    def _run(self, task: Task[None]) -> None:
        while not task.pause(UPDATE_S):
            self.once()


def owners_after(
    owners: Mapping[str, tuple[str, int]],
    primitives: Mapping[str, SharedPrimitive],
    *,
    now_ns: int,
) -> dict[str, tuple[str, int]]:
    """Return owners of shapes, and until when their names are shown: for a while after a change.

    Args:
        owners: before.
        primitives: shapes that are there now, by id.
        now_ns: session time.
    """
    found: dict[str, tuple[str, int]] = {}
    for key, primitive in primitives.items():
        owner, until_ns = owners.get(key, (primitive.user_id, 0))
        has_passed = owner != primitive.user_id
        found[key] = primitive.user_id, now_ns + PASSED_NS if has_passed else until_ns
    return found
