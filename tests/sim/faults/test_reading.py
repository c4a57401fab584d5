"""`[faults]` of a scenario: what is read, what is refused, and what is there when."""

from __future__ import annotations

import math

import pytest

from sim.faults.device import Bump, Freeze, HeadsetOff
from sim.faults.fault import Fault, Span
from sim.faults.light import Blur, Exposure, WhiteBalance
from sim.faults.occluder import Occluder
from sim.faults.settings import LINES, NUMBERS, Faults
from sim.faults.twins import Twins
from sim.faults.way import Burst, ClockDrift, Delay, HiddenCode, Loss
from sim.scenarios.scenario import parse_scenario, validate_scenario
from sim.tables import ScenarioError

HEAD = """
room = "small"
duration_s = 2
[[people]]
id = "ann"
start = [-1.5, -1.5]
[faults]
"""
ALL = """
dropped_frames = [3]
drop_share = 0.1
delay_ms = 100
jitter_ms = 9
bump_s = 1.5
bump_deg = 2
clock_drift_ppm = -200
blur = { px = 2, kind = "motion", angle_deg = 30, from_s = 1 }
burst = { lasts_s = 0.3, every_s = 2, from_s = 0.5 }
exposure = [{ ev = -1, to_s = 0.5 }, { ev = 0.5, from_s = 0.4, lasts_s = 0.6 }]
freeze = { from_s = 0.6, to_s = 0.9 }
headset_off = { person = "ann" }
hidden_code = { lasts_s = 0.4 }
occluder = { object = "chair-1", share = 0.6 }
twins = { object = "chair-1", at = [0.5, -1.0], yaw_deg = 45 }
white_balance = { warmth = 0.2 }
"""


def faults_of(text: str) -> Faults:
    return parse_scenario(HEAD + text, source="f.toml").faults


def test_every_fault_is_read():
    each = faults_of(ALL).each
    assert each == (
        Loss(frozenset({3}), 0.1),
        Delay(100.0, 9.0),
        Bump(1.5, 2.0, 0.5),
        ClockDrift(-200.0),
        Blur(2.0, "motion", 30.0, Span(1.0)),
        Burst(0.3, 2.0, 0.5),
        Exposure(-1.0, Span(0.0, 0.5)),
        Exposure(0.5, Span(0.4, 1.0)),
        Freeze(Span(0.6, 0.9)),
        HeadsetOff("ann"),
        HiddenCode(Span(0.0, 0.4)),
        Occluder("chair-1", 0.6),
        Twins("chair-1", (0.5, -1.0), 1, 45.0),
        WhiteBalance(0.2),
    )
    assert {type(fault) for fault in each} == {*NUMBERS, *LINES}


def test_without_faults_there_is_the_usual_delay():
    assert faults_of("").each == Faults().each == (Loss(), Delay())
    assert faults_of("").sizes(1.0) == {}
    assert not faults_of("").described(1.0)


def test_names_are_different():
    names = [kind.name for kind in (*NUMBERS, *LINES)]
    assert len(set(names)) == len(names)


def test_sizes_say_what_is_there_at_a_moment():
    faults = faults_of(ALL)
    first, later = faults.sizes(0.45), faults.sizes(1.6)
    assert first["exposure"] == -1.0  # the larger of two
    assert (first["delay_ms"], first["drop_share"], first["clock_drift_ppm"]) == (100.0, 0.1, -200)
    assert (first["twins"], first["white_balance"], first["headset_off"]) == (1.0, 0.2, 1.0)
    assert not {"bump", "blur", "freeze", "hidden_code", "burst"} & set(first)
    assert faults.sizes(0.39)["hidden_code"] == 1.0
    assert faults.sizes(0.75)["freeze"] == pytest.approx(0.15)
    assert faults.sizes(0.75)["burst"] == 0.3
    assert later["bump"] == 2.0
    assert later["blur"] == 2.0
    assert not {"exposure", "freeze", "burst"} & set(later)
    assert faults.sizes(2.6)["burst"] == 0.3  # two seconds after the first


def test_words_of_what_is_there_and_figures_have_none():
    words = list(faults_of(ALL).described(0.7))
    assert "something hides 60% of chair-1" in words
    assert "the camera's picture is frozen" in words
    assert not any("delay" in text or "bump" in text for text in words)
    assert all(text for text in words)


def test_a_span_ends_before_its_end():
    span = Span(1.0, 2.0)
    assert [span.holds(t) for t in (0.9, 1.0, 1.9, 2.0)] == [False, True, True, False]
    assert span.lasts_s == 1.0
    assert math.isinf(Span().to_s)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("blurr = { px = 2 }", ("faults.blurr", "no such key", "blur")),
        ("blur = { px = 2, size = 3 }", ("faults.blur.size", "no such key")),
        ("blur = { px = -2 }", ("faults.blur.px", "-2", "0..50")),
        ('blur = { px = 2, kind = "radial" }', ("faults.blur.kind", "'radial'", "defocus or")),
        ("blur = 3", ("faults.blur", "3", "a list")),
        ("exposure = { from_s = 1 }", ("faults.exposure.ev", "missing")),
        ("freeze = { from_s = 2, to_s = 1 }", ("faults.freeze.to_s", "1", "from_s = 2")),
        ("freeze = { to_s = 1, lasts_s = 1 }", ("faults.freeze.lasts_s", "not both")),
        ('occluder = { object = "chair-1", share = 0.95 }', ("faults.occluder.share", "0..0.9")),
        ("clock_drift_ppm = 1e6", ("faults.clock_drift_ppm", "-5000..5000")),
        ("exposure = [{ ev = 1 }, { ev = 9 }]", ("faults.exposure[1].ev", "9")),
    ],
)
def test_a_wrong_fault_is_one_clear_line(text, words):
    with pytest.raises(ScenarioError) as caught:
        faults_of(text)
    message = str(caught.value)
    assert message.startswith("f.toml: ")
    assert "\n" not in message
    for word in words:
        assert word in message


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ('occluder = { object = "sofa", share = 0.5 }', ("faults.occluder.object", "'sofa'")),
        ('twins = { object = "sofa", at = [0, 0] }', ("faults.twins.object", "book-1, chair-1")),
        ('twins = { object = "book-1", at = [0, 9] }', ("faults.twins.at", "9.0", "y -2..2")),
        (
            'twins = { object = "book-1", at = [0, 0], count = 4 }',
            ("faults.twins.at", "2.4", "x -2..2"),
        ),
        ('headset_off = { person = "bob" }', ("faults.headset_off.person", "'bob'", "ann")),
    ],
)
def test_a_fault_of_what_is_not_there_is_refused(small_room, text, words):
    with pytest.raises(ScenarioError) as caught:
        validate_scenario(parse_scenario(HEAD + text, source="f.toml"), small_room)
    for word in ("f.toml", *words):
        assert word in str(caught.value)


def test_a_new_fault_says_its_sizes():
    for kind in (*NUMBERS, *LINES):
        assert issubclass(kind, Fault)
        assert kind.sizes
        assert all(key and unit for key, unit in kind.sizes.items())
