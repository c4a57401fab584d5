from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.studio.soaking import (
    Sample,
    Sampler,
    growth_rows,
    read_samples,
    scenario_of,
    soak_rows,
)
from scenes.samples import sample_room
from sim.scenarios.scenario import parse_scenario, validate_scenario


def hour(growth_mb_per_h=0.0, frame_ms_at_end=100.0):
    """An hour's samples whose first minute is far below the rest."""
    samples = []
    for number in range(1, 361):
        share = number / 360
        warm = 400.0 if number < 6 else 0.0
        mb = 1000.0 + growth_mb_per_h * share - warm
        frame_ms = 100.0 + (frame_ms_at_end - 100.0) * share
        samples.append(Sample(10.0 * number, mb, 20, frame_ms, 150.0, 10.0, 11))
    return samples


def named(rows):
    return {row.name: row for row in rows}


def test_memory_that_stays_is_no_growth_whatever_the_warm_up_took():
    rows = named(growth_rows(hour()))
    assert rows["studio.soak.rss_growth"].value == pytest.approx(0.0, abs=1e-9)
    assert rows["studio.soak.rss_growth"].passed
    assert rows["studio.soak.minutes"].value == pytest.approx(60.0)


def test_memory_and_delays_that_grow_miss_their_bars():
    rows = named(growth_rows(hour(growth_mb_per_h=300.0, frame_ms_at_end=300.0)))
    # From the middle of the first window, at 15 % of the time, to that of the last, at 95 %.
    assert rows["studio.soak.rss_growth"].value == pytest.approx(100 * 240 / 1045, rel=0.02)
    assert rows["studio.soak.rss_growth"].passed is False
    assert rows["studio.soak.latency_growth"].passed is False


def test_samples_without_a_frame_do_not_count_as_delays():
    samples = [replace(s, frame_ms=float("nan")) if i % 2 else s for i, s in enumerate(hour())]
    assert named(growth_rows(samples))["studio.soak.latency_growth"].value == pytest.approx(0.0)


def test_what_is_sampled_is_on_the_disk_at_once(tmp_path, monkeypatch):
    clock = [0.0]
    monkeypatch.setattr("benchmarks.studio.soaking.time.monotonic", lambda: clock[0])
    path = tmp_path / "new" / "soak.csv"
    sampler = Sampler(
        path, resident_mb=lambda: 512.0, threads=lambda: 7, frame_ms=lambda frames: 40.0 * frames
    )
    assert read_samples(path) == []
    for ms in (10.0, 30.0):
        sampler.late(ms)
    sampler.tick()
    assert read_samples(path) == []
    clock[0] = 10.5
    sampler.answered(5.0)
    sampler.tick()
    (sample,) = read_samples(path)
    assert (sample.t_s, sample.resident_mb, sample.frames, sample.threads) == (10.5, 512.0, 2, 7)
    assert sample.frame_ms == pytest.approx(80.0)
    assert sample.late_ms == pytest.approx(29.0)
    assert sample.input_ms == 5.0


def test_the_scenario_of_an_hour_fits_the_room_it_is_played_in():
    scenario = parse_scenario(scenario_of(3600.0), source="soak")
    validate_scenario(scenario, sample_room("lab"))
    assert scenario.duration_s == 3600.0
    assert len(scenario.people[0].actions) > 1000


def test_a_soak_that_says_nothing_is_refused(tmp_path: Path):
    with pytest.raises(ValueError, match="wanted at least 2 min"):
        soak_rows(1.0, tmp_path)
