"""When people probably do what, and by which ways, from the simulator's own speeds."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import PhysicalRoom
from scenes.package import ScenePackage
from scenes.pose import wrap_angle
from sim.navigation.floor import FloorMap
from sim.navigation.paths import has_way, walking_path
from sim.people.acts.carrying import BEFORE_GOAL_M, LIFT_M
from sim.people.acts.handing_over import BETWEEN_M, PATIENCE_S
from sim.people.acts.pushing import PUSH_TIME_LIMIT_S, REACH_M
from sim.people.acts.sitting import SITTING_DOWN_S
from sim.people.acts.walking import ACCELERATION_M_S2, TURN_RATE_RAD_S
from sim.people.drawn_line import length_m
from sim.people.person import CAMERA_MARGIN_M, COMFORTABLE_REACH_M, ON_FLOOR_M
from sim.people.posture import SEAT_BACK_M, WALKING_SPEED_M_S
from sim.scenarios.actions import (
    Action,
    Carry,
    Draw,
    HandOver,
    Hide,
    Point,
    Push,
    Put,
    Receive,
    Sit,
    Stand,
    Turn,
    Walk,
)
from sim.scenarios.scenario import Scenario

Place = NDArray[np.float64]

HAND_M_S = 0.7
"""How fast hands reach, as `sim.people.acts.reaching.reach` has it, metres a second."""
TAKE_S = 0.6 / HAND_M_S + 2 * LIFT_M / HAND_M_S + 0.2
"""A hand to an object, down and up again, seconds."""
RELEASE_S = LIFT_M / 0.35 + LIFT_M / HAND_M_S + 0.55
"""Down, let go, hand up, stand, seconds."""
HANDS_S = 0.6
"""Both hands to an object's sides, seconds."""
AFTER_S = 0.25
"""Pause of a person after a push or a turn, seconds."""


GIVE_S = 1.0
"""From hand to hand, seconds."""


@dataclass(frozen=True, slots=True, eq=False)
class Item:
    """An object on the floor plan: id, box (x, y, z) and its place and yaw at the start."""

    object_id: str
    box_m: tuple[float, float, float]
    place: Place
    yaw: float


@dataclass(frozen=True, slots=True, eq=False)
class RoomPlan:
    """Parts of a room that the floor plan draws.

    Attributes:
        low: (x, y) of the lowest corner, metres.
        high: (x, y) of the highest.
        items: movable objects.
        camera: (x, y) of the camera.
        floor: where people walk; None where that is not known: ways are straight then.
    """

    low: tuple[float, float]
    high: tuple[float, float]
    items: tuple[Item, ...]
    camera: Place
    floor: FloorMap | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Block:
    """One action on time.

    Attributes:
        person_id: whose.
        index: of the action.
        action: what is done.
        start_s: from the start of the scenario.
        end_s: when it is done.
        way: (N, 2) where the person walks meanwhile.
    """

    person_id: str
    index: int
    action: Action
    start_s: float
    end_s: float
    way: Place


@dataclass(slots=True, eq=False)
class _Walker:
    place: Place
    yaw: float
    time_s: float = 0.0
    start_s: float = 0.0
    index: int = 0
    holds: str = ""
    way: list[Place] = field(default_factory=list[Place])


def room_plan(scene: ScenePackage, room: PhysicalRoom | None) -> RoomPlan:
    """The plan of a scene; with what physically exists, also where people can walk."""
    low, high = scene.footprint_m.tolist()
    source = scene.objects if room is None else room.objects
    items = tuple(
        Item(o.object_id, o.box_m, o.world_from_object.translation, o.world_from_object.yaw())
        for o in source
    )
    camera = scene.world_from_rig.translation[:2]
    floor = None if room is None else FloorMap(room)
    return RoomPlan((low[0], low[1]), (high[0], high[1]), items, camera, floor)


def planned(scenario: Scenario, plan: RoomPlan) -> tuple[Block, ...]:
    """Estimated blocks of everybody's actions, in order of time."""
    return _Planner(scenario, plan).blocks()


