"""The valid inputs of the stream parsers reach what they are meant for."""

import pytest

from benchmarks.wire.fuzz import PICTURE, targets
from benchmarks.wire.fuzz_streams import stream_targets


@pytest.mark.parametrize("name", sorted(stream_targets(PICTURE)))
def test_each_is_a_target_and_reads_what_is_valid(name):
    assert name in targets()
    valid, read, _refused = stream_targets(PICTURE)[name]
    for data in valid:
        read(data)
