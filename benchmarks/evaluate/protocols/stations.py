"""The paper's protocol (section 5.1): an object at six positions, turned by 0, 90, 180 and 270°.

The object is moved from station to station in two seconds and rests there; the pose that counts is
the one at the end of each rest. The camera gives five pictures a second while it moves, and at rest
as many as the paper's method needs for its last pose and its second of gliding there.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from benchmarks.evaluate.filmed.asked import Asked
from benchmarks.evaluate.filmed.filming import FilmSet, Shot, standing
from benchmarks.evaluate.filmed.trial import Answer, Trial, performed
from scenes.opening import open_scene
from scenes.pose import Pose, interpolate
from scenes.samples import sample_room
from scenes.state import TrackedObject
from studio.evaluate.metrics import PoseError

YAWS_DEG = (0.0, 90.0, 180.0, 270.0)

MOVE_FRAMES, MOVE_NS = 10, 200_000_000
"""Pictures of the way from one station to the next, the one on arrival included; time between."""

REST_FRAMES, REST_NS = 3, 900_000_000
"""Pictures of the object at rest after it arrived, of which the last counts; time between."""

WARM_UP = 2
"""Pictures of the room as it was scanned, before anything moves."""


@dataclass(frozen=True, slots=True)
class Protocol:
    """One of the paper's two experiments in a built-in room.

    Attributes:
        scene: the room's name.
        object_id: what is moved.
        kind: of that object.
        positions_m: six (x, y) in the world, in the order they are visited.
        height_m: of the plane it stands on.
    """

    scene: str
    object_id: str
    kind: str
    positions_m: tuple[tuple[float, float], ...]
    height_m: float


ROOM = Protocol(
    scene="lab",
    object_id="chair-1",
    kind="chair",
    positions_m=(
        (0.15, 0.9), (-0.85, 0.9), (-1.85, 0.9), (-1.85, 1.9), (-0.85, 1.9), (0.15, 1.9),
    ),
    height_m=0.0,
)  # fmt: skip
"""1 m apart, 1.8 to 3.8 m from the camera, clear of everything that stands in the room."""

TABLE = Protocol(
    scene="desk",
    object_id="book-1",
    kind="book",
    positions_m=(
        (-0.38, 0.08), (-0.12, 0.08), (-0.12, 0.30), (-0.38, 0.30), (-0.38, 0.52), (-0.12, 0.52),
    ),
    height_m=0.74,
)  # fmt: skip
"""26 cm apart across and 22 cm apart along the line of sight, 0.6 to 1.0 m from the camera."""


@dataclass(frozen=True, slots=True)
class Station:
    """Place at which the object rests: position (from 1), turn, pose."""

    position: int
    turn_deg: float
    world_from_object: Pose


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """One station of one run, as one method saw it: everything it said, and the object's error."""

    seed: int
    station: Station
    track: TrackedObject
    answer: Answer
    error: PoseError


def stations(protocol: Protocol, scanned_world_from_object: Pose) -> tuple[Station, ...]:
    """All 24 in the order they are visited; yaw is counted from the pose in the scan."""
    visited = []
    for index, place in enumerate(protocol.positions_m):
        # Back and forth, so that the object is never turned by more than 90° at a time.
        turns = YAWS_DEG if index % 2 == 0 else YAWS_DEG[::-1]
        for turn_deg in turns:
            yaw = scanned_world_from_object.yaw() + np.radians(turn_deg)
            pose = Pose.from_yaw(yaw, np.array([*place, protocol.height_m]))
            visited.append(Station(index + 1, turn_deg, pose))
    return tuple(visited)


def shots(protocol: Protocol) -> tuple[tuple[Shot, ...], dict[int, Station]]:
    """The pictures of the whole experiment, and the station that ends at a picture's number."""
    room = sample_room(protocol.scene)
    standing_still = {item.object_id: item.world_from_object for item in room.objects}
    scanned = standing_still[protocol.object_id]
    path: list[Pose] = [scanned] * WARM_UP
    times_ns = [index * MOVE_NS for index in range(WARM_UP)]
    ends: dict[int, Station] = {}
    visited = stations(protocol, scanned)
    for before, station in pairwise([Station(0, 0.0, scanned), *visited]):
        path += carried(before.world_from_object, station.world_from_object, MOVE_FRAMES)
        path += [station.world_from_object] * REST_FRAMES
        for step_ns in (*[MOVE_NS] * MOVE_FRAMES, *[REST_NS] * REST_FRAMES):
            times_ns.append(times_ns[-1] + step_ns)
        ends[len(path) - 1] = station
    taken = tuple(
        Shot(t_ns, standing({**standing_still, protocol.object_id: pose}))
        for t_ns, pose in zip(times_ns, path, strict=True)
    )
    return taken, ends


def carried(world_from_start: Pose, world_from_end: Pose, steps: int) -> list[Pose]:
    """Poses on the way from one to the other, the last included: slow, quick, slow."""
    return [
        interpolate(world_from_start, world_from_end, eased(k / steps)) for k in range(1, steps + 1)
    ]


def eased(time: float) -> float:
    """Share of the way after a share of the time, both 0..1: half a wave of a cosine."""
    return 0.5 - 0.5 * math.cos(math.pi * time)


def samples(protocol: Protocol, asked: Asked) -> Mapping[str, Sequence[Sample]]:
    """Play the experiment once a seed; what every method said at each station's end."""
    taken, ends = shots(protocol)
    trial = Trial(open_scene(protocol.scene), asked.methods)
    found: dict[str, list[Sample]] = {name: [] for name in trial.methods}
    with FilmSet(sample_room(protocol.scene), cache=asked.cache) as film_set:
        for seed in asked.seeds:
            what = f"{protocol.object_id} in {protocol.scene}"
            for answers in performed(film_set, trial, taken, asked, seed=seed, what=what):
                for name, answer in answers.items():
                    station = ends.get(answer.seq)
                    if station is not None:
                        error = answer.error(protocol.object_id, kind=protocol.kind)
                        track = answer.tracks[protocol.object_id]
                        found[name].append(Sample(seed, station, track, answer, error))
    return found
