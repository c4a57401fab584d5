"""A receiver of RTMP when the simulated camera fails in each way it can."""

import itertools
import time

import pytest

from devices.camera.address import parse_address
from devices.camera.receiver import CameraReceiver
from devices.clock import WallClock
from sim.wire.streaming.rtmp_output import RtmpOutput
from tests.pushed_camera import read_number


@pytest.fixture
def receiver():
    made = CameraReceiver(parse_address("rtmp://127.0.0.1:0/live/room"), WallClock())
    until = time.monotonic() + 120
    while not made.listening_at and time.monotonic() < until:
        time.sleep(0.01)
    yield made
    made.close()


def streamed(camera, receiver, until):
    """(arrival, camera's time, picture's number) of all pictures until a condition holds."""
    camera.add(RtmpOutput(receiver.listening_at, camera.setting()))
    camera.start()
    taken = []
    end = time.monotonic() + 20
    while not until(taken) and time.monotonic() < end:
        each = receiver.latest.take(0.05)
        if each is not None:
            taken.append((each.t_ns, each.pts_ns, read_number(each.pictures[0].y)))
    assert until(taken), f"{len(taken)} pictures came"
    return taken


def largest_gap_s(taken):
    return max(b[0] - a[0] for a, b in itertools.pairwise(taken)) / 1e9


def test_without_faults_every_picture_comes_and_the_film_goes_round(make_camera, receiver):
    taken = streamed(make_camera(), receiver, lambda t: len(t) > 60)
    numbers = [number for _, _, number in taken]
    assert all((b - a) % 50 == 1 for a, b in itertools.pairwise(numbers))
    steps = {b[1] - a[1] for a, b in itertools.pairwise(taken)}
    assert steps == {40_000_000}


def test_a_freeze_shows_one_picture_with_times_that_go_on(make_camera, receiver):
    camera = make_camera("freeze:at=0.8,for=0.6")
    taken = streamed(camera, receiver, lambda t: len(t) > 45)
    numbers = [number for _, _, number in taken]
    assert numbers.count(20) >= 15
    after = numbers[len(numbers) - numbers[::-1].index(20) :]
    assert after[0] % 5 == 0, "a keyframe leads out of a freeze"
    assert {b[1] - a[1] for a, b in itertools.pairwise(taken)} == {40_000_000}


def test_loss_leaves_gaps_in_the_times(make_camera, receiver):
    camera = make_camera("loss:at=0.5,size=0.4")
    taken = streamed(camera, receiver, lambda t: t and t[-1][1] > 3_000_000_000)
    steps = [b[1] - a[1] for a, b in itertools.pairwise(taken)]
    assert max(steps) >= 80_000_000
    assert len(taken) < 65


def test_a_delay_moves_arrivals_and_not_the_camera_times(make_camera, receiver):
    camera = make_camera("delay:at=1,for=1,size=0.5")
    taken = streamed(camera, receiver, lambda t: len(t) > 35)
    late = [arrived - stamp for arrived, stamp, _ in taken]
    assert max(late) - min(late) > 0.4e9
    assert 0.3 < largest_gap_s(taken) < 2.0


def test_after_a_black_hole_the_same_connection_goes_on(make_camera, receiver, event_log):
    camera = make_camera("black_hole:at=1,for=1")
    taken = streamed(camera, receiver, lambda t: t and t[-1][1] > 2_600_000_000)
    assert largest_gap_s(taken) > 0.9
    assert len(event_log.named("connected")) == 1


def test_after_half_open_it_comes_back_beside_its_old_connection(make_camera, receiver, event_log):
    camera = make_camera("half_open:at=1,for=0.8")
    taken = streamed(camera, receiver, lambda t: t and t[-1][1] > 3_000_000_000)
    assert largest_gap_s(taken) > 0.7
    assert len(event_log.named("connected")) >= 2
    assert event_log.named("disconnected")[0].values["error"] == "the camera vanished"


def test_after_a_restart_its_clock_begins_anew(make_camera, receiver, event_log):
    camera = make_camera("restart:at=1,for=0.5")

    def came_back(taken):
        return any(b[1] < a[1] for a, b in itertools.pairwise(taken))

    taken = streamed(camera, receiver, lambda t: came_back(t) and t[-1][1] > 500_000_000)
    assert min(stamp for _, stamp, _ in taken[-8:]) < 1_500_000_000
    assert len(event_log.named("connected")) == 2


def test_garbage_breaks_the_connection_and_it_is_made_again(make_camera, receiver, event_log):
    camera = make_camera("garbage:at=1,for=0.3")
    streamed(camera, receiver, lambda t: t and t[-1][1] > 3_000_000_000)
    assert len(event_log.named("connected")) >= 2


def test_without_a_receiver_it_says_so_once_and_goes_on(make_camera, event_log):
    camera = make_camera(seconds=1.5)
    camera.add(RtmpOutput("rtmp://127.0.0.1:9/live/room", camera.setting()))
    camera.start()
    camera.join(120)
    assert not camera.is_running
    assert [event.values["to"] for event in event_log.named("refused")] == ["rtmp"]
