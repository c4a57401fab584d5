"""Stages a random room: stills with other arrangements, and a short sequence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from benchmarks.evaluate.random_rooms.acting import Act, Stage, carried, pushed
from benchmarks.random_rooms.placing import rearranged
from benchmarks.random_rooms.room import RandomRoom
from scenes.pose import Pose
from sim.bodies import Body, Placement
from sim.people.figure import person_body

STILLS = 6
"""Arrangements of a room, each a session of its own."""

MOVED_SHARE = 0.5
"""Share of the objects that an arrangement moves."""

STILL_FRAMES = 8
"""Pictures of a sequence before anybody moves."""

SECOND_ACT_FRAME = 14
"""When the second person begins."""

END_FRAMES = 6
"""Pictures after everything stands again."""

FRAME_NS = 100_000_000
"""Time between the pictures of a sequence."""

COLD, SEQUENCE = "cold", "sequence"
"""Names of the sessions."""


@dataclass(frozen=True, slots=True, eq=False)
class Moment:
    """Arrangement of the room in one picture.

    Attributes:
        name: of the picture.
        t_ns: capture time.
        objects: true poses by object id.
        people: limbs by person.
    """

    name: str
    t_ns: int
    objects: Mapping[str, Pose]
    people: Mapping[str, Placement]


@dataclass(frozen=True, slots=True, eq=False)
class Staged:
    """Everything that is filmed in a room.

    Attributes:
        stills: each a session of its own.
        sequence: the pictures of one session.
        people: bodies that may be in it.
        moving: objects that move in the sequence.
    """

    stills: tuple[Moment, ...]
    sequence: tuple[Moment, ...]
    people: tuple[Body, ...]
    moving: tuple[str, ...]


def staged(room: RandomRoom) -> Staged:
    """Return what the room's seed stages: six stills, and up to two people who move something."""
    of_stills, of_acts, of_people = np.random.default_rng([room.seed, 2]).spawn(3)
    scanned = {item.object_id: item.world_from_object for item in room.scanned.objects}
    stills = tuple(
        Moment(
            str(k),
            0,
            rearranged(room.movables, scanned, room.ground, of_stills, share=MOVED_SHARE),
            {},
        )
        for k in range(STILLS)
    )
    acts = _acts(room, scanned, of_acts)
    people = tuple(person_body(f"person-{k + 1}", of_people) for k in range(len(acts)))
    return Staged(stills, _sequence(scanned, acts), people, tuple(act.object_id for act in acts))


def _acts(
    room: RandomRoom, scanned: Mapping[str, Pose], rng: np.random.Generator
) -> tuple[Act, ...]:
    """Somebody who carries, and somebody who pushes something else where there is room for both."""
    acts: list[Act] = []
    first = carried(Stage(room.movables, scanned, room.ground), rng)
    poses, ways = dict(scanned), ()
    if first is not None:
        acts.append(first)
        poses[first.object_id] = first.poses[-1]
        ways = tuple(limbs[0].translation[:2] for limbs in first.people[::3])
    movables = {
        name: item for name, item in room.movables.items() if not acts or name != acts[0].object_id
    }
    second = pushed(Stage(movables, poses, room.ground, ways), rng)
    if second is not None and _apart(acts, second):
        acts.append(second)
    return tuple(acts)


def _apart(acts: list[Act], second: Act) -> bool:
    """Whether what is pushed stays clear of the way of what is carried."""
    for act in acts:
        for pose in act.poses[::2]:
            for other in second.poses[::2]:
                gap = pose.translation[:2] - other.translation[:2]
                if float(np.linalg.norm(gap)) < 0.6:
                    return False
    return True


def _sequence(scanned: Mapping[str, Pose], acts: tuple[Act, ...]) -> tuple[Moment, ...]:
    begins = [STILL_FRAMES + k * SECOND_ACT_FRAME for k in range(len(acts))]
    ends = [begin + len(act.poses) for begin, act in zip(begins, acts, strict=True)]
    moments: list[Moment] = []
    for frame in range(max([*ends, STILL_FRAMES]) + END_FRAMES):
        objects, people = dict(scanned), dict[str, Placement]()
        for k, (begin, act) in enumerate(zip(begins, acts, strict=True)):
            step = min(max(frame - begin, 0), len(act.poses) - 1)
            if frame >= begin:
                objects[act.object_id] = act.poses[step]
            people[f"person-{k + 1}"] = Placement(act.people[step], 0.0)
        moments.append(Moment(f"{frame:03d}", frame * FRAME_NS, objects, people))
    return tuple(moments)
