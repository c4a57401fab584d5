from __future__ import annotations

import math
from dataclasses import dataclass
from enum import StrEnum

import pytest

from sim.timed_fault import (
    FaultError,
    FaultRange,
    TimedFault,
    fault_of_values,
    read_timed_fault,
    read_timed_faults,
)


class Weather(StrEnum):
    RAIN = "rain"
    FOG = "fog"


RANGES = {
    Weather.RAIN: FaultRange("mm", 2.0, 0.0, 9.0, math.inf),
    Weather.FOG: FaultRange("", 1.0, 1.0, 1.0, 3.0),
}


@dataclass(frozen=True, slots=True)
class WeatherFault(TimedFault):
    ranges = RANGES

    kind: Weather


def test_what_is_not_said_is_usual():
    assert read_timed_fault(WeatherFault, " rain ") == WeatherFault(
        Weather.RAIN, 0.0, math.inf, 2.0
    )
    fog = read_timed_fault(WeatherFault, "fog:at=2, size=1")
    assert (fog.at_s, fog.for_s, fog.end_s) == (2.0, 3.0, 5.0)
    assert [fog.holds(t_s) for t_s in (1.9, 2.0, 4.9, 5.0)] == [False, True, True, False]
    assert fault_of_values(WeatherFault, "rain", values={"size": 3}, source="here").size == 3.0


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("snow", "fault 'snow': kind 'snow', wanted one of rain, fog"),
        ("rain:much", "'much', wanted at=…, for=…, size=…"),
        ("rain:often=1", "'often', wanted some of at, for, size"),
        ("rain:at=soon", "at='soon', wanted a number"),
        ("rain:at=nan", "at=nan, wanted a number"),
        ("rain:at=-1", "at=-1, wanted 0 to 86400 s"),
        ("rain:for=0", "for=0, wanted more than 0 s"),
        ("rain:size=10", "size=10, wanted 0 to 9 mm"),
        ("fog:size=2", "size=2, wanted 1 to 1"),
    ],
)
def test_what_is_none_says_what_is_wanted(text, says):
    with pytest.raises(FaultError) as refused:
        read_timed_fault(WeatherFault, text)
    assert says in str(refused.value)


def test_values_of_a_file_are_numbers():
    for value in (True, "1", None):
        with pytest.raises(FaultError, match=r"f\[0\]: at=.*, wanted a number"):
            fault_of_values(WeatherFault, "fog", values={"at": value}, source="f[0]")


def test_there_are_not_more_than_allowed():
    assert len(read_timed_faults(WeatherFault, ["fog", "rain"], most=2)) == 2
    with pytest.raises(FaultError, match="faults: 3, wanted at most 2"):
        read_timed_faults(WeatherFault, ["fog"] * 3, most=2)
