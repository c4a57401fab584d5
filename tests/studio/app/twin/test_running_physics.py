"""Physics at the clock's pace: commands in, poses out, nothing while nothing moves."""

from __future__ import annotations

import numpy as np
import pytest

from devices.clock import ManualClock, WallClock
from scenes.pose import Pose
from sim.physics.by_hand import physics_by_hand
from studio.app.twin.running_physics import COMMANDS, MAX_BEHIND_NS, TICK_NS, RunningPhysics

BOOK = "book-1"


@pytest.fixture
def clock():
    return ManualClock()


@pytest.fixture
def running(desk, clock):
    return RunningPhysics(lambda: physics_by_hand(desk), clock)


def play(running, clock, ticks):
    """Let ticks pass; the last poses that were left."""
    last = None
    for _ in range(ticks):
        clock.sleep_until(clock.now_ns() + TICK_NS)
        running.tick()
        last = running.poses.take() or last
    return last


def test_a_grabbed_object_follows_and_comes_to_rest(running, clock, desk):
    start = desk.object_by_id(BOOK).world_from_object.translation
    running.grab(BOOK, start)
    running.drag(start + np.array([0.0, 0.0, 0.3]))
    frame = play(running, clock, 60)
    assert frame.moving
    assert frame.poses[BOOK].translation[2] == pytest.approx(start[2] + 0.3, abs=0.01)
    running.release()
    frame = play(running, clock, 90)
    assert not frame.moving
    assert frame.poses[BOOK].translation[2] == pytest.approx(start[2], abs=0.005)
    assert frame.taken == running.sent == 2
    assert play(running, clock, 5) is None  # at rest, nothing is worked out


def test_simulated_time_is_the_clocks(running, clock):
    running.wake()
    running.grab(BOOK, (0, 0, 0))
    frame = play(running, clock, 60)
    assert frame.t_ns == pytest.approx(1_000_000_000, abs=2_000_000)
    clock.sleep_until(clock.now_ns() + 10_000_000_000)  # the machine was busy for 10 s
    before = frame.t_ns
    frame = play(running, clock, 1)
    assert frame.t_ns - before <= MAX_BEHIND_NS


def test_paused_nothing_moves_and_what_is_placed_floats_until_woken(running, clock, desk):
    up = Pose.from_yaw(0.0, desk.object_by_id(BOOK).world_from_object.translation + 0.4)
    running.place({BOOK: up})
    frame = play(running, clock, 10)
    assert np.array_equal(frame.poses[BOOK].translation, up.translation)
    running.pause()
    running.wake()
    frame = play(running, clock, 10)
    assert np.array_equal(frame.poses[BOOK].translation, up.translation)
    running.resume()
    frame = play(running, clock, 120)
    assert frame.poses[BOOK].translation[2] < up.translation[2] - 0.3


def test_a_drag_of_another_grab_moves_nothing(running, clock, desk):
    places = {item.object_id: item.world_from_object.translation for item in desk.objects}
    running.grab(BOOK, places[BOOK])
    running.drag((0.0, 0.0, 2.0))
    running.grab("mug-1", places["mug-1"])
    frame = play(running, clock, 30)
    assert np.linalg.norm(frame.poses["mug-1"].translation - places["mug-1"]) < 0.01


def test_what_cannot_be_done_is_said_and_physics_goes_on(running, clock):
    running.grab("piano", (0, 0, 0))
    running.wake()
    frame = play(running, clock, 3)
    assert "piano" in running.problems.take()
    assert frame.taken == 2
    for _ in range(COMMANDS + 1):
        running.wake()
    assert "busy" in running.problems.take()
    assert running.sent == 2 + COMMANDS


def test_on_its_thread_it_leaves_poses_and_ends(desk, until):
    running = RunningPhysics(lambda: physics_by_hand(desk), WallClock())
    running.start()
    running.throw(BOOK, (0.0, 0.0, 1.0))
    seen = []

    def look():
        frame = running.poses.take()
        seen.extend([] if frame is None else [frame])

    until(lambda: bool(seen) and not seen[-1].moving, look)
    assert len(seen) > 5
    assert max(frame.poses[BOOK].translation[2] for frame in seen) > 0.02
    running.stop()
    running.join()
    running.grab(BOOK, (0, 0, 0))
    assert "closed" in running.problems.take()


def test_physics_that_cannot_be_opened_is_a_failure_not_a_crash(until):
    def broken():
        raise ValueError("no room")

    running = RunningPhysics(broken, WallClock())
    running.start()
    until(lambda: running.failure is not None)
    running.join()
    assert str(running.failure) == "no room"
