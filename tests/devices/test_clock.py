from devices.clock import ManualClock, WallClock


def test_manual_clock_moves_only_when_told_and_never_back():
    clock = ManualClock()
    assert clock.now_ns() == 0
    clock.sleep_until(5)
    clock.sleep_until(3)
    assert clock.now_ns() == 5


def test_wall_clock_sleeps_until_a_time_and_past_times_return_at_once():
    clock = WallClock()
    clock.sleep_until(2_000_000)
    reached = clock.now_ns()
    assert reached >= 2_000_000
    clock.sleep_until(0)
    assert clock.now_ns() - reached < 1_000_000_000
