"""Hostile bytes at both ends of a HoloLens, and its figures, briefly."""

from __future__ import annotations

import pytest

from benchmarks.wire.attack_hololens import attack_client, attack_simulator
from benchmarks.wire.fuzz import fuzz, targets
from benchmarks.wire.fuzz_hololens import hololens_targets
from benchmarks.wire.hololens_load import measure_clock, worst


@pytest.mark.parametrize("name", hololens_targets())
def test_parsers_read_or_refuse(name):
    assert name in targets()
    counts = fuzz(name, 300, 5)
    assert counts.read + counts.refused == 300


def test_a_simulated_headset_stands_hostile_clients():
    assert attack_simulator(10).crashes == 0


def test_a_client_stands_hostile_headsets():
    assert attack_client(10).crashes == 0


@pytest.mark.slow
def test_the_clock_s_error_is_a_fraction_of_a_millisecond():
    assert worst(measure_clock(seed=0, jitter_s=0.005, drift_ppm=50.0)) < 1.0
