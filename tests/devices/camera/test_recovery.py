"""Streams that come back: after a black hole, a half-open socket, a restart, garbage."""

import random
import threading
import time

import pytest

from tests.devices.camera.parties.programs import wait_for
from tests.devices.camera.recovery import (
    KINDS,
    OTHER_SIZE,
    SIZE,
    back_after_s,
    black_hole,
    linked,
    residue,
)

MOST_S = 15.0
"""Ceiling in the unit tests, three times the bar: other programs run beside them."""

HOLE_S = 3.0


@pytest.fixture(autouse=True)
def nothing_is_left():
    before = residue()
    yield
    end = time.monotonic() + 10
    while residue() != before and time.monotonic() < end:
        time.sleep(0.05)
    assert residue() == before, [thread.name for thread in threading.enumerate()]


def events(link):
    return [(event.kind, event.text) for event in link.receiver.take_events()]


@pytest.mark.parametrize("kind", KINDS)
def test_pictures_are_back_after_a_black_hole_with_its_length(kind):
    with linked(kind) as link:
        assert black_hole(link, HOLE_S) < MOST_S
        gaps = [text for event, text in events(link) if event == "camera-gap"]
        assert len(gaps) == 1
        assert HOLE_S - 0.5 < float(gaps[0].split("after ")[1].split(" s")[0]) < HOLE_S + MOST_S


@pytest.mark.parametrize("kind", ["rtsp", "insta360"])
def test_a_half_open_socket_is_replaced_by_a_new_connection(kind):
    with linked(kind) as link:
        assert back_after_s(link, link.relay.half_open) < MOST_S
        assert link.receiver.status().connections == 2


def test_a_new_rtmp_connection_wins_while_the_old_one_is_open():
    """A camera connects again at once, which it may do once: it does not try again if refused."""
    with linked("rtmp") as link:
        assert back_after_s(link, link.restart) < MOST_S
        assert link.receiver.status().connections == 2


@pytest.mark.parametrize("kind", KINDS)
def test_a_camera_that_starts_again_is_received_in_its_new_size(kind):
    with linked(kind) as link:
        link.restart()
        wait_for(lambda: link.receiver.status().size_px == OTHER_SIZE, 2 * MOST_S)
        first = link.receiver.status().pictures
        wait_for(lambda: link.receiver.status().pictures > first + 10)


@pytest.mark.parametrize("kind", KINDS)
def test_garbage_in_the_stream_is_survived(kind):
    with linked(kind) as link:
        for seed in range(3):
            link.relay.send_garbage(random.Random(seed).randbytes(700))
            time.sleep(0.2)
        before = link.receiver.status().pictures
        wait_for(lambda: link.receiver.status().pictures > before + 10, 2 * MOST_S)
        assert link.receiver.status().size_px == SIZE


@pytest.mark.slow
@pytest.mark.parametrize("fault", ["black hole of 20 s", "half-open socket", "camera restart"])
@pytest.mark.parametrize("kind", KINDS)
def test_pictures_are_back_within_five_seconds(kind, fault, capsys):
    if fault == "half-open socket" and kind in ("udp", "rtmp"):
        pytest.skip("UDP has no connection; an RTMP camera starts again beside its half-open one")
    times = []
    for _ in range(3):
        with linked(kind) as link:
            if fault == "black hole of 20 s":
                times.append(black_hole(link, 20.0 + 1.3 * len(times)))
            else:
                act = link.restart if fault == "camera restart" else link.relay.half_open
                times.append(back_after_s(link, act))
    with capsys.disabled():
        print(f"\n{kind}, {fault}: back after", ", ".join(f"{t:.2f} s" for t in sorted(times)))
    assert sorted(times)[1] <= 5.0
