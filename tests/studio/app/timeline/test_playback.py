import pytest

from devices.clock import ManualClock
from studio.app.timeline.playback import Playback

FRAMES = [0, 100, 200, 300]


@pytest.fixture
def clock():
    return ManualClock()


@pytest.fixture
def playback(clock):
    return Playback(FRAMES, start_ns=0, end_ns=300, clock=clock)


def test_it_plays_at_its_speed_and_stops_at_the_end(playback, clock):
    playback.change_speed(1)
    playback.play()
    clock.sleep_until(50)
    assert playback.t_ns == 100
    clock.sleep_until(999)
    assert (playback.t_ns, playback.is_playing) == (300, False)
    playback.play()
    assert (playback.t_ns, playback.is_playing) == (0, True)


def test_it_loops(playback, clock):
    playback.is_looping = True
    playback.play()
    clock.sleep_until(350)
    assert (playback.t_ns, playback.is_playing) == (50, True)


@pytest.mark.parametrize("plays", [True, False])
def test_a_seek_keeps_whether_it_plays(playback, plays):
    if plays:
        playback.play()
    playback.seek(120)
    assert (playback.t_ns, playback.is_playing) == (120, plays)
    playback.seek(9999)
    assert playback.t_ns == 300


def test_it_steps_by_frames(playback):
    playback.play()
    playback.seek(150)
    playback.step(1)
    assert (playback.t_ns, playback.is_playing) == (200, False)
    playback.step(-1)
    assert playback.t_ns == 100
    playback.step(-5)
    assert playback.t_ns == 0


def test_speeds_end_at_a_quarter_and_at_eight(playback):
    playback.change_speed(-9)
    assert playback.speed == 0.25
    playback.change_speed(9)
    assert playback.speed == 8.0


def test_it_jumps_to_marks(playback):
    playback.seek(100)
    assert playback.jump([250, 50, 150, 100], forward=True)
    assert playback.t_ns == 150
    assert playback.jump([250, 50], forward=False)
    assert playback.t_ns == 50
    assert not playback.jump([50, 900], forward=True)
