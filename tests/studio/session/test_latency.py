import pytest

from studio.session.latency import KEPT, Latencies


def filled(count):
    latencies = Latencies()
    for number in range(count):
        latencies.add({"track": number * 1_000_000})
    return latencies


def test_the_newest_durations_count_and_the_oldest_make_room():
    (stage,) = filled(KEPT + 100).stages()
    assert stage.count == KEPT
    assert stage.p50_ms == pytest.approx(100 + (KEPT - 1) / 2)


def test_few_can_be_asked_for():
    (stage,) = filled(KEPT + 100).stages(last=10)
    assert stage.count == 10
    assert stage.p50_ms == pytest.approx(KEPT + 100 - 5.5)
    (stage,) = filled(3).stages(last=10)
    assert stage.count == 3
    assert stage.p50_ms == pytest.approx(1.0)


def test_methods_beside_the_first_have_names_of_their_own():
    latencies = filled(1)
    latencies.add({"track": 5_000_000}, prefix="paper")
    assert {row.name for row in latencies.rows()} >= {
        "stage.track.ms.p50",
        "stage.paper.track.ms.p95",
    }
