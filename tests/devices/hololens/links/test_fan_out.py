"""Every consumer has the newest, and no queue grows."""

from __future__ import annotations

import numpy as np
import pytest

from devices.hololens.links.fan_out import MAX_CONSUMERS, FanOut, SurfaceFanOut
from devices.hololens.values import SpatialSurface, SurfaceGone
from scenes.pose import Pose


def surface(name, version):
    return SpatialSurface(
        name, version, 0, np.zeros((0, 3)), np.zeros((0, 3), np.int32), Pose.identity()
    )


def test_each_consumer_has_the_newest():
    fan_out = FanOut[int]()
    slow, fast = fan_out.subscribe(), fan_out.subscribe()
    for value in range(3):
        fan_out.put(value)
        assert fast.take() == value
    assert slow.take() == 2
    assert slow.take() is None
    assert slow.dropped == 2
    assert fan_out.dropped == 2
    assert fan_out.subscribe().take() == 2


def test_who_has_left_gets_nothing_and_counts_nothing():
    fan_out = FanOut[int]()
    left = fan_out.subscribe()
    left.close()
    fan_out.put(1)
    assert left.take() is None
    assert fan_out.dropped == 0
    fan_out.close()
    assert fan_out.subscribe().take(5.0) == 1


def test_consumers_are_limited():
    fan_out = FanOut[int]()
    for _ in range(MAX_CONSUMERS):
        fan_out.subscribe()
    with pytest.raises(RuntimeError, match="close those not needed"):
        fan_out.subscribe()


def test_of_each_surface_only_the_newest_change_waits():
    fan_out = SurfaceFanOut()
    consumer = fan_out.subscribe()
    for version in range(5):
        fan_out.put(surface("a", version))
    fan_out.put(surface("b", 0))
    assert [(c.id, c.version) for c in consumer.take()] == [("a", 4), ("b", 0)]
    fan_out.put(surface("a", 5))
    fan_out.put(SurfaceGone("a", 9))
    assert consumer.take() == [SurfaceGone("a", 9)]
    assert fan_out.versions() == {"b": 0}
    assert len(fan_out) == 1


def test_who_comes_later_gets_all_surfaces():
    fan_out = SurfaceFanOut()
    fan_out.put(surface("a", 1))
    consumer = fan_out.subscribe()
    assert [change.id for change in consumer.take()] == ["a"]
    consumer.close()
    assert consumer.take(5.0) == []
