"""The paper's two applications as scenarios: what is moved ends where it was drawn."""

import math

import cv2
import numpy as np
import pytest

from scenes.pose import Pose, wrap_angle
from scenes.samples import sample_room
from scenes.samples.pieces import DESIGNS, THICK_M, UNIT_M
from sim.people.actors import TICK_NS, Actor, introduce
from sim.people.remote import remote_annotations, remote_avatar
from sim.physics.any_room import physics_of
from sim.scenarios.actions import Carry
from sim.scenarios.scenario import load_scenario, validate_scenario


class Played:
    """A scenario after its people have done what they had to, without a camera."""

    def __init__(self, name):
        self.scenario = load_scenario(name)
        self.room = sample_room(self.scenario.room)
        validate_scenario(self.scenario, self.room)
        (person,) = self.scenario.people
        actor = Actor(
            person.person_id,
            self.room,
            start=person.start,
            yaw=math.radians(person.facing_deg),
            actions=person.actions,
            camera_xy=self.room.world_from_rig.translation[:2],
        )
        introduce([actor])
        physics = physics_of(self.room, {actor.person_id: actor.target()})
        self.rays = []
        self.begun = {}
        for k in range(round(self.scenario.duration_s * 1e9 / TICK_NS)):
            actor.tick(physics)
            self.begun.setdefault(actor.action_index, k * TICK_NS * 1e-9)
            if actor.ray is not None:
                self.rays.append(actor.ray)
            physics.move_people({actor.person_id: actor.target()})
            physics.step(TICK_NS)
        self.is_done = actor.action_index == len(person.actions)
        self.actions = person.actions
        self.poses = {o.object_id: physics.object_pose(o.object_id) for o in self.room.objects}

    def remote_at(self, t_s):
        """Avatar and lines of the remote user at a time."""
        (settings,) = self.scenario.remote
        fraction = t_s / self.scenario.duration_s
        avatar = remote_avatar(settings, fraction, self.poses, Pose.identity(), t_s=t_s)
        return avatar, remote_annotations(settings, since_s=t_s - 0.1, t_s=t_s)

    def drawn(self, index):
        """(N, 3) the corners of a line that the remote user draws."""
        return np.array(self.scenario.remote[0].draws[index].points)


@pytest.fixture(scope="module")
def lesson():
    return Played("tangram-lesson")


@pytest.fixture(scope="module")
def layout():
    return Played("lab-layout")


def test_every_piece_of_the_tangram_is_laid_inside_the_outline(lesson):
    assert lesson.is_done
    carried = [action for action in lesson.actions if isinstance(action, Carry)]
    assert {action.object for action in carried} == set(DESIGNS)
    outlines = [lesson.drawn(k)[:, :2].astype(np.float32)[:, None] for k in range(2)]
    for action in carried:
        pose = lesson.poses[action.object]
        start = lesson.room.object_by_id(action.object).world_from_object
        assert pose.translation[:2] == pytest.approx(action.to, abs=0.01)
        assert pose.translation[2] == pytest.approx(start.translation[2], abs=0.002)
        turned = math.degrees(wrap_angle(pose.yaw() - start.yaw()))
        assert turned == pytest.approx(action.turn_deg, abs=2.0)
        corners = UNIT_M * np.array(DESIGNS[action.object].corners)
        outline = outlines[action.object == "square-1"]
        for x, y, _ in pose @ np.column_stack([corners, np.zeros(len(corners))]):
            inside_m = cv2.pointPolygonTest(outline, (float(x), float(y)), measureDist=True)
            assert inside_m > -0.012, f"{action.object} sticks out by {-100 * inside_m:.1f} cm"


def test_furniture_ends_where_the_remote_user_drew(layout):
    assert layout.is_done
    for index, object_id in enumerate(("chair-2", "stool-1", "chair-1", "stool-2")):
        middle = layout.drawn(index)[:-1, :2].mean(axis=0)
        pose = layout.poses[object_id]
        before = layout.room.object_by_id(object_id).world_from_object.translation[:2]
        assert np.linalg.norm(before - middle) > 0.4, "it had to be moved"
        assert np.linalg.norm(pose.translation[:2] - middle) < 0.15
        assert pose.translation[2] == pytest.approx(0.0, abs=0.005)
        assert pose.rotation[2, 2] > 0.999
    middle = np.array([-0.4, 0.6])
    for chair in ("chair-1", "chair-2"):
        pose = layout.poses[chair]
        towards = middle - pose.translation[:2]
        assert pose.rotation[:2, 1] @ towards > 0.9 * np.linalg.norm(towards), "it faces the middle"


@pytest.mark.parametrize("name", ["lesson", "layout"])
def test_nothing_is_moved_before_it_has_been_shown(name, request):
    """Each place is drawn, or each piece pointed at, before the local user sets out."""
    played = request.getfixturevalue(name)
    (remote,) = played.scenario.remote
    first = {}
    share = played.scenario.duration_s / len(remote.points_at)
    for k, object_id in enumerate(remote.points_at):
        first.setdefault(object_id, k * share)
    begun = {}
    for index, action in enumerate(played.actions):
        if getattr(action, "object", None):
            begun.setdefault(action.object, played.begun[index])
    for object_id, t_s in begun.items():
        assert first[object_id] < t_s, object_id
    if name == "layout":
        for drawing, t_s in zip(remote.draws, begun.values(), strict=True):
            assert drawing.from_s + drawing.seconds <= t_s + 0.01


def test_lines_and_rays_of_both_users_come_out(lesson, layout):
    for played, lines in ((lesson, 2), (layout, 4)):
        remote = played.scenario.remote[0]
        _, drawn = played.remote_at(played.scenario.duration_s)
        assert not drawn, "every line is finished by the end"
        first = remote.draws[0]
        avatar, (line,) = played.remote_at(first.from_s + 0.5 * first.seconds)
        assert len(remote.draws) == lines
        assert len(line.points_in_world) < len(first.points)
        assert avatar.ray is not None
        assert avatar.ray[1] == pytest.approx(line.points_in_world[-1])
        assert played.rays, "the local user points too"
    # Between two drawings the instructor points at a piece, at its top and not above it.
    avatar, _ = lesson.remote_at(6.0)
    piece = lesson.poses["large-1"].translation
    assert avatar.ray is not None
    assert avatar.ray[1] == pytest.approx((*piece[:2], piece[2] + 0.03), abs=1e-4)
    assert avatar.ray[1][2] - piece[2] == pytest.approx(THICK_M, abs=0.005)
