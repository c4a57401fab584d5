import math

import pytest

from sim.headset.faults import (
    HeadsetFault,
    HeadsetFaultKind,
    HeadsetState,
    headset_state,
    read_headset_faults,
)
from sim.timed_fault import FaultError


def test_faults_are_read_and_there_when_they_should_be():
    faults = read_headset_faults(
        ["loss", "jitter:size=0.1", "black_hole:at=5,for=2", "sleep:at=3,for=1", "off:at=4,for=9"]
    )
    assert faults[0] == HeadsetFault(HeadsetFaultKind.LOSS, 0.0, math.inf, 0.05)
    assert headset_state(faults, 1.0) == HeadsetState(loss=0.05, jitter_s=0.1)
    assert headset_state(faults, 1.0).shows_body
    assert headset_state(faults, 3.5).is_asleep
    assert headset_state(faults, 4.5) == HeadsetState(0.05, 0.1, is_off=True)
    assert headset_state(faults, 5.0).is_cut
    assert not headset_state(faults, 7.0).is_cut
    assert not headset_state(faults, 7.0).shows_body


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("rain", "kind 'rain', wanted one of loss, jitter, sleep, off, black_hole"),
        ("loss:much", "'much', wanted at="),
        ("loss:at=soon", "wanted a number"),
        ("loss:size=2", "size=2, wanted 0 to 1"),
        ("jitter:size=-1", "wanted 0 to 0.5 s"),
        ("sleep:for=0", "wanted more than 0 s"),
        ("off:at=nan", "at=nan"),
        ("off:for=nan", "for=nan"),
    ],
)
def test_what_is_no_fault_is_one_line(text, said):
    with pytest.raises(FaultError) as refused:
        read_headset_faults([text])
    assert said in str(refused.value)


def test_there_are_not_too_many():
    with pytest.raises(match="101, wanted at most 100"):
        read_headset_faults(["loss"] * 101)
