"""A small study, and two small rooms in which people do its tasks, with physics."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np
import pytest

from scenes.frames import look_at
from scenes.mesh import BoxPart, PhysicalRoom
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.samples.movables import chair, stool
from scenes.samples.pieces import piece
from scenes.splats import SplatCloud
from scenes.state import ObjectModel, TrackedObject, TrackState
from sim.people.actors import TICK_NS, Actor, introduce
from sim.physics.any_room import physics_of
from sim.scenarios.scenario import parse_scenario
from studio.study.folder import StudyFolder
from studio.study.plan import STUDY_FILE
from tracking.output import TrackOutput

TABLE_M = 0.74
HZ = 20
PACE = 2.0
"""How many times as fast as people act it the tracker says that it was done."""
NOISE_M, NOISE_RAD = 0.002, 0.003

LAYOUT = """
room = "lab"
duration_s = 11.0
[[people]]
id = "local"
start = [0.9, 0.3]
actions = [
  { do = "carry", object = "chair-2", to = [0.5, 1.0], turn_deg = 40 },
  { do = "carry", object = "stool-1", to = [-0.4, 0.6] },
]
[[remote]]
id = "guide"
path = [[-1.2, -1.2, 1.6], [-0.6, -1.4, 1.6]]
points_at = ["chair-2", "stool-1"]
proposes = [{ object = "stool-1", at = [-0.4, 0.6], from_s = 3.0 }]
draws = [{ points = [[0.2, 1.2, 0.01], [0.8, 1.2, 0.01]], from_s = 3.0, seconds = 1.0 }]
"""
TANGRAM = """
room = "tangram"
duration_s = 9.0
[[people]]
id = "pupil"
start = [0.05, 1.1]
facing_deg = -90
actions = [
  { do = "carry", object = "small-1", to = [0.19, 0.174], turn_deg = 35 },
  { do = "carry", object = "square-1", to = [-0.14, 0.404], turn_deg = 25 },
]
[[remote]]
id = "teacher"
path = [[-0.55, -0.2, 1.45], [0.1, -0.25, 1.5]]
points_at = ["small-1", "square-1"]
aim_m = 0.03
"""
STUDY = """
title = "In small"
seed = 3
participants = 4
[consent]
contact = "us"
text = ["You take part of your own will."]
[[conditions]]
id = "live"
[[conditions]]
id = "late"
delay_s = 0.3
[[tasks]]
id = "layout"
prompt = "Set up the room."
scene = "lab"
scenario = "{layout}"
limit_s = 30
[tasks.goal]
kind = "layout"
within_m = 0.1
within_deg = 15
hold_s = 1
targets = [
  {{ object = "chair-2", at = [0.5, 1.0], yaw_deg = -35 }},
  {{ object = "stool-1", at = [-0.4, 0.6], symmetry = 0 }},
]
[[tasks]]
id = "tangram"
prompt = "Lay the fish."
scene = "tangram"
scenario = "{tangram}"
limit_s = 30
[tasks.goal]
kind = "figure"
within_m = 0.015
within_deg = 8
hold_s = 1
targets = [
  {{ object = "large-1", at = [0.016, 0.3], yaw_deg = 90, kind = "large" }},
  {{ object = "large-2", at = [0.184, 0.3], yaw_deg = -90, kind = "large" }},
  {{ object = "small-1", at = [0.19, 0.174], yaw_deg = 0 }},
  {{ object = "square-1", at = [-0.14, 0.404], yaw_deg = 45, symmetry = 4 }},
]
[[ask]]
questionnaire = "about"
when = "first"
[[ask]]
questionnaire = "tlx"
when = "task"
[[ask]]
questionnaire = "sus"
when = "condition"
[[ask]]
questionnaire = "paper-presence"
when = "end"
[[ask]]
questionnaire = "paper-feedback"
when = "end"
"""


def _part(low, high):
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    half = 0.5 * (high - low)
    return BoxPart(Pose(np.eye(3), 0.5 * (low + high)), tuple(half.tolist()))


def _room(name, objects, solids=()):
    walls = [
        _part((-2.2, -2.2, 0), (-2.0, 2.2, 2.5)),
        _part((2.0, -2.2, 0), (2.2, 2.2, 2.5)),
        _part((-2.2, -2.2, 0), (2.2, -2.0, 2.5)),
        _part((-2.2, 2.0, 0), (2.2, 2.2, 2.5)),
    ]
    eye = np.array([0.0, -0.5, 1.2])
    return PhysicalRoom(
        name=name,
        static=(),
        objects=objects,
        solids=(*walls, *solids),
        light_direction=np.array([0.0, 0.0, 1.0]),
        world_from_rig=look_at(eye, eye + np.array([0.0, 1.0, 0.0])),
        footprint_m=np.array([[-2.0, -2.0], [2.0, 2.0]]),
    )


def lab_room():
    return _room(
        "lab",
        (
            chair("chair-2", Pose.from_yaw(math.radians(-75), (1.1, 0.9, 0.0))),
            stool("stool-1", Pose.from_yaw(0.3, (0.2, 1.4, 0.0))),
        ),
    )


def tangram_room():
    laid = {
        "large-1": (90, 0.016, 0.3),
        "large-2": (-90, 0.184, 0.3),
        "small-1": (-35, 0.13, 0.63),
        "square-1": (20, -0.22, 0.63),
    }
    objects = tuple(
        piece(name, Pose.from_yaw(math.radians(deg), (x, y, TABLE_M)))
        for name, (deg, x, y) in laid.items()
    )
    return _room("tangram", objects, (_part((-0.8, -0.15, 0.0), (0.8, 0.75, TABLE_M)),))


def package(room):
    """The room as a scene, its splats a few."""
    rng = np.random.default_rng(5)

    def cloud(low, high, count):
        return SplatCloud(
            rng.uniform(low, high, (count, 3)).astype(np.float32),
            np.full((count, 3), 0.05, np.float32),
            np.tile(np.array([1, 0, 0, 0], np.float32), (count, 1)),
            np.full(count, 0.9, np.float32),
            rng.normal(0, 0.8, (count, 1, 3)).astype(np.float32),
        )

    objects = tuple(
        ObjectModel(
            item.object_id,
            item.object_id,
            item.kind,
            cloud((-0.1, -0.1, 0), (0.1, 0.1, 0.1), 30),
            item.box_m,
            0.0,
            item.world_from_object,
        )
        for item in room.objects
    )
    floor = cloud((-2, -2, -0.02), (2, 2, 0.02), 300)
    return ScenePackage(room.name, floor, objects, (), room.world_from_rig, room.footprint_m, None)


def acted(room, text):
    """Poses of all objects while a scenario's people act, `HZ` a second."""
    scenario = parse_scenario(text, source="a test")
    actors = [
        Actor(
            person.person_id,
            room,
            start=person.start,
            yaw=math.radians(person.facing_deg),
            actions=person.actions,
            camera_xy=room.world_from_rig.translation[:2],
        )
        for person in scenario.people
    ]
    introduce(actors)
    world = physics_of(room, {actor.person_id: actor.target() for actor in actors})
    rows = []
    for frame in range(round(scenario.duration_s * HZ)):
        while world.t_ns < frame * 1e9 / HZ:
            for actor in actors:
                actor.tick(world)
            world.move_people({actor.person_id: actor.target() for actor in actors})
            world.step(TICK_NS)
        rows.append(world.object_poses())
    return rows


