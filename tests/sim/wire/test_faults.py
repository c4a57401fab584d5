import math
from contextlib import suppress

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.faults.device import Bump
from sim.faults.light import Exposure
from sim.timed_fault import FaultError
from sim.wire.faults import (
    RANGES,
    FaultKind,
    FaultSchedule,
    WireFault,
    WireState,
    film_faults,
    read_fault,
    read_faults_file,
)

S = 1_000_000_000


def schedule(*faults):
    return FaultSchedule(WireFault(FaultKind(kind), *values) for kind, *values in faults)


def test_each_fault_is_there_from_its_begin_to_before_its_end():
    made = schedule(("delay", 1, 2, 0.4), ("black_hole", 2, 1, 1))
    assert made.at(S - 1) == WireState()
    assert made.at(S) == WireState(delay_s=0.4)
    assert made.at(2 * S) == WireState(delay_s=0.4, black_hole=True)
    assert made.at(3 * S) == WireState()


def test_of_two_of_a_kind_the_larger_holds():
    made = schedule(("loss", 0, 9, 0.1), ("loss", 1, 1, 0.3))
    assert [made.at(t * S).loss for t in (0, 1, 2)] == [0.1, 0.3, 0.1]


def test_a_camera_that_is_away_or_vanished_is_not_on():
    made = schedule(("restart", 1, 1, 1), ("half_open", 3, 1, 1))
    assert [made.at(t * S).is_on for t in range(5)] == [True, False, True, False, True]


def test_a_drifting_clock_runs_on_from_where_it_was():
    made = schedule(("clock_drift", 10, 20, 1000))
    assert made.stamp_ns(10 * S) == 10 * S
    assert made.stamp_ns(20 * S) == 20 * S + 10_000_000
    assert made.stamp_ns(50 * S) == 50 * S + 20_000_000


def test_a_restart_begins_stamps_and_drift_anew():
    made = schedule(("restart", 5, 5, 1), ("clock_drift", 0, math.inf, -1000))
    assert made.stamp_ns(5 * S) == 5 * S - 5_000_000
    assert made.stamp_ns(10 * S) == 0
    assert made.stamp_ns(30 * S) == 20 * S - 20_000_000
    assert [made.boot(t * S) for t in (0, 9, 10)] == [0, 0, 1]


STEPS = st.lists(st.integers(1, 5 * S), max_size=9)


@given(st.lists(st.tuples(st.floats(0, 9), st.floats(0.01, 5)), max_size=5), STEPS)
def test_looked_at_in_any_steps_every_begin_and_end_is_seen_once(spans, steps):
    made = schedule(*(("freeze", at, lasts, 1) for at, lasts in spans))
    seen = []
    before = -1
    for step in (*steps, 20 * S):
        now = before + step
        seen += made.between(before, now)
        before = now
    assert sum(begins for _, begins in seen) == len(spans)
    assert len(seen) == 2 * len(spans)


def test_bumps_and_light_are_drawn_and_not_sent():
    faults = [
        WireFault(FaultKind.BUMP, 3, math.inf, 1.5),
        WireFault(FaultKind.LIGHT, 1, 2, 0.25),
        WireFault(FaultKind.DELAY, 0, 1, 0.1),
    ]
    bump, light = film_faults(faults)
    assert bump == Bump(3, 1.5, 0.0)
    assert isinstance(light, Exposure)
    assert (light.ev, light.span.from_s, light.span.to_s) == (-2.0, 1, 3)
    assert [fault.kind for fault in FaultSchedule(faults).faults] == [FaultKind.DELAY]


@pytest.mark.parametrize("kind", FaultKind)
def test_sizes_beyond_the_range_are_refused(kind):
    usual = RANGES[kind]
    WireFault(kind, 0, usual.usual_for_s, usual.usual)
    for size in (usual.low - 1, usual.high + 1):
        with pytest.raises(FaultError, match=f"{kind}: size"):
            WireFault(kind, 0, 1, size)


def test_there_is_a_limit_of_faults():
    with pytest.raises(FaultError, match="1001"):
        schedule(*([("delay", 0, 1, 0.1)] * 1001))


def test_what_is_not_said_is_usual():
    assert read_fault("restart") == WireFault(FaultKind.RESTART, 0.0, 3.0, 1.0)
    assert read_fault("delay:size=0.2") == WireFault(FaultKind.DELAY, 0.0, math.inf, 0.2)


@given(st.sampled_from(FaultKind), st.floats(0, 1000), st.floats(0.001, 1000), st.floats(0, 1))
def test_what_is_written_is_read(kind, at_s, for_s, share):
    usual = RANGES[kind]
    fault = WireFault(kind, at_s, for_s, usual.low + share * (usual.high - usual.low))
    text = f"{kind}: at={fault.at_s!r}, for={fault.for_s!r}, size={fault.size!r}"
    assert read_fault(text) == fault


@given(st.text(max_size=40))
def test_any_text_is_read_or_refused(text):
    with suppress(FaultError):
        assert isinstance(read_fault(text), WireFault)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("flood", "wanted one of delay"),
        ("delay:at", "wanted at="),
        ("delay:at=soon", "a number"),
        ("delay:when=3", "'when'"),
        ("delay:at=nan", "a number"),
        ("delay:at=-1", "at=-1"),
        ("delay:for=0", "for=0"),
        ("loss:size=2", "0 to 1"),
    ],
)
def test_what_is_wrong_is_named(text, why):
    with pytest.raises(FaultError, match=why):
        read_fault(text)


def test_a_file_holds_several(tmp_path):
    path = tmp_path / "faults.toml"
    path.write_text('[[fault]]\nkind = "loss"\nat = 2\nsize = 0.5\n[[fault]]\nkind = "restart"\n')
    loss, restart = read_faults_file(path)
    assert (loss.kind, loss.at_s, loss.size) == (FaultKind.LOSS, 2.0, 0.5)
    assert restart.kind is FaultKind.RESTART


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("[[fault]\n", "no TOML"),
        ("other = 1\n", "other"),
        ("fault = 3\n", "wanted tables"),
        ("fault = [3]\n", r"fault\[0\]"),
        ('[[fault]]\nkind = "delay"\nat = true\n', "at=True"),
    ],
)
def test_a_bad_file_is_refused_with_its_name(text, why, tmp_path):
    path = tmp_path / "faults.toml"
    path.write_text(text)
    with pytest.raises(FaultError, match=why) as caught:
        read_faults_file(path)
    assert str(path) in str(caught.value)
