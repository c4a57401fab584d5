"""`nexus fork` for real: simulator, H.264, tracker, recording, report; and a fork of a fork."""

import hashlib
import json

import pytest

from devices.recording import read_session
from studio.cli import main
from studio.session.records.outputs import OUTPUT_NAMES
from studio.verbs.sessions.fork import DEFAULT_OUT

pytestmark = pytest.mark.usefixtures("no_display", "no_traceback")

SCENARIO = """
room = "lab"
duration_s = 3.0
[camera]
fps = 4
lens_size_px = 160
bitrate_mbps = 2.0
[[people]]
id = "local-user"
start = [-0.95, 0.9]
facing_deg = -40.0
actions = [{ do = "push", object = "chair-1", to = [-0.45, 0.4] }]
[faults]
dropped_frames = [3]
bump_s = 0.6
"""
OTHER = SCENARIO.replace(
    '{ do = "push", object = "chair-1", to = [-0.45, 0.4] }', '{ do = "walk", to = [-1.5, 1.0] }'
)


def tracks(folder):
    frames = json.loads((folder / "tracks.json").read_text())["methods"]["own"]
    return {frame["seq"]: frame for frame in frames}


def fork(parent, out, *words):
    return main(["fork", str(parent / "recording.mcap"), "--headless", "--out", str(out), *words])


@pytest.fixture(scope="module")
def runs(tmp_path_factory):
    """A rehearsal, an unchanged fork of it, one with another scenario, and a fork of that."""
    folder = tmp_path_factory.mktemp("runs")
    (folder / "play.toml").write_text(SCENARIO)
    (folder / "other.toml").write_text(OTHER)
    words = ["--headless", "--no-paper", "--seed", "5", "--scenario", str(folder / "play.toml")]
    main(["rehearse", "lab", *words, "--out", str(folder / "a")])
    other = ["--scenario", str(folder / "other.toml")]
    fork(folder / "a", folder / "same", "--at", "1.3")
    fork(folder / "a", folder / "b", "--at", "1.3", *other)
    fork(folder / "b", folder / "b-again", "--at", "2.0")
    return folder


@pytest.mark.parametrize(("fork", "of"), [("same", "a"), ("b-again", "b")])
def test_an_unchanged_fork_has_the_same_tracks_to_the_bit(runs, fork, of):
    assert len(tracks(runs / of)) == 11
    assert tracks(runs / fork) == tracks(runs / of)


def test_another_scenario_changes_what_comes_after_the_instant_only(runs):
    ours, theirs = tracks(runs / "b"), tracks(runs / "a")
    assert ours.keys() == theirs.keys()
    assert next(seq for seq in ours if ours[seq] != theirs[seq]) in (6, 7)
    assert all(ours[seq] == theirs[seq] for seq in ours if seq < 6)


def test_a_fork_says_where_it_comes_from(runs):
    assert {p.name for p in (runs / "b").iterdir()} == OUTPUT_NAMES
    info = read_session(runs / "b" / "recording.mcap")
    assert info.fork is not None
    parent = (runs / "a" / "recording.mcap").read_bytes()
    assert info.fork.recording == "recording.mcap"
    assert info.fork.sha256 == hashlib.sha256(parent).hexdigest()
    assert info.fork.t_ns == 1_300_000_000
    assert (info.scenario, info.scenario_name, info.seed) == (SCENARIO, "play", 5)
    assert [(c.t_ns, c.scenario, c.scenario_name) for c in info.changes] == [
        (1_300_000_000, OTHER, "other")
    ]
    values = json.loads((runs / "b" / "report.json").read_text())
    assert values["verb"] == "fork"
    assert values["fork"]["t_ns"] == 1_300_000_000
    page = (runs / "b" / "report.html").read_text()
    assert "the fork of recording.mcap begins" in page
    assert info.fork.sha256[:16] in page
    assert "goes on as other" in page


def test_a_fork_can_be_replayed(runs, capsys):
    assert main(["replay", str(runs / "b" / "recording.mcap"), "--headless"]) == 0
    assert "the tracks are identical" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--at", "3"], "wanted seconds from 0 to 2.75"),
        (["--at", "1", "--scenario", "no-such-play"], "no-such-play"),
        (["--at", "1", "--scenario", "lab-short"], "camera.fps = 10.0, wanted 4.0 as in play.toml"),
    ],
)
def test_bad_input_is_one_line_and_leaves_nothing(runs, tmp_path, capsys, words, said):
    assert fork(runs / "a", tmp_path / "out", *words) == 3
    err = capsys.readouterr().err.splitlines()
    assert said in err[-1]
    assert list(tmp_path.iterdir()) == []


def test_a_fork_does_not_overwrite_its_parent(runs, capsys):
    before = tracks(runs / "a")
    assert fork(runs / "a", runs / "a", "--at", "1") == 3
    assert "choose another --out" in capsys.readouterr().err
    assert tracks(runs / "a") == before


def test_the_default_folder_is_not_the_rehearsals():
    assert DEFAULT_OUT.as_posix() == "out/fork"
