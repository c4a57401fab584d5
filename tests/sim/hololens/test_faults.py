"""Faults as text, and at a moment."""

from __future__ import annotations

import pytest

from sim.hololens.faults import HoloLensFaultKind, read_hololens_faults


def test_faults_are_there_while_they_last():
    faults = read_hololens_faults(["jitter:at=1,for=2,size=0.01", "jitter:size=0.02", "stall:at=5"])
    assert faults.size_of(HoloLensFaultKind.JITTER, 0.5) == 0.02
    assert faults.size_of(HoloLensFaultKind.JITTER, 1.5) == pytest.approx(0.03)
    assert not faults.is_there(HoloLensFaultKind.STALL, 4.9)
    assert faults.is_there(HoloLensFaultKind.STALL, 6.9)
    assert not faults.is_there(HoloLensFaultKind.STALL, 7.1)


def test_the_world_shifts_and_slides_for_good():
    faults = read_hololens_faults(["shift:at=2,size=0.1", "slide:at=4,for=10,size=0.002"])
    assert faults.shift_m(1.9) == 0
    assert faults.shift_m(3.0) == pytest.approx(0.1)
    assert faults.shift_m(9.0) == pytest.approx(0.11)
    assert faults.shift_m(99.0) == pytest.approx(0.12)


def test_drift_is_of_the_whole_time():
    assert read_hololens_faults(["drift:size=50", "drift:size=-20"]).drift_ppm == 30.0


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("flood", "wanted one of delay"),
        ("jitter:size=9", "wanted 0 to 0.5 s"),
        ("jitter:at=-1", "wanted 0 to 86400"),
        ("jitter:for=0", "more than 0 s"),
        ("jitter:often=1", "wanted some of at, for, size"),
        ("jitter:at=soon", "wanted a number"),
    ],
)
def test_faults_that_are_none_say_what_is_wanted(text, words):
    with pytest.raises(match=words):
        read_hololens_faults([text])


def test_faults_are_limited():
    with pytest.raises(match="101, wanted at most 100"):
        read_hololens_faults(["lost"] * 101)
