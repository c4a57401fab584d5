"""Whether the people of a scenario can do in a room what it says, as far as that is known."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from scenes.mesh import PhysicalRoom
from sim.navigation.floor import FloorMap, FreeFloor
from sim.physics.moving.people import HAND_FORCE_LIMIT_N
from sim.scenarios.actions import (
    Action,
    Carry,
    HandOver,
    PersonSettings,
    Place,
    Point,
    Push,
    Put,
    Receive,
    Sit,
    Walk,
    name_of,
)
from sim.tables import ScenarioError

HEAVIEST_KG = HAND_FORCE_LIMIT_N / 9.81 - 1.0
"""Mass that one hand lifts, kg, with a kilogram's force left to move it."""
ARM_M = 1.2
"""Distance from free floor within which a hand gets to something, leaning forward."""
NEAR_M = 0.6
"""Distance from free floor within which a place counts as reached: close to furniture."""


@dataclass(frozen=True, slots=True)
class Checks:
    """How a scenario's own checks complain: of a key and a place, or of a key and an object."""

    place: Callable[[str, Sequence[float]], None]
    object: Callable[[str, str], None]
    where: str


def check_people(people: Sequence[PersonSettings], room: PhysicalRoom, checks: Checks) -> None:
    """Check every action of everybody.

    Raises:
        ScenarioError: an object or a person isn't there, a place is outside the room, in a wall or
            in furniture, nobody gets there, or an object is too heavy.
    """
    if not people:
        return
    floor = FloorMap(room)
    moved: set[str] = set()
    for i, person in enumerate(people):
        checks.place(f"people[{i}].start", person.start)
        _check_standing(f"people[{i}].start", person.start, floor, checks)
        reachable = floor.bare.reachable(np.array(person.start))
        for k, action in enumerate(person.actions):
            key = f"people[{i}].actions[{k}]"
            _check_names(key, action, people, checks)
            _check_places(key, action, checks)
            _check_weight(key, action, room, checks)
            _check_ways(key, action, floor, reachable, checks)
            item = getattr(action, "object", None)
            if item is not None and item not in moved and not isinstance(action, Point | Receive):
                _check_reach(f"{key}.object", item, room, reachable, checks)
            if isinstance(action, Push | Carry | Put | HandOver):
                moved.add(action.object)


def _check_names(
    key: str, action: Action, people: Sequence[PersonSettings], checks: Checks
) -> None:
    item = getattr(action, "object", None)
    if item is not None:
        checks.object(f"{key}.object", item)
    if isinstance(action, HandOver):
        takers = [
            p.person_id
            for p in people
            if any(isinstance(a, Receive) and a.object == action.object for a in p.actions)
        ]
        if action.to not in takers:
            raise ScenarioError(
                f"{checks.where}: {key}.to = {action.to!r}, wanted a person with an action "
                f'{{ do = "receive", object = "{action.object}" }}'
            )


def _check_places(key: str, action: Action, checks: Checks) -> None:
    for name, place in _places(action):
        checks.place(f"{key}.{name}", place)


def _places(action: Action) -> Iterator[tuple[str, Sequence[float]]]:
    if isinstance(action, Walk | Push | Carry | Put):
        yield "to", action.to
    if isinstance(action, Sit) and action.to is not None:
        yield "to", action.to


def _check_weight(key: str, action: Action, room: PhysicalRoom, checks: Checks) -> None:
    if isinstance(action, Carry | Put | HandOver):
        mass_kg = room.object_by_id(action.object).mass_kg
        if mass_kg > HEAVIEST_KG:
            raise ScenarioError(
                f"{checks.where}: {key}.object = {action.object!r} weighs {mass_kg:.1f} kg, "
                f"limit of {name_of(action)} {HEAVIEST_KG:.1f} kg; push it"
            )


def _check_ways(
    key: str, action: Action, floor: FloorMap, reachable: FreeFloor, checks: Checks
) -> None:
    """That places on the floor are free and can be walked to."""
    if isinstance(action, Walk | Push):
        _check_standing(f"{key}.to", action.to, floor, checks)
    if isinstance(action, Walk):
        limit = NEAR_M
    elif isinstance(action, Carry | Put | Sit):
        limit = ARM_M
    else:
        return
    if action.to is not None and _distance(action.to, reachable) > limit:
        raise ScenarioError(
            f"{checks.where}: {key}.to = {list(action.to)} cannot be reached: walls or furniture "
            f"keep {name_of(action)} more than {limit:g} m away"
        )


def _check_standing(key: str, place: Place, floor: FloorMap, checks: Checks) -> None:
    if floor.is_solid(np.array(place)):
        raise ScenarioError(
            f"{checks.where}: {key} = {list(place)} lies in a wall or in furniture, wanted a "
            "place on the free floor"
        )


def _check_reach(
    key: str, object_id: str, room: PhysicalRoom, reachable: FreeFloor, checks: Checks
) -> None:
    x, y, _ = room.object_by_id(object_id).world_from_object.translation
    away = _distance((float(x), float(y)), reachable)
    if away > ARM_M:
        raise ScenarioError(
            f"{checks.where}: {key} = {object_id!r} cannot be reached: the nearest free floor is "
            f"{away:.1f} m from it, limit {ARM_M:g} m"
        )


def _distance(place: Place, floor: FreeFloor) -> float:
    """Metres from a place to the nearest free floor; infinite if there is none."""
    if not floor.free.any():
        return float("inf")
    return float(np.linalg.norm(floor.nearest_free(np.array(place)) - np.array(place)))
