import numpy as np
import pytest

from devices.insta360.camera_time import CameraTime

MS = 1_000_000
UNITS_NS = (1, 1_000, 1_000_000)


def stamps(count, *, unit_ns, start_s=400, step_ns=33 * MS):
    """The camera's stamps and when pictures are really taken, on the session's clock."""
    for index in range(count):
        taken_ns = 7_000 * MS + index * step_ns
        yield (start_s * 1_000 * MS + index * step_ns) // unit_ns, taken_ns


@pytest.mark.parametrize("unit_ns", UNITS_NS)
def test_the_unit_is_measured_and_the_fastest_packet_sets_the_offset(unit_ns):
    time = CameraTime()
    rng = np.random.default_rng(1)
    delays = 5 * MS + rng.exponential(4 * MS, 300).astype(int)
    delays[40] = 5 * MS
    late = []
    for (stamp, taken_ns), delay in zip(stamps(300, unit_ns=unit_ns), delays, strict=True):
        late.append(time.session_ns(stamp, taken_ns + int(delay)) - taken_ns)
    assert time.tick_ns == unit_ns
    assert np.abs(np.array(late[41:]) - 5 * MS).max() < MS, "jitter of 4 ms is gone"
    assert late[:9] == delays[:9].tolist(), "arrival, until the unit is known"


@pytest.mark.parametrize("unit_ns", UNITS_NS)
def test_a_burst_at_the_beginning_does_not_hide_the_unit(unit_ns):
    """A second of pictures comes at once, then the rest at its pace."""
    time = CameraTime()
    for stamp, taken_ns in stamps(90, unit_ns=unit_ns):
        time.session_ns(stamp, max(taken_ns, 8_000 * MS))
    assert time.tick_ns == unit_ns


def test_times_grow_and_never_lie_after_the_arrival():
    time = CameraTime()
    rng = np.random.default_rng(2)
    before = -1
    for stamp, taken_ns in stamps(500, unit_ns=MS):
        arrived_ns = taken_ns + int(rng.integers(0, 30 * MS))
        given = time.session_ns(stamp, arrived_ns)
        assert before < given <= arrived_ns
        before = given


@pytest.mark.parametrize("ppm", [-100, 100])
def test_a_clock_that_runs_too_fast_or_too_slow_is_followed(ppm):
    time = CameraTime()
    for index in range(30 * 120):
        taken_ns = index * 33 * MS
        given = time.session_ns(round(taken_ns / 1000 * (1 + 1e-6 * ppm)), taken_ns + 5 * MS)
    assert abs(given - taken_ns - 5 * MS) <= MS // 10
    assert abs(time.estimate.drift_ppm + ppm) < 1


@pytest.mark.parametrize("stamp", [0, 77, (1 << 64) - 1])
def test_stamps_that_stand_still_leave_the_arrival(stamp):
    time = CameraTime()
    arrivals = [index * 33 * MS for index in range(60)]
    assert [time.session_ns(stamp, arrived_ns) for arrived_ns in arrivals] == arrivals
    assert time.tick_ns is None


def test_stamps_of_no_known_unit_leave_the_arrival():
    time = CameraTime()
    arrivals = [index * 100 * MS for index in range(60)]
    given = [time.session_ns(index // 20, at) for index, at in enumerate(arrivals)]
    assert given == arrivals
    assert time.tick_ns is None


def test_a_camera_that_starts_its_clock_anew_is_followed():
    time = CameraTime()
    for stamp, taken_ns in stamps(60, unit_ns=MS):
        time.session_ns(stamp, taken_ns + 5 * MS)
    for index in range(60):
        arrived_ns = 60_000 * MS + index * 33 * MS
        given = time.session_ns(33 * index, arrived_ns)
        assert given == arrived_ns
