"""`studio.session.staging`: a session in a built-in room, and in a scan of the tests' own."""

import dataclasses
import threading

import numpy as np
import pytest

from scenes.cut import Cut
from scenes.formats.ply import WORLD_COMMENT, write_ply
from scenes.harmonics import turned
from scenes.package import save_package
from scenes.package.reality import Reality
from scenes.prepare.cutout.likewise import TakenApart
from scenes.splats import concatenate
from sim.reality import parts
from studio.session.opening import open_session
from studio.session.plan import SessionPlan
from studio.session.staging import staging_of
from tests.scanned_cell import scan

__all__ = ["scan"]

SCENARIO = """
room = "cell"
duration_s = 0.6
[camera]
fps = 5
lens_size_px = 128
position = [0.0, -0.9, 1.3]
[[people]]
id = "ann"
start = [-0.9, -0.9]
actions = [{ do = "walk", to = [0.9, -0.9] }]
"""


@pytest.fixture
def package(scan, tmp_path, monkeypatch):
    """The scan with its box cut out and a second reconstruction, on disk."""
    item = scan.scene.objects[0]
    standing = turned(scan.box, item.world_from_object)
    path = tmp_path / "second.ply"
    write_ply(path, concatenate([scan.room, standing]), comments=[WORLD_COMMENT])
    cut = Cut("box", np.arange(len(standing)), standing, np.ones(len(standing), bool), 0)
    reality = Reality(path, "test", 10, 8, np.diag([1e-6] * 7))
    made = TakenApart(scan.room, {"box": scan.box}, {})
    monkeypatch.setattr(parts, "taken_apart_like", lambda *a, **k: made)
    monkeypatch.setattr("platformdirs.user_cache_dir", lambda _: str(tmp_path / "cache"))
    scene = dataclasses.replace(scan.scene, cuts=(cut,), reality=reality)
    save_package(scene, tmp_path / "cell.gnx")
    return tmp_path / "cell.gnx"


def test_a_scan_is_staged_with_what_stands_for_it(package):
    staging = staging_of(str(package), None)
    assert staging.room.splats is not None
    assert staging.room.collision is not None
    assert staging.scanned is not None
    assert "10 photos, 8 of which the scan knows" in staging.reality
    assert staging.scenario.people[0].actions
    assert 'room = "cell"' in staging.scenario_text


def test_a_session_plays_in_a_scan_and_knows_the_truth(package, tmp_path):
    scenario = tmp_path / "walk.toml"
    scenario.write_text(SCENARIO)
    plan = SessionPlan(scene=str(package), scenario=str(scenario), methods=("own",))
    seen = []
    open_session(plan).run(seen.append, cancelled=threading.Event())
    assert len(seen) == 3
    picture = seen[0].input.frame.images[0]
    assert picture.std() > 10
    truth = seen[0].message.truth.recorded
    # The real room is not exactly where the scan is.
    apart = truth.world_from_object["box"].translation - (0.0, 0.6, 0.0)
    assert 1e-5 < np.linalg.norm(apart) < 0.02


def test_the_same_seed_gives_the_same_bytes_in_a_scan(package, tmp_path):
    scenario = tmp_path / "walk.toml"
    scenario.write_text(SCENARIO)
    staging = staging_of(str(package), str(scenario))
    first, again = ([s.packet.data for s in staging.steps(3)()] for _ in range(2))
    assert first == again


def test_a_scan_without_reality_says_how_to_make_one(scan, tmp_path):
    save_package(scan.scene, tmp_path / "bare.gnx")
    with pytest.raises(ValueError, match="--rehearsable"):
        staging_of(str(tmp_path / "bare.gnx"), None)


def test_where_nothing_can_be_moved_people_walk_in_the_scan_itself(scan, tmp_path):
    empty = dataclasses.replace(scan.scene, objects=())
    save_package(empty, tmp_path / "empty.gnx")
    staging = staging_of(str(tmp_path / "empty.gnx"), None)
    assert "nothing is tracked" in staging.reality
    assert not staging.room.objects


def test_a_scenario_puts_the_camera_where_it_says(package, tmp_path):
    scenario = tmp_path / "walk.toml"
    scenario.write_text(SCENARIO.replace("[0.0, -0.9, 1.3]", "[0.5, 0.0, 1.1]\nfacing_deg = 0.0"))
    rig = staging_of(str(package), str(scenario)).room.world_from_rig
    assert np.allclose(rig.translation, (0.5, 0.0, 1.1))
    assert np.allclose(rig.rotation[:, 2], (1.0, 0.0, 0.0))
