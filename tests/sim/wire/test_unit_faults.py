import itertools
from random import Random

import numpy as np
import pytest

from devices.messages import EncodedFrame
from devices.video import H264Decoder, H264Encoder
from sim.wire.faults import FaultSchedule, read_fault
from sim.wire.film.film import Film, FilmFormat
from sim.wire.rtsp.packets import parameter_sets
from sim.wire.unit_faults import UnitFaults, still_of, stills_of
from tests.pushed_camera import numbered_pictures, read_number

S = 1_000_000_000


@pytest.fixture(scope="module")
def film():
    """Four seconds at 10 pictures a second, a keyframe every half second."""
    encoder = H264Encoder(320, 160, 10, 1_000_000, keyframe_interval=5)
    units = [
        encoder.encode(picture.rgb, k, picture.t_ns)[0]
        for k, picture in enumerate(numbered_pictures((320, 160), 10, count=40))
    ]
    return Film(
        "numbers",
        FilmFormat(320, 160, 10, "side_by_side", 1_000_000),
        data=b"".join(unit.data for unit in units),
        offsets=np.concatenate([[0], np.cumsum([len(unit.data) for unit in units])]),
        t_ns=np.array([unit.t_ns for unit in units]),
        duration_ns=4 * S,
        keyframes=np.array([unit.keyframe for unit in units]),
        shows=np.arange(40),
    )


def passed(film, *faults, count=40, seed=1):
    schedule = FaultSchedule(map(read_fault, faults))
    made = UnitFaults(film, schedule, Random(seed), stills_of(film, schedule))
    return [unit for number in range(count) if (unit := made.passed(number)) is not None]


def shown(units):
    """The number in every picture."""
    decoder = H264Decoder()
    return [
        read_number(
            decoder.decode(EncodedFrame("film", u.number, u.taken_ns, u.data, u.keyframe))[..., 1]
        )
        for u in units
    ]


def test_without_faults_all_is_as_in_the_film(film):
    units = passed(film, count=80)
    assert [unit.number for unit in units] == list(range(80))
    assert all(u.stamp_ns == u.taken_ns == u.send_ns == film.time_ns(u.number) for u in units)
    assert not any(u.is_lost for u in units)


def test_jitter_is_within_its_size_and_keeps_the_order(film):
    units = passed(film, "delay:size=0.3", "jitter:size=0.4")
    late = [unit.send_ns - unit.taken_ns for unit in units]
    assert min(late) >= 0.3 * S
    assert max(late) < 0.7 * S
    assert max(late) - min(late) > 0.1 * S
    assert all(a.send_ns <= b.send_ns for a, b in itertools.pairwise(units))


def test_the_share_that_is_lost_is_the_one_that_was_asked_for(film):
    units = passed(film, "loss:size=0.25", count=4000)
    assert sum(unit.is_lost for unit in units) == pytest.approx(1000, abs=110)
    assert {unit.loss for unit in units} == {0.25}


@pytest.mark.parametrize("kind", ["restart", "half_open"])
def test_a_camera_that_comes_back_begins_with_a_keyframe(film, kind):
    units = passed(film, f"{kind}:at=1.1,for=0.6")
    before = [unit for unit in units if unit.taken_ns < 1.1 * S]
    after = units[len(before) :]
    assert len(before) == 11
    assert after[0].keyframe
    assert after[0].number == 20
    assert shown(units) == [unit.shows for unit in units]
    stamp = 0.3 * S if kind == "restart" else 2 * S
    assert after[0].stamp_ns == pytest.approx(stamp)
    assert after[0].boot == (kind == "restart")


def test_a_freeze_shows_its_first_picture_up_to_a_keyframe_after_it(film):
    units = passed(film, "freeze:at=1.2,for=1")
    assert shown(units) == [*range(12), *[12] * 13, *range(25, 40)]
    assert [unit.shows for unit in units] == [*range(12), *[12] * 13, *range(25, 40)]
    assert [unit.stamp_ns for unit in units] == [film.time_ns(k) for k in range(40)]


def test_a_still_is_a_second_of_one_picture_and_costs_little(film):
    still = still_of(film, 17)
    assert (still.shows, len(still.units)) == (17, 10)
    assert [keyframe for _, keyframe in still.units] == [True] + [False] * 9
    assert parameter_sets(still.units[0][0]) == parameter_sets(film.unit(0).data)
    assert max(len(data) for data, _ in still.units[2:]) < len(still.units[0][0]) / 2
