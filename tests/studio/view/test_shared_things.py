"""Proposals and primitives as splats: where they are, in which colour."""

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud
from scenes.state import (
    PRIMITIVE_SHAPES,
    Avatar,
    ObjectModel,
    Proposal,
    SceneState,
    SharedPrimitive,
)
from studio.view.shared_things import (
    MET,
    OPEN,
    attention_rings,
    met_proposals,
    primitive_splats,
    proposed_splats,
)

PLACE = Pose.from_yaw(np.pi / 2, (1.0, 2.0, 0.5))


def body(shape, size=(0.6, 0.2, 0.4)):
    return SharedPrimitive("p1/b", "p1", shape, size, (0.8, 0.2, 0.2), PLACE)


@pytest.mark.parametrize("shape", PRIMITIVE_SHAPES)
def test_a_primitive_is_covered_and_stands_on_its_base(shape):
    posed = primitive_splats(body(shape))
    points = posed.cloud.means
    np.testing.assert_allclose(points.min(axis=0), [-0.3, -0.1, 0.0], atol=0.02)
    np.testing.assert_allclose(points.max(axis=0), [0.3, 0.1, 0.4], atol=0.02)
    assert posed.world_from_object is PLACE
    red, green, _ = posed.cloud.colours().mean(axis=0)
    assert red > 2 * green


def test_an_arrow_is_widest_behind_its_tip_which_is_ahead():
    points = primitive_splats(body("arrow", (1.0, 0.2, 0.2))).cloud.means
    width = [
        np.ptp(points[(points[:, 0] > low) & (points[:, 0] < low + 0.1)][:, 1])
        for low in (-0.4, 0.1, 0.4)
    ]
    assert width[1] > 1.8 * width[0]
    assert width[2] < 0.5 * width[1]


def test_a_primitive_is_opaque_where_it_is():
    camera, eye = Pinhole.from_fov(64, 64, 0.6), np.array([1.0, -1.0, 0.8])
    pose = look_at(eye, np.array([1.0, 2.0, 0.7]))
    drawn = NativeRenderer().render([primitive_splats(body("box"))], camera, pose)
    assert drawn.alpha[30:34, 30:34].min() > 0.9
    assert drawn.depth[32, 32] == pytest.approx(2.7, abs=0.1)  # a side of 0.6 m, turned


def test_a_proposal_is_a_tinted_copy_that_turns_green(tiny):
    item = tiny.scene.objects[0]
    models = {each.object_id: each for each in tiny.scene.objects}
    there = item.world_from_object
    near = Pose.from_yaw(0.1, there.translation + np.array([0.03, 0.0, 0.0])) @ Pose.from_yaw(
        there.yaw()
    )
    far = Pose.from_yaw(0.0, there.translation + np.array([0.5, 0.0, 0.0]))
    copies = [
        Proposal("p1/near", "p1", "Ann", item.object_id, near),
        Proposal("p1/far", "p1", "Ann", item.object_id, far),
        Proposal("p1/ghost", "p1", "Ann", "nothing", far),
    ]
    met = met_proposals(copies, {}, models=models, symmetry_of_kind={})
    assert met == {"p1/near"}
    assert met_proposals(copies, {item.object_id: far}, models=models, symmetry_of_kind={}) == {
        "p1/far"
    }
    green, yellow = proposed_splats(copies, models, met=met)
    assert green.world_from_object is near
    assert len(yellow.cloud) == len(item.splats)
    for posed, colour in ((green, MET), (yellow, OPEN)):
        off = np.abs(posed.cloud.colours().mean(axis=0) - colour).max()
        assert off < np.abs(item.splats.colours().mean(axis=0) - colour).max()
        assert (posed.cloud.opacities < item.splats.opacities).all()


def test_a_ring_of_light_is_around_what_somebody_points_at():
    splats = SplatCloud(
        np.zeros((1, 3), np.float32),
        np.full((1, 3), 0.1, np.float32),
        np.array([[1, 0, 0, 0]], np.float32),
        np.ones(1, np.float32),
        np.zeros((1, 1, 3), np.float32),
    )
    at = Pose.from_yaw(0.3, (1.0, 2.0, 0.0))
    chair = ObjectModel("chair", "Chair", "chair", splats, (0.6, 0.8, 1.0), 0.0, at)
    eye = np.array([0.0, 0.0, 1.6])
    ray = np.stack([eye, [1.0, 2.0, 0.5]])
    looks = Avatar("p1", "remote", look_at(eye, ray[1]))
    points = Avatar("p2", "remote", look_at(eye, ray[1]), ray=ray)
    assert attention_rings(SceneState(avatars={"p1": looks}), [chair]) == []
    (ring,) = attention_rings(SceneState(avatars={"p1": looks, "p2": points}), [chair])
    assert np.allclose(np.linalg.norm(ring - at.translation, axis=1), chair.sphere()[1])
    assert np.allclose(ring[:, 2], 0.0)
    assert np.allclose(ring[0], ring[-1])
