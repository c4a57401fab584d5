"""The main job for real: simulator, H.264, both trackers, recording, report, replay."""

import json

import pytest

from devices.recording import read_session
from studio.cli import main
from studio.session.records.outputs import OUTPUT_NAMES

pytestmark = pytest.mark.usefixtures("no_display", "no_traceback")

SCENARIO = """
room = "lab"
duration_s = 2.0

[camera]
fps = 5
lens_size_px = 360
bitrate_mbps = 4.0

[[people]]
id = "local-user"
start = [-1.25, 1.5]
facing_deg = -40.0
actions = [{ do = "push", object = "OBJECT", to = [-0.45, 0.4] }]

[[remote]]
id = "remote-user"
path = [[-0.6, -1.7, 1.6], [0.2, 0.2, 1.65]]
points_at = ["chair-1"]
"""


def scenario_file(folder, object_id="chair-1"):
    path = folder / "mini.toml"
    path.write_text(SCENARIO.replace("OBJECT", object_id))
    return path


def rehearse(scenario, out, *words):
    return main(
        ["rehearse", "lab", "--headless", "--scenario", str(scenario), "--out", str(out), *words]
    )


@pytest.fixture(scope="module")
def rehearsed(tmp_path_factory):
    folder = tmp_path_factory.mktemp("end-to-end")
    code = rehearse(scenario_file(folder), folder / "first", "--seed", "5")
    return folder, code


def test_leaves_everything_and_its_code_says_what_the_report_says(rehearsed):
    folder, code = rehearsed
    out = folder / "first"
    assert {p.name for p in out.iterdir()} == OUTPUT_NAMES
    rows = json.loads((out / "report.json").read_text())["rows"]
    missed = [row["name"] for row in rows if row["passed"] is False]
    assert code == bool(missed)
    page = (out / "report.html").read_text()
    headline = page.split("</b>")[0]
    assert ("miss" in headline) == bool(missed)
    assert "Nothing moved" not in headline
    info = read_session(out / "recording.mcap")
    assert info.scenario == (folder / "mini.toml").read_text()
    assert [lens.width_px for lens in info.rig.lenses] == [360, 360]


def test_the_same_seed_gives_identical_tracks(rehearsed):
    folder, _code = rehearsed
    rehearse(folder / "mini.toml", folder / "again", "--seed", "5", "--no-paper")
    first, again = (
        json.loads((folder / name / "tracks.json").read_text())["methods"]["own"]
        for name in ("first", "again")
    )
    assert first == again


def test_replay_gives_identical_tracks(rehearsed, capsys):
    folder, _code = rehearsed
    assert main(["replay", str(folder / "first" / "recording.mcap"), "--headless", "--json"]) == 0
    out, err = capsys.readouterr()
    rows = {row["name"]: row["value"] for row in json.loads(out)["rows"]}
    assert rows["replay.tracks.compared"] == 5 * 10
    assert rows["replay.tracks.different"] == rows["replay.tracks.missing"] == 0
    assert "the tracks are identical" in err


def test_a_scenario_with_an_object_that_is_not_there_is_one_line(tmp_path, capsys):
    scenario = scenario_file(tmp_path, "sofa-7")
    assert rehearse(scenario, tmp_path / "out") == 3
    err = capsys.readouterr().err.splitlines()
    assert "sofa-7" in err[-1]
    assert "chair-1" in err[-1]
    assert str(scenario) in err[-1]
    assert [p.name for p in tmp_path.iterdir()] == ["mini.toml"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["rehearse", "atlantis"], "atlantis"),
        (["rehearse", "/etc"], "/etc"),
        (["rehearse", "lab", "--scenario", "no-such-play"], "no-such-play"),
    ],
)
def test_missing_and_foreign_scenes_and_scenarios_are_named(words, said, tmp_path, capsys):
    assert main([*words, "--headless", "--out", str(tmp_path / "out")]) == 3
    last = capsys.readouterr().err.splitlines()[-1]
    assert last.startswith("nexus: ")
    assert said in last
    assert list(tmp_path.iterdir()) == []
