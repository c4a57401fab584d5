"""Clocks whose offset and drift are known: what is estimated covers them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from devices.clock_mapping import (
    MAX_BINS,
    ClockMapping,
    add_arrival,
    add_round_trip,
    estimate,
)

S = 1_000_000_000
RUNS = 100


class Device:
    """A clock that is `drift_ppm` slow: the offset to the session's grows by that."""

    def __init__(self, rng):
        self.offset_ns = int(rng.integers(-(10**15), 10**15))
        self.drift_ppm = float(rng.uniform(-100, 100))

    def device_ns(self, session_ns):
        return round((session_ns - self.offset_ns) / (1 + self.drift_ppm * 1e-6))

    def offset_at_ns(self, device_ns):
        return self.offset_ns + device_ns * self.drift_ppm * 1e-6


def after_round_trips(rng, device, seconds, way_out_s, way_back_s):
    mapping = ClockMapping()
    for t_s in np.arange(0, seconds, 0.5):
        sent = round(t_s * S)
        there = sent + round(rng.exponential(way_out_s) * S) + 100_000
        back = there + round(rng.exponential(way_back_s) * S) + 100_000
        mapping = add_round_trip(mapping, sent, device.device_ns(there), back)
    return mapping


def after_arrivals(rng, device, seconds, jitter_s, way_ns, begin_s=0.0):
    mapping = ClockMapping()
    for t_s in np.arange(begin_s, begin_s + seconds, 1 / 30):
        taken = round(t_s * S)
        came = taken + way_ns + round(rng.exponential(jitter_s) * S)
        mapping = add_arrival(mapping, device.device_ns(taken), came)
    return mapping


@pytest.mark.parametrize(("out_s", "back_s"), [(0.002, 0.002), (0.001, 0.02), (0.03, 0.001)])
@pytest.mark.parametrize("seconds", [1, 10, 90])
def test_round_trips_cover_the_truth_however_the_ways_differ(out_s, back_s, seconds):
    covered = drifts = 0
    for seed in range(RUNS):
        rng = np.random.default_rng(seed)
        device = Device(rng)
        found = estimate(after_round_trips(rng, device, seconds, out_s, back_s))
        error_ns = found.offset_ns - device.offset_at_ns(found.device_ns)
        covered += abs(error_ns) <= 2 * found.offset_sigma_ns
        drifts += abs(found.drift_ppm - device.drift_ppm) <= 2 * found.drift_sigma_ppm
        assert not found.is_one_way
    assert min(covered, drifts) >= 0.95 * RUNS


def test_round_trips_know_more_the_longer_they_last():
    rng = np.random.default_rng(5)
    device = Device(rng)
    short, long = (
        estimate(after_round_trips(rng, device, seconds, 0.002, 0.002)) for seconds in (5, 60)
    )
    assert long.drift_sigma_ppm < 10 < short.drift_sigma_ppm
    assert long.offset_sigma_ns < 500_000


@pytest.mark.parametrize("jitter_s", [0.0003, 0.003, 0.03])
@pytest.mark.parametrize("seconds", [2, 8, 30, 70])
def test_arrivals_cover_drift_and_offset_up_to_the_way(jitter_s, seconds):
    way_ns = 40_000_000
    covered = drifts = 0
    for seed in range(RUNS):
        rng = np.random.default_rng(1000 + seed)
        device = Device(rng)
        found = estimate(after_arrivals(rng, device, seconds, jitter_s, way_ns))
        error_ns = found.offset_ns - device.offset_at_ns(found.device_ns) - way_ns
        covered += abs(error_ns) <= 2 * found.offset_sigma_ns
        drifts += abs(found.drift_ppm - device.drift_ppm) <= 2 * found.drift_sigma_ppm
        assert found.is_one_way
    assert min(covered, drifts) >= 0.95 * RUNS, (covered, drifts)


def test_a_stretch_of_congestion_does_not_bend_the_drift():
    rng = np.random.default_rng(3)
    device = Device(rng)
    mapping = ClockMapping()
    for t_s in np.arange(0, 60, 1 / 30):
        taken = round(t_s * S)
        held = 300_000_000 if 50 < t_s < 58 else 0
        came = taken + 5_000_000 + held + round(rng.exponential(0.001) * S)
        mapping = add_arrival(mapping, device.device_ns(taken), came)
    found = estimate(mapping)
    assert mapping.restarts == 0
    assert abs(found.drift_ppm - device.drift_ppm) < 20


def test_session_time_of_an_instant_and_how_sure_it_is():
    rng = np.random.default_rng(8)
    device = Device(rng)
    found = estimate(after_arrivals(rng, device, 60, 0.001, 0))
    later = device.device_ns(80 * S)
    assert abs(found.session_ns(later) - 80 * S) < 2 * found.sigma_ns(later)
    assert found.sigma_ns(later) > found.sigma_ns(found.device_ns)


@pytest.mark.parametrize("new_ns", [0, 10**16])
def test_a_camera_that_starts_again_is_a_new_clock(new_ns):
    rng = np.random.default_rng(4)
    mapping = after_arrivals(rng, Device(rng), 20, 0.001, 0)
    for k in range(30):
        mapping = add_arrival(mapping, new_ns + k * S // 30, 30 * S + k * S // 30)
    assert mapping.restarts == 1
    assert estimate(mapping).session_ns(new_ns) == 30 * S


def test_round_trips_of_a_clock_that_was_set_begin_anew():
    rng = np.random.default_rng(4)
    mapping = after_round_trips(rng, Device(rng), 20, 0.001, 0.001)
    mapping = add_round_trip(mapping, 30 * S, 77, 30 * S + 1000)
    assert mapping.restarts == 1
    assert estimate(mapping).offset_ns == 30 * S + 500 - 77


def test_a_drift_that_changes_is_followed():
    mapping = ClockMapping()
    for half in range(120):
        sent = half * S // 2
        drift = 0 if half < 60 else (sent - 30 * S) * 50 // 1_000_000
        mapping = add_round_trip(mapping, sent, sent + 50_000 - drift, sent + 100_000)
    found = estimate(mapping)
    assert abs(found.drift_ppm - 50) <= 2 * found.drift_sigma_ppm < 20
    assert mapping.restarts == 0


def test_nothing_is_known_of_nothing():
    assert estimate(ClockMapping()) is None


def test_a_trip_that_ends_before_it_begins_is_refused():
    with pytest.raises(ValueError, match="received at 4 ns, sent at 5 ns"):
        add_round_trip(ClockMapping(), 5, 0, 4)


@given(
    st.lists(
        st.tuples(st.integers(-(10**18), 10**18), st.integers(0, 10**12), st.integers(0, 10**9)),
        max_size=150,
    )
)
def test_any_samples_leave_a_bounded_state_and_finite_estimates(samples):
    mapping, now_ns = ClockMapping(), 0
    for device_ns, step_ns, trip_ns in samples:
        now_ns += step_ns
        mapping = add_arrival(mapping, device_ns, now_ns)
        mapping = add_round_trip(mapping, now_ns, device_ns, now_ns + trip_ns)
        assert len(mapping.trips) <= MAX_BINS
        assert len(mapping.arrivals) <= MAX_BINS
        found = estimate(mapping)
        assert np.isfinite([found.drift_ppm, found.offset_sigma_ns, found.drift_sigma_ppm]).all()
        assert abs(found.drift_ppm) <= 501
