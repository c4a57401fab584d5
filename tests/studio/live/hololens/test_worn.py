"""A headset in a session from beginning to end, without the headset."""

import time
from dataclasses import replace

import numpy as np
import pytest

from devices.clock import WallClock
from devices.hololens.plan import HeadsetPlan
from devices.hololens.values import SpatialSurface, StreamName, StreamState, StreamStatus
from devices.hub.attendance import AWAY_NS
from scenes.pose import Pose
from scenes.state import SceneState
from studio.live.hololens import address
from studio.live.hololens.checks import headset_checks
from studio.live.hololens.figures import Seen, SimulatedFigures, simulated_rows, worn_rows
from studio.live.hololens.timing import Durations
from studio.live.hololens.worn import WornHeadset, WornPlan
from tracking.headset.corner_fit import Belief
from tracking.headset.followed import Followed
from tracking.headset.glide import Glide
from tracking.headset.origin import Origin


@pytest.fixture
def worn(scanned_package, headset):
    clock = WallClock()
    made = WornHeadset(
        WornPlan(HeadsetPlan("127.0.0.1"), "Ana"),
        scanned_package,
        clock=clock,
        make=lambda plan, clock: headset,
    )
    yield made
    if not headset.is_closed:
        made.close()


def anchored(worn):
    belief = Belief(Pose.identity(), np.eye(6) * 1e-6, np.zeros(3), 0)
    worn.anchoring._origin = Origin(anchor=Followed(belief), glide=Glide(Pose.identity(), 0))


def until(condition, seconds=120.0):
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.01)


def test_the_wearer_is_among_the_people_once_there_is_an_origin(worn, headset, sample_of):
    everybody = worn.people(None)
    worn.start()
    headset.bodies.waiting.append(sample_of(t_ns=worn._clock.now_ns()))
    until(lambda: worn.status().body_age_s is not None)
    assert everybody.take().avatars == ()
    anchored(worn)
    (avatar,) = everybody.take().avatars
    assert avatar.name == "Ana"
    assert avatar.gaze is not None
    everybody.publish(SceneState())
    worn._note("a", "b")
    assert ("a", "b") in everybody.take().events
    worn.close()
    assert headset.is_closed
    assert headset.drawn[-1] == {}


def test_the_camera_is_where_its_code_is_once_it_was_moved(worn, headset):
    moved = []
    worn._move_camera = moved.append
    rig, code = Pose.from_yaw(0.0, (1, 0, 1)), Pose.from_yaw(0.0, (0, 0.1, 0))

    def seen(world_from_code, restarts):
        belief = Belief(world_from_code, np.eye(6) * 1e-8, np.zeros(3), 0)
        worn.anchoring._origin = Origin(carried=Followed(belief, restarts=restarts))

    seen(rig @ code, 0)
    worn.see_camera(rig)
    assert moved == []
    seen(Pose.from_yaw(0.0, (2, 1, 1)) @ code, 1)
    worn.see_camera(rig)
    assert np.allclose(moved[0].translation, (2, 1, 1))


def checks(worn):
    return {name: probe() for name, probe in headset_checks(worn, sleep=lambda _s: None).items()}


def test_every_check_that_is_not_good_says_what_to_do(worn, headset):
    found = checks(worn)
    assert {check.verdict for check in found.values()} == {"WARN"}
    assert all(check.fix for check in found.values())
    live = StreamStatus(StreamState.LIVE, "receiving", rate_hz=30.0, delay_ms=20.0)
    headset.said = type(headset.said)("127.0.0.1", dict.fromkeys(StreamName, live))
    anchored(worn)
    assert {check.verdict for check in checks(worn).values()} == {"PASS"}


def test_figures_are_those_that_were_measured(worn):
    names = {row.name for row in worn_rows(worn)}
    assert "hololens.display_items" in names
    assert "hololens.video_ms.p95" not in names
    worn.video_delays.add(20.0)
    row = next(row for row in worn_rows(worn) if row.name == "hololens.video_ms.p95")
    assert row.value == 20.0
    assert row.passed


def test_pictures_that_came_from_the_headset_are_counted(headset, worn):
    assert "hololens.video_pictures" not in {row.name for row in worn_rows(worn)}
    came = StreamStatus(StreamState.LIVE, "receiving", received=140)
    headset.said = replace(headset.said, streams={"video": came})
    row = next(row for row in worn_rows(worn) if row.name == "hololens.video_pictures")
    assert row.value == 140.0


