"""The valid inputs of parsers between machines reach what they are meant for."""

import pytest

from benchmarks.wire.fuzz import fuzz, targets
from benchmarks.wire.fuzz_sites import site_targets


@pytest.mark.parametrize("name", sorted(site_targets()))
def test_each_is_a_target_and_reads_what_is_valid(name):
    assert name in targets()
    valid, read, _refused = site_targets()[name]
    for data in valid:
        read(data)
    counts = fuzz(name, 300)
    assert counts.refused > 0
