"""Every example runs headless on something small, and uses public names only."""

from __future__ import annotations

import ast
import runpy
from collections.abc import Callable
from itertools import islice
from pathlib import Path

import cv2
import numpy as np
import pytest

from devices.recording import Recorder
from devices.recording_codec import FrameStamp
from devices.session_info import SessionInfo
from scenes.formats.registry import read_splats
from scenes.samples import sample_room
from sim.rehearsal import simulate
from sim.scenarios.scenario import load_scenario

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"
SCRIPTS = sorted(EXAMPLES.glob("*.py"))
FRAMES = 8
FLOORS = {"scenes", "devices", "sim", "tracking", "studio"}

Run = Callable[..., str]


@pytest.fixture
def run(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """Runs an example as a script and gives what it printed."""

    def call(name: str, *words: object) -> str:
        path = EXAMPLES / f"{name}.py"
        monkeypatch.setattr("sys.argv", [str(path), *map(str, words)])
        runpy.run_path(str(path), run_name="__main__")
        return capsys.readouterr().out

    return call


@pytest.fixture(scope="module")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first frames of the short scenario, as a rehearsal records them."""
    path = tmp_path_factory.mktemp("recorded") / "recording.mcap"
    scenario = load_scenario("lab-short")
    steps = islice(simulate(sample_room("lab"), scenario, seed=0), FRAMES)
    first = next(steps)
    info = SessionInfo(
        scene="lab", scene_hash="", seed=0, scenario="", scenario_name="lab-short", mode="exact",
        methods=("own",), versions={}, rig=first.frame.rig, fps=scenario.camera.fps,
    )  # fmt: skip
    with Recorder(path, info) as recorder:
        for step in (first, *steps):
            frame, truth = step.frame, step.truth
            recorder.write(
                FrameStamp(
                    frame.stream_id, frame.seq, frame.t_ns, frame.received_ns, frame.world_from_rig
                )
            )
            recorder.write(step.packet)
            recorder.write(truth.recorded)
    return path


def picture_in(path: Path) -> np.ndarray:
    """A picture that shows something."""
    picture = cv2.imread(str(path))
    assert picture is not None
    assert picture.std() > 10
    return picture


def test_open_a_scene(run: Run, tmp_path: Path) -> None:
    printed = run("open_a_scene", "lab", "--size", 240, "--out", tmp_path / "plan.png")
    assert "chair-1" in printed
    assert picture_in(tmp_path / "plan.png").shape == (200, 240, 3)


def test_render_a_fisheye(run: Run, tmp_path: Path) -> None:
    printed = run("render_a_fisheye", "desk", "--size", 240, "--out", tmp_path / "lens.png")
    assert "m away, seen" in printed
    assert picture_in(tmp_path / "lens.png").shape == (240, 240, 3)


def test_train_splats(run: Run, tmp_path: Path) -> None:
    printed = run("train_splats", "--frames", 16, "--steps", 60, "--out", tmp_path)
    assert "16 photos" in printed
    assert len(read_splats(tmp_path / "splats.ply")) > 500
    assert picture_in(tmp_path / "compared.png").shape[1] == 2 * 400


def test_cut_an_object(run: Run, tmp_path: Path) -> None:
    words = ("--scene", "desk", "--object", "mug-1", "--views", 6)
    printed = run("cut_an_object", *words, "--out", tmp_path / "cut.png")
    found, _, had = printed.split(" splats")[0].replace(",", "").split()
    assert 0.5 < int(found) / int(had) < 1.5
    picture_in(tmp_path / "cut.png")


def test_read_a_recording(run: Run, recording: Path, tmp_path: Path) -> None:
    printed = run("read_a_recording", recording, "--out", tmp_path / "ways.png")
    assert f"{FRAMES} RecordedTruth" in printed
    picture_in(tmp_path / "ways.png")


def test_track_a_video(run: Run, recording: Path, tmp_path: Path) -> None:
    printed = run("track_a_video", "lab", recording, "--out", tmp_path / "tracked.png")
    assert "chair-1    static    (-0.75, 1.00, " in printed
    picture_in(tmp_path / "tracked.png")


def test_own_tracker_method(run: Run, recording: Path, tmp_path: Path) -> None:
    printed = run("own_tracker_method", recording, "--out", tmp_path / "errors.png")
    difference_cm, own_cm = (float(line.split()[1]) for line in printed.splitlines())
    assert own_cm < 1 < difference_cm
    picture_in(tmp_path / "errors.png")


def test_own_detector(run: Run, recording: Path, tmp_path: Path) -> None:
    assert "chair-2" in run("own_detector", recording, "--out", tmp_path / "detected.png")
    picture_in(tmp_path / "detected.png")


def test_every_example_is_run_here() -> None:
    tests = {name.removeprefix("test_") for name in globals() if name.startswith("test_")}
    assert [path.stem for path in SCRIPTS if path.stem not in tests] == []
    assert len(SCRIPTS) >= 8


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_examples_use_public_names_only(path: Path) -> None:
    tree = ast.parse(path.read_text(encoding="utf-8"))
    imported = [
        part
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom | ast.Import)
        for name in [getattr(node, "module", None) or "", *(alias.name for alias in node.names)]
        for part in name.split(".")
    ]
    used = [
        node.attr
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute) and ast.unparse(node.value) != "self"
    ]
    assert FLOORS & set(imported)
    private = [name for name in [*imported, *used] if name.startswith("_")]
    assert [name for name in private if not name.endswith("__")] == []


@pytest.mark.parametrize("path", SCRIPTS, ids=lambda path: path.stem)
def test_examples_say_what_they_show_and_how_to_run_them(path: Path) -> None:
    said = ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or ""
    assert f".venv/bin/python examples/{path.name}" in said
    assert said.splitlines()[0].endswith(".")
