"""The reckoning: costs come back that a building was made with; queues wait as they must."""

import numpy as np
import pytest

from benchmarks.sites.building import BuildingFigures
from benchmarks.sites.load import Costs, bundles_hz, error_percent, fit_costs, load_of
from benchmarks.sites.thousand import FULL, periodic_arrivals, reckon, wait_at, waiting_times

TRUE = Costs(
    np.array([0.01, 1e-5, 1e-9]),
    np.array([0.02, 0.03, 1e-5]),
    np.array([0.05, 0.05, 2e-4, 5e-6]),
    np.array([1e4, 600.0]),
    np.array([1e2, 590.0]),
)


def building(rooms, clients, hz=72.0):
    """A building as it would be measured, if costs were these."""
    load = load_of(TRUE, rooms=rooms, clients=clients, sites=1, hz=hz)
    passed = bundles_hz(clients, hz) * clients
    return BuildingFigures(
        rooms,
        clients,
        hz,
        load.router_cpu,
        TRUE.room_cpu[0] + rooms * float(TRUE.room_cpu[1:] @ (1.0, passed)),
        TRUE.site_cpu[0] + rooms * float(TRUE.site_cpu[1:] @ (1.0, clients * hz, clients**2 * hz)),
        12.0 + bundles_hz(clients, hz),
        float(TRUE.room_bytes @ (1.0, passed)),
        2.0 + bundles_hz(clients, hz),
        float(TRUE.site_bytes @ (1.0, passed)),
        1e5,
        1.0,
        (10.0, 20.0, 30.0),
    )


@pytest.fixture
def costs():
    return fit_costs([building(1, 1), building(1, 4), building(1, 16), building(4, 2, 10.0)])


def test_costs_that_a_building_was_made_with_come_back(costs):
    np.testing.assert_allclose(costs.room_cpu, TRUE.room_cpu, rtol=1e-6)
    np.testing.assert_allclose(costs.site_bytes, TRUE.site_bytes, rtol=1e-6)
    assert abs(error_percent(costs, building(16, 2, 10.0))) < 1.0


def test_an_error_is_said_of_what_was_measured(costs):
    measured = building(16, 2, 10.0)
    half = BuildingFigures(
        *(
            getattr(measured, name) / (2 if name.endswith("cpu") else 1)
            for name in BuildingFigures.__dataclass_fields__
            if name != "age_ms"
        ),
        measured.age_ms,
    )
    assert error_percent(costs, half) == pytest.approx(100.0, abs=2.0)


def test_a_thousand_rooms_name_what_is_full_first(costs):
    first = reckon(costs, rooms=1000, clients=20, sites=2, hz=72.0, seed=3)
    assert first == reckon(costs, rooms=1000, clients=20, sites=2, hz=72.0, seed=3)
    assert first.utilisation[first.bottleneck] == max(first.utilisation.values())
    assert first.bottleneck == "router's network"
    assert first.routers == -(-1000 // first.rooms_a_router)
    assert first.at_router.utilisation < FULL * 1.1
    more = reckon(costs, rooms=2000, clients=20, sites=2, hz=72.0, seed=3)
    assert more.routers >= 2 * first.routers - 1
    assert more.site_people == first.site_people


def test_waiting_is_as_of_a_queue_of_one():
    generator = np.random.default_rng(0)
    arrivals = np.cumsum(generator.exponential(1.0, 400_000))
    waiting = wait_at(arrivals, 0.5, generator=generator)
    # M/M/1 at half load: the wait is 0 for half of them, beyond it exponential of mean 1 s.
    assert waiting.utilisation == pytest.approx(0.5, abs=0.01)
    assert waiting.wait_ms[1] == pytest.approx(1000 * np.log(10), rel=0.05)


def test_nobody_waits_at_an_idle_machine_and_everybody_behind_a_slow_one():
    arrivals = np.arange(4.0)
    assert waiting_times(arrivals, np.full(4, 0.5)).tolist() == [0, 0, 0, 0]
    assert waiting_times(arrivals, np.full(4, 2.0)).tolist() == [0, 1, 2, 3]


def test_arrivals_are_in_order_and_bounded():
    generator = np.random.default_rng(0)
    times = periodic_arrivals(50, 90.0, seconds=1.0, generator=generator)
    assert len(times) == 50 * 90
    assert np.all(np.diff(times) >= 0)
    with pytest.raises(ValueError, match="at most"):
        periodic_arrivals(10**6, 90.0, seconds=1.0, generator=generator)
