from __future__ import annotations

import numpy as np
import pytest

from sim.people.figure import person_body
from sim.people.posture import (
    FOREARM_M,
    MAX_CROUCH_M,
    MAX_LEAN_RAD,
    PART_NAMES,
    SHIN_M,
    THIGH_M,
    UPPER_ARM_M,
    WRIST_GAP_M,
    Posture,
    bend_to_reach,
    part_poses,
    resting_hand,
)


def _posture(phase=0.2, stride=1.0, left=None, right=None, lean=0.05, crouch=0.0):
    here = np.array([0.4, -0.3])
    rest = Posture(here, 0.7, phase, stride, lean, crouch, np.zeros(3), np.zeros(3))
    hands = [resting_hand(rest, side) for side in (1.0, -1.0)]
    left = hands[0] if left is None else left
    right = hands[1] if right is None else right
    return Posture(here, 0.7, phase, stride, lean, crouch, left, right)


def _named(posture):
    return dict(zip(PART_NAMES, part_poses(posture), strict=True))


@pytest.mark.parametrize("phase", [0.0, 0.13, 0.4, 0.55, 0.7, 0.95])
@pytest.mark.parametrize("side", ["left", "right"])
def test_limbs_keep_their_length_and_hang_together(phase, side):
    parts = _named(_posture(phase))
    for upper, lower, length in (
        ("thigh", "shin", THIGH_M),
        ("shin", "shoe", SHIN_M),
        ("upper-arm", "forearm", UPPER_ARM_M),
        ("forearm", "hand", FOREARM_M),
    ):
        end = parts[f"{side}-{upper}"] @ np.array([0.0, 0.0, -length])
        assert np.linalg.norm(end - parts[f"{side}-{lower}"].translation) < 1e-6


def test_feet_stay_on_or_above_the_floor_and_one_always_stands():
    for phase in np.linspace(0, 1, 41):
        parts = _named(_posture(float(phase)))
        heights = [parts[f"{side}-shoe"].translation[2] for side in ("left", "right")]
        assert min(heights) == pytest.approx(0.075, abs=0.012)
        assert max(heights) < 0.25


def test_a_planted_foot_does_not_slide():
    """While a foot stands, the body's way forward is the foot's way back."""
    stride = 1.2
    before, after = (_named(_posture(phase, stride)) for phase in (0.1, 0.3))
    way = before["left-shoe"].translation - after["left-shoe"].translation
    assert np.linalg.norm(way[:2]) == pytest.approx(0.2 * stride, abs=0.01)


@pytest.mark.parametrize("height", [0.42, 0.75, 1.1])
def test_hands_are_where_the_physics_has_them(height):
    here = np.array([0.4, -0.3])
    forward = np.array([np.cos(0.7), np.sin(0.7)])
    left, right = (
        np.array(
            [*(here + 0.45 * forward + s * 0.15 * np.array([-forward[1], forward[0]])), height]
        )
        for s in (1, -1)
    )
    lean, crouch = bend_to_reach(here, 0.7, left, right)
    parts = _named(_posture(0.0, 0.0, left, right, lean, crouch))
    for name, hand in (("left-hand", left), ("right-hand", right)):
        assert np.linalg.norm(parts[name].translation - hand) == pytest.approx(
            WRIST_GAP_M, abs=0.01
        )


def test_a_figure_has_the_parts_that_are_posed_and_is_as_tall_as_a_person():
    body = person_body("ann", np.random.default_rng(4))
    again = person_body("ann", np.random.default_rng(4))
    poses = part_poses(_posture(0.0, 0.0))
    assert len(body.parts) == len(PART_NAMES) == len(poses)
    points = np.concatenate(
        [pose @ part.meshes[0].vertices for part, pose in zip(body.parts, poses, strict=True)]
    )
    assert abs(points[:, 2].min()) < 0.02
    assert 1.6 < points[:, 2].max() < 1.9
    for a, b in zip(body.parts, again.parts, strict=True):
        assert np.array_equal(a.meshes[0].texture, b.meshes[0].texture)


def test_the_estimate_of_a_reach_decides_as_the_posture_does():
    rng = np.random.default_rng(2)
    bent = 0
    for _ in range(300):
        here, yaw = rng.uniform(-3.0, 3.0, 2), rng.uniform(-3.0, 3.0)
        low, high = (*(here - 0.5), 0.0), (*(here + 0.5), 1.6)
        left, right = rng.uniform(low, high), rng.uniform(low, high)
        chosen = bend_to_reach(here, yaw, left, right)
        for effort in np.linspace(0.0, 1.0, 33):
            lean = MAX_LEAN_RAD * float(effort)
            crouch = MAX_CROUCH_M * float(max(0.0, effort - 0.35) / 0.65)
            parts = _named(Posture(here, yaw, 0.0, 0.0, lean, crouch, left, right))
            shoulders = [parts[f"{side}-upper-arm"].translation for side in ("left", "right")]
            far = max(
                np.linalg.norm(shoulder - hand)
                for shoulder, hand in zip(shoulders, (left, right), strict=True)
            )
            if far <= 0.94 * (UPPER_ARM_M + FOREARM_M) + WRIST_GAP_M:
                assert chosen == (lean, crouch)
                bent += lean > 0.0
                break
        else:
            assert chosen == (MAX_LEAN_RAD, MAX_CROUCH_M)
    assert bent > 20