class ActedTracker:
    """Follows what is acted once it has begun, off by a tracker's noise."""

    def __init__(self, rows, begun):
        self._rows, self._begun, self._begun_ns = rows, begun, None
        self._rng = np.random.default_rng(0)

    def start(self):
        return 0

    def step(self, state, frame, now_ns):
        if self._begun_ns is None and self._begun.is_set():
            self._begun_ns = frame.t_ns
        elapsed_s = 0.0 if self._begun_ns is None else (frame.t_ns - self._begun_ns) / 1e9
        at = min(int(PACE * elapsed_s * HZ), len(self._rows) - 1)
        tracks = tuple(
            TrackedObject(
                name,
                frame.t_ns,
                Pose.from_yaw(
                    pose.yaw() + self._rng.normal(0, NOISE_RAD),
                    pose.translation + self._rng.normal(0, NOISE_M, 3),
                ),
                np.eye(4) * 1e-6,
                1.0,
                TrackState.TRACKED,
                0.9,
                frame.seq,
            )
            for name, pose in self._rows[at].items()
        )
        return state + 1, TrackOutput(tracks, {}, frame.world_from_rig)


@pytest.fixture(scope="session")
def rooms():
    """Rooms by the name of their scene, with the text of what is done in them."""
    return {
        "lab": SimpleNamespace(room=lab_room(), scene=package(lab_room()), text=LAYOUT),
        "tangram": SimpleNamespace(
            room=tangram_room(), scene=package(tangram_room()), text=TANGRAM
        ),
    }


@pytest.fixture(scope="session")
def acting():
    return SimpleNamespace(acted=acted, tracker=ActedTracker)


@pytest.fixture
def folder(tmp_path):
    """A study's folder, with the scenarios of its tasks."""
    for name, text in (("layout", LAYOUT), ("tangram", TANGRAM)):
        (tmp_path / f"{name}.toml").write_text(text)
    study = tmp_path / "study"
    study.mkdir()
    text = STUDY.format(layout=tmp_path / "layout.toml", tangram=tmp_path / "tangram.toml")
    (study / STUDY_FILE).write_text(text)
    return StudyFolder(study)
