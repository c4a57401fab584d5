"""A bucket gives so many tokens a second."""

from devices.hub.entry.rates import Bucket

SECOND = 10**9


def test_a_burst_then_the_rate():
    bucket = Bucket(10.0, 5.0, now_ns=0)
    assert [bucket.take(0) for _ in range(6)] == [True] * 5 + [False]
    assert bucket.take(SECOND // 10)
    assert not bucket.take(SECOND // 10)
    assert sum(bucket.take(100 * SECOND) for _ in range(20)) == 5


def test_over_a_minute_no_more_than_the_rate():
    bucket = Bucket(10.0, 5.0, now_ns=0)
    taken = sum(bucket.take(step * SECOND // 1000) for step in range(60_000))
    assert abs(taken - 605) <= 1


def test_several_at_once_or_none():
    bucket = Bucket(1.0, 100.0, now_ns=0)
    assert not bucket.take(0, 101.0)
    assert bucket.take(0, 100.0)


def test_a_clock_that_goes_back_fills_nothing():
    bucket = Bucket(1.0, 1.0, now_ns=10 * SECOND)
    assert bucket.take(10 * SECOND)
    assert not bucket.take(0)
    assert not bucket.take(10 * SECOND)
    assert bucket.take(11 * SECOND)
