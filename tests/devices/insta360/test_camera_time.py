import numpy as np

from devices.insta360.camera_time import CameraTime

MS = 1_000_000


def test_the_fastest_packet_sets_the_offset():
    time = CameraTime()
    rng = np.random.default_rng(1)
    delays = 5 * MS + rng.exponential(4 * MS, 300).astype(int)
    delays[40] = 5 * MS
    late = []
    for index, delay in enumerate(delays):
        taken_ns = 7_000 * MS + index * 33 * MS
        late.append(time.session_ns(index * 33_000 + 999, taken_ns + int(delay)) - taken_ns)
    assert set(late[41:]) == {5 * MS}


def test_times_grow_and_never_lie_after_the_arrival():
    time = CameraTime()
    rng = np.random.default_rng(2)
    before = -1
    for index in range(500):
        arrived_ns = 100 * MS + index * 33 * MS + int(rng.integers(0, 30 * MS))
        given = time.session_ns(index * 33_000, arrived_ns)
        assert before < given <= arrived_ns
        before = given


def test_a_clock_that_runs_too_fast_or_too_slow_is_followed():
    for ppm in (-100, 100):
        time = CameraTime()
        for index in range(30 * 600):
            taken_ns = index * 33 * MS
            camera_us = round(taken_ns / 1000 * (1 + 1e-6 * ppm))
            given = time.session_ns(camera_us, taken_ns + 5 * MS)
        assert abs(given - taken_ns - 5 * MS) <= 7 * MS


def test_a_clock_that_jumps_back_still_gives_times_that_grow():
    time = CameraTime()
    first = time.session_ns(5_000_000, 10 * MS)
    assert time.session_ns(1_000, 43 * MS) == first + 1
