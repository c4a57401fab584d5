"""Sizes as they are typed, a sweep's file that the command line reads, its rows as they come."""

import json

import pytest

from sim.scenarios.scenario import SCENARIO_FOLDER
from studio.app.scenario.asked_sweep import (
    OFFERED,
    found_rows,
    kept_sweeps,
    new_folder,
    runs_of,
    scene_of,
    sizes_of,
    sweep_file,
    sweep_values,
    write_sweep,
)
from studio.sweep.results import SweepFolder

SCENARIO = (SCENARIO_FOLDER / "lab-short.toml").read_text(encoding="utf-8")


def test_sizes_are_numbers_with_commas():
    assert sizes_of("150, 300", "Delay") == (150.0, 300.0)
    assert sizes_of("-1; 1,1,", "Exposure") == (-1.0, 1.0)
    for text in ("", "much", "1, two"):
        with pytest.raises(ValueError, match=r"Delay: .*, wanted sizes such as 150, 300"):
            sizes_of(text, "Delay")


def test_every_fault_that_is_offered_is_one_that_can_be_swept(tmp_path):
    faults = {each.name: each.usual for each in OFFERED}
    values = sweep_values("mine.toml", faults, seeds=2, object_id="chair-1")
    write_sweep(tmp_path, "mine", SCENARIO, values)
    runs = runs_of(tmp_path, "lab")
    sizes = sum(len(each.usual) for each in OFFERED)
    assert len(runs) == 2 * (1 + sizes)
    assert {run.fault for run in runs.values()} == {"none", *faults}
    assert SweepFolder(tmp_path).done(runs.values()) == {}, "the command line takes that folder"


def test_a_sweep_of_nothing_or_of_no_object_is_refused(tmp_path):
    with pytest.raises(ValueError, match="tick one"):
        sweep_values("mine.toml", {}, seeds=1, object_id="")
    with pytest.raises(ValueError, match="no movable object"):
        sweep_values("mine.toml", {"occluder": (0.5,)}, seeds=1, object_id="")
    with pytest.raises(ValueError, match="holds no sweep"):
        sweep_file(tmp_path)


def test_folders_are_never_the_same_and_damaged_rows_are_left_out(tmp_path):
    first, second = new_folder(tmp_path, "lab_a b"), new_folder(tmp_path, "lab_a b")
    assert first != second
    assert kept_sweeps(tmp_path) == []
    values = sweep_values("mine.toml", {"delay_ms": (150.0,)}, seeds=1, object_id="")
    write_sweep(second, "mine", SCENARIO, values)
    assert kept_sweeps(tmp_path) == [second]
    (run, _) = runs_of(second, "lab").values()
    SweepFolder(second).add(run, {"rows": [{"fault": "none", "world_cm_mean": 1.5}]})
    (second / "runs" / "bad.json").write_text("{")
    assert [row["run"] for row in found_rows(second)] == [run.name]
    assert scene_of(second) is None
    (second / "sweep.json").write_text(json.dumps({"scene": "lab"}))
    assert scene_of(second) == "lab"
