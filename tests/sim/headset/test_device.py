"""A simulated Quest says what a real one's page says, and rests when that would."""

from pathlib import Path

import pytest

from devices.hub.protocol.messages import DeviceSaid, Immersion, read_device
from sim.headset.connection import HubAddress
from sim.headset.crowd import CrowdPlan
from sim.headset.device import FULL_S, MODEL, SAY_S, QuestDevice
from sim.headset.faults import HeadsetState
from studio import web
from studio.live.people.headsets import ASPECTS, checks_of, headset_probes
from tests.sim.headset.test_crowd import played


def said(device, here_s, pictures=0, **faults):
    found = device.said(here_s, pictures=pictures, faults=HeadsetState(**faults))
    return None if found is None else read_device(found)


def test_a_quest_says_pictures_and_battery():
    device = QuestDevice(seed=3, role="remote")
    first = said(device, 2.0, 144)
    assert (first.model, first.immersion, first.is_worn) == (MODEL, Immersion.VR, True)
    assert first.rate_hz is None, "not counted over a whole way of showing"
    assert said(device, 4.0, 144 + 140).rate_hz == 70.0
    assert 60.0 <= first.battery_percent <= 100.0
    assert said(device, 0.5 * FULL_S, 900).battery_percent == pytest.approx(
        first.battery_percent - 50.0, abs=1.0
    )
    assert said(device, 2 * FULL_S, 999).battery_percent == 0.0
    assert said(QuestDevice(seed=3, role="local"), 2.0).immersion is Immersion.AR


def test_a_quest_that_is_taken_off_says_so_and_one_asleep_says_nothing():
    device = QuestDevice(seed=0, role="remote")
    assert not said(device, 2.0, is_off=True).is_worn
    assert said(device, 4.0, 10, is_asleep=True) is None
    assert said(device, 60.0, 12, is_cut=True) is None
    awake = said(device, 62.0, 130)
    assert awake.rate_hz is None, "its rest is not counted"
    assert awake == DeviceSaid(MODEL, Immersion.VR, True, None, awake.battery_percent, False)


def test_the_panel_and_the_preflight_have_simulated_quests(hub, monkeypatch):
    monkeypatch.setattr("sim.headset.client.SAY_S", 0.3)
    found = []

    def have_said(_tally, _pace):
        found[:] = hub.hub.headsets()
        return len(found) == 2

    played(hub, CrowdPlan(HubAddress(hub.url), 2), have_said)
    headsets = tuple(found)
    assert [check.name for check in checks_of(headsets[0])] == list(ASPECTS)
    lines = [probe() for probe in headset_probes(headsets).values()]
    states = [line for line in lines if line.name.endswith("state")]
    assert [line.what for line in states] == [f"{MODEL}, in VR"] * 2
    assert [line.verdict for line in states] == ["PASS"] * 2


def test_it_says_so_as_often_as_a_page():
    page = (Path(web.__file__).parent / "live" / "device.js").read_text()
    assert f"const SAY_MS = {1000 * SAY_S:.0f};" in page
