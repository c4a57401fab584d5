"""A receiver of an Insta360 camera while the simulated one fails."""

import http.client
import itertools
import json
import time

import pytest

from devices.camera.address import parse_address
from devices.camera.receiver import CameraReceiver
from devices.clock import WallClock
from sim.wire.streaming.insta360_output import Insta360Output, Insta360Ports
from tests.pushed_camera import read_number


def streamed(camera, until, osc=None):
    output = Insta360Output(Insta360Ports(osc=osc), WallClock(), camera.setting())
    camera.add(output)
    camera.start()
    receiver = CameraReceiver(parse_address(output.url), WallClock())
    taken = []
    try:
        end = time.monotonic() + 25
        while not until(taken) and time.monotonic() < end:
            each = receiver.latest.take(0.05)
            if each is not None:
                taken.append((each.t_ns, each.pts_ns, read_number(each.pictures[0].y)))
    finally:
        receiver.close()
    assert until(taken), f"{len(taken)} pictures came"
    return taken, output


def test_pictures_come_in_order(make_camera):
    taken, output = streamed(make_camera(), lambda t: len(t) > 30)
    numbers = [number for _, _, number in taken]
    # A receiver gives its newest picture: a busy machine may miss some, none comes twice or late.
    assert all(0 < (b - a) % 50 < 25 for a, b in itertools.pairwise(numbers))
    stamps = [pts_ns for _, pts_ns, _ in taken]
    assert stamps == sorted(set(stamps))
    assert output.sent_units >= 30


def test_it_comes_back_after_a_black_hole_and_after_it_vanished(make_camera, event_log):
    camera = make_camera("black_hole:at=1,for=0.6", "half_open:at=3,for=0.6")
    taken, output = streamed(camera, lambda t: t and t[-1][0] - t[0][0] > 6e9)
    gaps = [b[0] - a[0] for a, b in itertools.pairwise(taken)]
    assert sum(gap > 0.5e9 for gap in gaps) >= 2
    assert output.connections >= 2
    assert len(event_log.named("connected")) >= 2


def test_after_a_short_black_hole_the_first_picture_is_a_keyframe(make_camera):
    camera = make_camera("black_hole:at=1.02,for=0.7")
    taken, output = streamed(camera, lambda t: t and t[-1][0] - t[0][0] > 2e9)
    gaps = [(b[0] - a[0], b[2]) for a, b in itertools.pairwise(taken)]
    longest, first = max(gaps)
    assert longest > 0.6e9
    assert first % 5 == 0
    assert output.connections == 1


def test_after_a_restart_it_is_at_the_same_port(make_camera):
    camera = make_camera("restart:at=1,for=1")
    _taken, output = streamed(camera, lambda t: t and t[-1][0] - t[0][0] > 4e9)
    assert output.connections >= 2
    assert output.ports.preview > 0


def test_its_http_interface_answers_beside_it(make_camera):
    _taken, output = streamed(make_camera(), lambda t: len(t) > 2, osc=0)
    connection = http.client.HTTPConnection("127.0.0.1", output.ports.osc, timeout=5)
    connection.request("GET", "/osc/info", headers={"X-XSRF-Protected": "1"})
    assert json.loads(connection.getresponse().read())["model"] == "Insta360 X4"
    connection.close()


def test_a_port_that_is_taken_is_said(make_camera):
    camera = make_camera()
    first = Insta360Output(Insta360Ports(), WallClock(), camera.setting())
    camera.add(first)
    with pytest.raises(OSError, match="in use"):
        Insta360Output(Insta360Ports(preview=first.ports.preview), WallClock(), camera.setting())
