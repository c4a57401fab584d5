"""Sweep files: what is played, and what is refused in one line."""

from __future__ import annotations

import tomllib
from pathlib import Path

import pytest

from sim.faults.light import Blur
from sim.faults.occluder import Occluder
from sim.scenarios.scenario import load_scenario, parse_scenario
from sim.tables import ScenarioError
from studio.sweep.plan import WITHOUT, load_sweep, parse_sweep, sweep_names
from studio.sweep.toml_text import toml_text

GOOD = """
[sweep]
scenario = "lab-short"
duration_s = 1.5
lens_size_px = 128
seeds = [0, 3]
methods = ["own", "paper"]
[faults]
drop_share = [0.1, 0.3]
blur = { px = [4, 2], kind = "motion" }
occluder = { share = [0.5], object = "chair-1" }
"""


def plan_of(text: str):
    return parse_sweep(text, source="s.toml", scene="lab")


def test_every_fault_is_played_in_every_size_with_every_seed():
    plan = plan_of(GOOD)
    assert [run.name for run in plan.runs] == [
        f"{kind}-seed-{seed}"
        for kind in (
            "none",
            "drop_share-0.1",
            "drop_share-0.3",
            "blur-2",
            "blur-4",
            "occluder-0.5",
        )
        for seed in (0, 3)
    ]
    assert {run.methods for run in plan.runs} == {("own", "paper")}
    assert (plan.runs[0].fault, plan.runs[0].size) == (WITHOUT, 0.0)
    assert (plan.runs[6].unit, plan.runs[6].size, plan.runs[6].seed) == ("px", 2.0, 0)


def test_a_run_s_scenario_is_the_base_with_one_line_more():
    runs = {run.name: run for run in plan_of(GOOD).runs}
    base = load_scenario("lab-short")
    plain = parse_scenario(runs["none-seed-0"].scenario, source="a.toml")
    assert (plain.people, plain.remote) == (base.people, base.remote)
    assert (plain.duration_s, plain.camera.lens_size_px) == (1.5, 128)
    assert plain.camera.bitrate_mbps == base.camera.bitrate_mbps
    assert plain.faults == base.faults
    blurred = parse_scenario(runs["blur-4-seed-0"].scenario, source="a.toml").faults
    assert [f for f in blurred.each if f not in base.faults.each] == [Blur(4.0, "motion")]
    hidden = parse_scenario(runs["occluder-0.5-seed-0"].scenario, source="a.toml").faults
    assert hidden.of(Occluder) == (Occluder("chair-1", 0.5),)


def test_a_scenario_beside_the_sweep_is_found(tmp_path):
    (tmp_path / "mine.toml").write_text('room = "lab"\nduration_s = 1\n[faults]\ndelay_ms = 9\n')
    path = tmp_path / "sweep.toml"
    path.write_text('[sweep]\nscenario = "mine.toml"\n[faults]\ndelay_ms = [80]\nbump_deg = [1]\n')
    plan = load_sweep(str(path), "lab")
    assert (plan.name, plan.scenario_name) == ("sweep", "mine")
    assert tomllib.loads(plan.runs[1].scenario)["faults"] == {"delay_ms": 80}
    assert tomllib.loads(plan.runs[2].scenario)["faults"] == {"delay_ms": 9, "bump_deg": 1}


def test_the_sweeps_that_come_with_the_program_are_whole():
    assert "lab-faults" in sweep_names()
    plan = load_sweep("lab-faults", "lab")
    assert len(plan.runs) == 12
    assert tomllib.loads(plan.runs[0].scenario)["duration_s"] == 10.0


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("blur =", "blurr =", ("faults.blurr", "no such fault", "white_balance")),
        ("px = [4, 2]", "px = 4", ("faults.blur.px", "4", "a list of sizes (px)")),
        ("px = [4, 2]", "px = []", ("faults.blur.px", "a list of sizes")),
        ("px = [4, 2]", "px = [4, 99]", ("blur-99", "faults.blur.px", "0..50")),
        ("px = [4, 2]", "px = [4, 4]", ("blur-4-seed-0", "twice")),
        ('kind = "motion"', "kinds = 1", ("faults.blur.kinds", "no such key")),
        ("drop_share = [0.1, 0.3]", "drop_share = 0.1", ("faults.drop_share", "a list of sizes")),
        ("drop_share = [0.1, 0.3]", "bump_s = [1]", ("faults.bump_s", "no such fault")),
        ("blur = { px = [4, 2], ", "blur = [3]\nfreeze = { ", ("faults.blur", "a table with px")),
        ("seeds = [0, 3]", "seeds = [0, 0]", ("sweep.seeds", "[0, 0]", "each once")),
        ("seeds = [0, 3]", "seed = 3", ("sweep.seed", "no such key", "seeds")),
        ('"paper"', '"magic"', ("sweep.methods", "'magic'", "own, paper")),
        ('"lab-short"', '"nowhere"', ("'nowhere'", "lab-short")),
        ("[faults]", "[fault]", ("fault", "no such key")),
        ("[sweep]", "[sweep", ("not TOML",)),
    ],
)
def test_a_wrong_sweep_is_one_clear_line(old, new, words):
    assert old in GOOD
    with pytest.raises(ScenarioError) as caught:
        plan_of(GOOD.replace(old, new))
    message = str(caught.value)
    assert "\n" not in message
    for word in words:
        assert word in message


def test_no_file_names_those_there_are(tmp_path):
    with pytest.raises(ScenarioError, match="lab-faults"):
        load_sweep(str(tmp_path / "none.toml"), "lab")


@pytest.mark.parametrize("name", ["lab-rearrange", "lab-short", "desk-reading"])
def test_toml_text_says_the_same(name):
    path = Path(load_scenario(name).source)
    values = tomllib.loads(path.read_text(encoding="utf-8"))
    assert tomllib.loads(toml_text(values)) == values


def test_toml_text_keeps_odd_texts_and_refuses_what_no_scenario_has():
    values = {"a b": 'say "hi"\\\n\x7fé', "c": [True, 1, 0.5, -1e-7], "d": {"e": {}}}
    assert tomllib.loads(toml_text(values)) == values
    with pytest.raises(ValueError, match="numbers, texts"):
        toml_text({"a": object()})