class _Planner:
    def __init__(self, scenario: Scenario, plan: RoomPlan) -> None:
        self._plan = plan
        self._people = {p.person_id: p for p in scenario.people}
        self._places = {item.object_id: item.place.copy() for item in plan.items}
        self._boxes: Mapping[str, Item] = {item.object_id: item for item in plan.items}
        position = scenario.camera.position
        self._camera = plan.camera if position is None else np.array(position[:2])
        self._walkers = {
            p.person_id: _Walker(np.array(p.start), math.radians(p.facing_deg))
            for p in scenario.people
        }
        self._waiting: dict[tuple[str, str], tuple[str, type[Action]]] = {}
        self._found: list[Block] = []

    def blocks(self) -> tuple[Block, ...]:
        while True:
            waiting = {key: name for key, (name, _) in self._waiting.items()}
            todo = [
                (walker.time_s, name)
                for name, walker in self._walkers.items()
                if walker.index < len(self._people[name].actions)
            ]
            active = [item for item in todo if item[1] not in waiting.values()]
            if active:
                self._begin(min(active)[1])
            elif waiting:  # whoever they wait for does not come
                key, name = min(waiting.items(), key=lambda item: item[1])
                del self._waiting[key]
                self._walkers[name].time_s += PATIENCE_S
                self._finish(name)
            else:
                return tuple(sorted(self._found, key=lambda block: block.start_s))

    def _begin(self, person_id: str) -> None:
        walker = self._walkers[person_id]
        walker.start_s, walker.way = walker.time_s, [walker.place.copy()]
        action = self._people[person_id].actions[walker.index]
        if isinstance(action, HandOver | Receive):
            self._give(person_id, walker, action)
        else:
            self._do(walker, action)
            self._finish(person_id)

    def _finish(self, person_id: str) -> None:
        walker = self._walkers[person_id]
        action = self._people[person_id].actions[walker.index]
        times = (walker.start_s, walker.time_s)
        self._found.append(Block(person_id, walker.index, action, *times, np.array(walker.way)))
        walker.index += 1

    def _do(self, walker: _Walker, action: Action) -> None:
        match action:
            case Walk():
                self._walk(walker, np.array(action.to))
                if action.face_deg is not None:
                    self._face(walker, math.radians(action.face_deg))
            case Stand():
                walker.time_s += action.seconds
            case Push() | Turn():
                self._push(walker, action)
            case Carry() | Put():
                self._carry(walker, action.object, np.array(action.to))
            case Hide():
                self._walk(walker, self._hiding_place(action.object))
                walker.time_s += action.seconds
            case Sit():
                seat = self._place(action.object) if action.to is None else np.array(action.to)
                self._walk(walker, self._short_of(walker.place, seat, SEAT_BACK_M))
                walker.time_s += 2 * SITTING_DOWN_S + action.seconds
            case Point():
                at = self._place(action.object) if action.at is None else np.array(action.at[:2])
                self._face(walker, _bearing(walker.place, at))
                walker.time_s += action.seconds
            case Draw():
                self._face(walker, _bearing(walker.place, np.array(action.points[0][:2])))
                walker.time_s += 0.5 + length_m(np.array(action.points)) / action.speed_m_s

    def _push(self, walker: _Walker, action: Push | Turn) -> None:
        at = self._place(action.object)
        half = 0.5 * min(self._boxes[action.object].box_m[:2]) if self._has(action.object) else 0.2
        goal = 2 * at - walker.place if isinstance(action, Turn) else np.array(action.to)
        heading = _bearing(at, goal)
        ahead = np.array([math.cos(heading), math.sin(heading)])
        self._walk(walker, at - (half + REACH_M) * ahead)
        self._face(walker, heading)
        walker.time_s += HANDS_S + AFTER_S
        if isinstance(action, Turn):
            walker.time_s += math.radians(abs(action.by_deg)) / 1.1
            return
        distance, speed = float(np.linalg.norm(goal - at)), action.speed_m_s
        drive = distance / speed + 0.5 * speed / 0.8 + 0.5 * speed / 0.6
        walker.time_s += min(drive, PUSH_TIME_LIMIT_S)
        self._move(action.object, goal)
        walker.place = goal - (half + REACH_M) * ahead
        walker.way.append(walker.place)

    def _carry(self, walker: _Walker, object_id: str, goal: Place) -> None:
        self._take(walker, object_id)
        at = self._place(object_id)
        stand = self._short_of(walker.place, goal, BEFORE_GOAL_M)
        if float(np.linalg.norm(goal - at)) > COMFORTABLE_REACH_M:
            self._walk(walker, stand)
            self._face(walker, _bearing(walker.place, goal))
            walker.time_s += 0.4
        else:
            walker.time_s += float(np.linalg.norm(goal - at)) / 0.6
        walker.time_s += RELEASE_S
        walker.holds = ""
        self._move(object_id, goal)

    def _take(self, walker: _Walker, object_id: str) -> None:
        if walker.holds == object_id:
            return
        at = self._place(object_id)
        self._walk(walker, self._short_of(walker.place, at, 0.5 * COMFORTABLE_REACH_M))
        self._face(walker, _bearing(walker.place, at))
        walker.time_s += TAKE_S
        walker.holds = object_id

    def _give(self, person_id: str, walker: _Walker, action: HandOver | Receive) -> None:
        """Let the person who comes first wait: both end when the later one is there."""
        key = (action.object, action.to if isinstance(action, HandOver) else person_id)
        if isinstance(action, HandOver):
            self._take(walker, action.object)
            other = self._walkers.get(action.to)
            if other is not None:
                self._walk(walker, self._short_of(walker.place, other.place, BETWEEN_M))
            walker.holds = ""
        first = self._waiting.pop(key, None)
        if first is None or first[1] is type(action):
            self._waiting[key] = (person_id, type(action))
            return
        both = (first[0], person_id)
        meeting = max(self._walkers[name].time_s for name in both) + GIVE_S
        for name in both:
            self._walkers[name].time_s = meeting
            self._finish(name)
        taker = self._walkers[key[1]]
        taker.holds = action.object
        self._move(action.object, taker.place)

    def _walk(self, walker: _Walker, goal: Place) -> None:
        before, path = walker.place, self._path(walker.place, goal)
        for corner in path:
            step = float(np.linalg.norm(corner - before))
            if step > 1e-3:
                turn = abs(wrap_angle(_bearing(before, corner) - walker.yaw))
                walker.time_s += step / WALKING_SPEED_M_S + 0.8 * turn / TURN_RATE_RAD_S
                walker.yaw = _bearing(before, corner)
            before = corner
        if float(np.linalg.norm(goal - walker.place)) > 0.05:
            walker.time_s += WALKING_SPEED_M_S / ACCELERATION_M_S2
        walker.place = goal
        walker.way.extend(path)

    def _face(self, walker: _Walker, yaw: float) -> None:
        walker.time_s += abs(wrap_angle(yaw - walker.yaw)) / TURN_RATE_RAD_S
        walker.yaw = yaw

    def _path(self, start: Place, goal: Place) -> list[Place]:
        floor = self._plan.floor
        if floor is None:
            return [goal]
        around = [(self._camera, CAMERA_MARGIN_M)]
        for item in self._plan.items:
            if item.place[2] < ON_FLOOR_M:
                around.append((self._places[item.object_id][:2], 0.5 * max(item.box_m[:2])))
        free = floor.around(around)
        return walking_path(free if has_way(free, start, goal) else floor.bare, start, goal)

    def _short_of(self, start: Place, goal: Place, by_m: float) -> Place:
        """Return the place on free floor of a person who comes from `start` and works at `goal`."""
        away = start - goal
        distance = float(np.linalg.norm(away))
        wanted = goal if distance < 1e-6 else goal + away / distance * min(by_m, distance)
        floor = self._plan.floor
        if floor is None:
            return wanted
        bare = floor.bare.reachable(start)
        return wanted if bare.free[bare.cell(wanted)] else bare.nearest_free(wanted)

    def _hiding_place(self, object_id: str) -> Place:
        away = self._place(object_id) - self._camera
        distance = max(float(np.linalg.norm(away)), 1e-6)
        return self._camera + away / distance * min(0.95, 0.5 * distance)

    def _place(self, object_id: str | None) -> Place:
        found = self._places.get(object_id or "")
        return np.zeros(2) if found is None else found[:2].copy()

    def _has(self, object_id: str) -> bool:
        return object_id in self._boxes

    def _move(self, object_id: str, goal: Place) -> None:
        if object_id in self._places:
            self._places[object_id][:2] = goal


def _bearing(start: Place, goal: Place) -> float:
    way = goal - start
    return math.atan2(float(way[1]), float(way[0]))
