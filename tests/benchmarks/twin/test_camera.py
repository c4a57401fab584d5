"""The camera's bench: its figures are there, and too short a scenario is refused."""

from dataclasses import replace

import pytest

from benchmarks.twin.twin import FPS_BAR, measure_camera
from sim.scenarios.scenario import load_scenario


def _tiny():
    scenario = load_scenario("lab-short")
    return replace(scenario, camera=replace(scenario.camera, lens_size_px=64))


def test_the_rate_of_a_tiny_lens():
    rows = {row.name: row for row in measure_camera(_tiny(), stretches=3, frames=3, warm_up=2)}
    fps, cpu_ms = rows["twin.camera_fps"], rows["twin.camera_cpu_ms"]
    assert fps.unit == "1/s"
    assert fps.bar == FPS_BAR
    assert fps.passed == (fps.value >= FPS_BAR)
    assert 0 < cpu_ms.value < 10_000
    # No frame is delivered faster than all cores together can make it.
    assert fps.value > 0.5


def test_a_scenario_that_ends_too_soon_is_refused():
    with pytest.raises(ValueError, match=r"lab-short.*wanted at least 1002"):
        measure_camera(_tiny(), stretches=10, frames=100, warm_up=2)
