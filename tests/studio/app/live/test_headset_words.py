"""How a HoloLens is doing, in figures and a sentence."""

from dataclasses import replace

from devices.clock_mapping import ClockEstimate
from devices.hololens.values import HeadsetStatus, StreamName, StreamState, StreamStatus
from studio.app.live.headset_words import NAMES, figures_of, sentence_of
from studio.live.hololens.anchoring import OriginStatus
from studio.live.hololens.meshing import MeshStatus
from studio.live.hololens.worn import WornStatus

LIVE = StreamStatus(
    StreamState.LIVE, "receiving", last_age_ns=20_000_000, rate_hz=30.0, delay_ms=42.0
)
CLOCK = ClockEstimate(0, 0, 0.0, 400_000.0, 1.0, is_one_way=False)
ORIGIN = OriginStatus(True, 3.4, 0.08, ("lab:1",), 2.0, drift_mm=12.0)
GOOD = WornStatus(
    HeadsetStatus("10.0.0.2", {name: LIVE for name in StreamName}, clock=CLOCK),
    ORIGIN,
    MeshStatus(surfaces=44, cells=20),
    drawn=65,
)


def texts(status):
    return {figure.name: (figure.text, figure.kind) for figure in figures_of(status)}


def test_without_a_headset_there_are_dashes():
    assert texts(None) == dict.fromkeys(NAMES, ("–", ""))


def test_a_good_one_is_in_figures_and_a_sentence():
    found = texts(GOOD)
    assert tuple(found) == NAMES
    assert found["Video"] == ("30 /s, 42 ms", "")
    assert found["Clock"] == ("±0.4 ms", "")
    assert found["Origin"] == ("±3 mm, 0.08°", "good")
    assert found["Drift"][0] == "12 mm in a minute"
    assert found["Display"][0] == "65 items"
    assert found["Battery"][0] == "not said by it"
    assert sentence_of(GOOD) == ("The local user is in the room.", "good")


def test_what_is_wrong_comes_with_what_to_do():
    unknown = replace(GOOD, origin=OriginStatus())
    assert texts(unknown)["Origin"][1] == "warning"
    assert "look at one" in sentence_of(unknown)[0]
    stale = replace(GOOD, origin=replace(ORIGIN, age_s=90.0))
    assert "90 s" in sentence_of(stale)[0]
    moved = replace(GOOD, origin=replace(ORIGIN, moved=("lab:2",)))
    assert "lab:2" in sentence_of(moved)[0]
    away = StreamStatus(StreamState.WAITING, "no answer: is it on?", last_age_ns=5_000_000_000)
    cut = replace(GOOD, headset=replace(GOOD.headset, streams={"video": away}))
    assert texts(cut)["Video"][1] == "warning"
    assert "is it on" in sentence_of(cut)[0]
    low = replace(GOOD, headset=replace(GOOD.headset, battery_percent=12.0))
    assert texts(low)["Battery"] == ("12 %", "warning")
    bare = replace(GOOD, mesh=MeshStatus(failure="no collision mesh"))
    assert texts(bare)["Mesh"] == ("off", "warning")
