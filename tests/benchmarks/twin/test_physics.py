"""The physics bench: all its figures are there, and nothing thrown gets out of a small scan."""

import json

import numpy as np
import pytest

from benchmarks.twin import physics
from benchmarks.twin.physics import HIGH_M, LOW_M, cartons, exact_room, scanned_room
from scenes.pose import Pose
from sim.physics.collision.surface import surface_of
from sim.physics.engine import mujoco
from sim.physics.scanned.twin import Twin
from studio.cli import main


def test_quick_figures(capsys, monkeypatch):
    monkeypatch.setattr(physics, "QUICK_THROWS", 20)
    monkeypatch.setattr(physics, "EDITS", 3)
    monkeypatch.setattr("benchmarks.twin.physics.SCAN_EDGE_M", 0.12)
    # Its status tells how busy the machine is.
    assert main(["bench", "physics", "--quick", "--json"]) in (0, 1)
    report = json.loads(capsys.readouterr().out)
    assert report["verb"] == "bench physics"
    rows = {row["name"]: row for row in report["rows"]}
    assert rows["physics.steps_per_s"]["value"] > 0
    assert rows["physics.rescan.ms"]["value"] > 0
    assert rows["physics.throws"]["value"] == 20
    assert rows["physics.escaped"]["value"] == 0


def test_the_scan_is_as_large_as_it_says():
    triangles = scanned_room(1)
    assert 200_000 <= len(triangles) < 260_000
    assert np.ptp(triangles.reshape(-1, 3), axis=0) == pytest.approx((6.0, 5.0, 2.8), abs=0.05)


def put(twin, name, world_from_object):
    """Into whatever is there: `Twin.place` would push it out."""
    joint = twin._free_joint(name)
    joint.qpos[:3] = world_from_object.translation
    joint.qpos[3:] = world_from_object.quaternion()
    mujoco.mj_kinematics(twin._model, twin._data)


def test_what_is_outside_or_sunk_is_seen():
    (item,) = cartons(1, np.random.default_rng(1))
    twin = Twin(surface_of(exact_room()), (item,))
    name = item.object_id
    put(twin, name, Pose.from_yaw(0.0, (3.0, 3.5, 1.0)))
    assert physics._outside_mm(twin, name) < -500
    assert physics._sunk_mm(twin, name) == 0
    put(twin, name, Pose.from_yaw(0.0, (3.0, 3.5, -0.02)))
    assert physics._outside_mm(twin, name) == pytest.approx(20.0)
    assert physics._sunk_mm(twin, name) == pytest.approx(20.0)
    put(twin, name, Pose.from_yaw(0.0, (3.1, 2.45, 0.73)))
    assert physics._sunk_mm(twin, name) == pytest.approx(10.0)
    assert LOW_M < HIGH_M
