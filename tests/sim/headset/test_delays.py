import numpy as np
import pytest

from sim.headset.tally import BIN_MS, Delays


def test_percentiles_are_those_of_all_delays():
    values = np.random.default_rng(1).gamma(2.0, 3.0, 5000)
    delays = Delays()
    assert delays.percentile(50) is None
    for value in values:
        delays.add(value)
    for share in (1, 50, 95, 100):
        assert delays.percentile(share) == pytest.approx(np.percentile(values, share), abs=BIN_MS)


def test_what_is_out_of_range_counts_at_its_end():
    delays = Delays()
    for value in (-5.0, 1e9):
        delays.add(value)
    assert delays.count == 2
    assert delays.percentile(50) < BIN_MS
    assert delays.percentile(100) > 9990