def test_pointing_is_held_against_the_true_leg():
    figures = SimulatedFigures()
    assert simulated_rows(figures, []) == []
    leg, true = np.array([0.1, 0.0, 0.2]), Pose.from_yaw(0.0, (1.0, 1.0, 0.0))
    figures.seen.append(Seen(1_000, "chair-1", true @ leg + [0.01, 0, 0], leg))
    figures.point_ms.add(80.0)
    rows = {row.name: row for row in simulated_rows(figures, [(0, {}), (1_000, {"chair-1": true})])}
    assert abs(rows["session.point_cm"].value - 1.0) < 1e-6
    assert rows["session.point_cm"].passed
    assert rows["session.point_ms.p95"].value == 80.0


def test_durations_have_percentiles():
    kept = Durations()
    assert kept.percentile(50) is None
    for value in range(101):
        kept.add(value)
    assert kept.percentile(95) == 95.0
    assert len(kept) == 101
    kept.clear()
    assert len(kept) == 0


@pytest.mark.parametrize("text", ["192.168.1.40", "headset.local"])
def test_an_address_is_a_host(text):
    assert address.worn_plan(text).headset.host == text


@pytest.mark.parametrize("text", ["", "http://1.2.3.4", "a b", "-x"])
def test_what_is_no_address_is_refused_with_what_it_could_be(text):
    with pytest.raises(ValueError, match="such as"):
        address.parse_host(text)


def test_a_mesh_is_kept_with_the_room(worn, headset, scanned_package, tmp_path):
    from scenes.package import load_package, save_package
    from studio.live.hololens.wearing import Wearing

    save_package(scanned_package, tmp_path / "room")
    worn.meshing.begin()
    assert not Wearing(worn).save_into(tmp_path / "room", scanned_package)
    side = np.linspace(-0.4, 0.4, 9)
    x, y = np.meshgrid(side, side)
    corners = np.stack([x.ravel(), y.ravel(), np.full(x.size, 0.7)], axis=1)
    k = np.arange(81).reshape(9, 9)
    a, b, c, d = k[:-1, :-1].ravel(), k[:-1, 1:].ravel(), k[1:, 1:].ravel(), k[1:, :-1].ravel()
    faces = np.concatenate([np.stack([a, b, c], 1), np.stack([a, c, d], 1)]).astype(np.int32)
    table = SpatialSurface("t", 1, 0, corners, faces, Pose.identity())
    worn.meshing.take(table, Pose.identity())
    assert Wearing(worn).save_into(tmp_path / "room", scanned_package)
    again = load_package(tmp_path / "room")
    assert len(again.collision.faces) > len(scanned_package.collision.faces)
    assert again.stages[-1].name == "headset mesh"
    assert worn.save_mesh(tmp_path) == tmp_path / "headset-mesh.glb"


def test_a_wearer_is_listed_while_the_headset_is_heard(scanned_package, headset, sample_of):
    class Hub:
        met, hidden = None, ()

        def hide_behind(self, cells):
            self.hidden = (*self.hidden, *cells)

        def meet(self, others, *, way):
            self.met = [each.person.name for each in others]

    hub, clock = Hub(), WallClock()
    plan = WornPlan(HeadsetPlan("127.0.0.1"), "Ana")
    made = WornHeadset(plan, scanned_package, clock=clock, hub=lambda: hub, make=lambda *_: headset)
    made.start()
    until(lambda: hub.met == [])
    now_ns = clock.now_ns()
    headset.bodies.waiting.append(replace(sample_of(t_ns=now_ns), arrived_ns=now_ns))
    until(lambda: hub.met == ["Ana"])
    made._sample = replace(made._sample, arrived_ns=clock.now_ns() - AWAY_NS)
    until(lambda: hub.met == [])
    headset.bodies.waiting.append(sample_of(t_ns=clock.now_ns()))
    until(lambda: hub.met == ["Ana"])
    # A room that sites join gets surfaces beside the hub, and all that are there.
    made._hidden.change({(0, 0, 0): scanned_package.collision})
    until(lambda: hub.hidden == ((0, 0, 0),))
    room = Hub()
    made.people(room)
    until(lambda: room.hidden == ((0, 0, 0),))
    made._hidden.change({(1, 0, 0): scanned_package.collision})
    until(lambda: hub.hidden == room.hidden == ((0, 0, 0), (1, 0, 0)))
    made.close()
    assert hub.met == []
