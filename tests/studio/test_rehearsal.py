import errno
import json
import re

import av
import numpy as np
import pytest

from devices import recording
from devices.recording import read_session
from studio import rehearsal
from studio.cli import main
from studio.console.progress import Progress, text_progress
from studio.session.plan import SessionPlan
from studio.session.records.outputs import OUTPUT_NAMES
from studio.view.twin import ABOVE_M, Twin, lens_camera

pytestmark = pytest.mark.usefixtures("no_display", "no_traceback")


@pytest.fixture
def in_tiny_room(tiny, monkeypatch):
    """`nexus rehearse` plays in the tiny room."""

    def use(**options):
        monkeypatch.setattr(
            rehearsal, "open_session", lambda plan, **given: tiny.session(plan, **options, **given)
        )

    return use


@pytest.fixture(scope="module")
def performed(tiny, tmp_path_factory):
    folder = tmp_path_factory.mktemp("rehearsal") / "demo"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rehearsal, "open_session", tiny.session)
        lines = []
        rehearsal.perform(
            SessionPlan(seed=11), folder, progress=Progress(lambda text, _: lines.append(text))
        )
    return folder, lines


def test_leaves_every_result_and_nothing_else(performed):
    folder, _lines = performed
    assert {p.name for p in folder.iterdir()} == OUTPUT_NAMES
    assert [p.name for p in folder.parent.iterdir()] == ["demo"]


def test_report_json_keeps_the_contract(performed):
    values = json.loads((performed[0] / "report.json").read_text())
    assert set(values) == {"verb", "version", "machine", "seed", "rows"}
    assert (values["verb"], values["seed"]) == ("rehearse", 11)
    rows = {row["name"]: row for row in values["rows"]}
    assert all(
        set(row) == {"name", "value", "unit", "bar", "passed", "spread"} for row in rows.values()
    )
    assert rows["rehearse.chairs.world_cm.mean"]["value"] == pytest.approx(3.0)
    assert rows["rehearse.paper.chairs.world_cm.mean"]["value"] == pytest.approx(6.0)
    assert rows["rehearse.frames_dropped"] == {
        "name": "rehearse.frames_dropped",
        "value": 0.0,
        "unit": "",
        "bar": 0,
        "passed": True,
        "spread": None,
    }
    assert rows["stage.pose.ms.p50"]["value"] == pytest.approx(5.0)


def test_report_html_says_how_it_went_and_needs_nothing_else(performed):
    page = (performed[0] / "report.html").read_text()
    assert "The rehearsal went well" in page
    assert "3.0 <small>cm" in page
    for published in ("9.9 ± 4.4", "5.7 ± 12.0", "7.5 ± 1.7", "3.2 ± 4.6"):
        assert published in page
    assert "its method on these frames: 6.0" in page
    assert "The yaw of a round stool cannot be seen" in page
    assert page.count("<svg") == 3
    assert page.count("data:image/jpeg;base64,") >= 8
    fetched = re.findall(r'(?:src|href)="([^"]*)"', page)
    assert {f for f in fetched if not f.startswith(("data:", "#"))} == {"rehearsal.mp4"}
    assert "tiny-push" in page
    assert "pushes chair 1" in page


def test_film_plays_everywhere_and_has_every_frame(performed, tiny):
    with av.open(str(performed[0] / "rehearsal.mp4")) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        assert stream.average_rate == 10
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
    assert len(pictures) == tiny.frames
    assert np.abs(pictures[0].astype(int) - pictures[-1]).max() > 50


def test_tracks_json_has_every_pose_of_every_method(performed, tiny):
    values = json.loads((performed[0] / "tracks.json").read_text())
    assert set(values["methods"]) == {"own", "paper"}
    frames = values["methods"]["own"]
    assert [f["seq"] for f in frames] == list(range(tiny.frames))
    chair = frames[-1]["objects"][0]
    assert set(chair) == {
        "object_id",
        "world_from_object",
        "covariance",
        "visible_fraction",
        "state",
        "confidence",
        "source_seq",
    }
    assert np.shape(chair["world_from_object"]) == (4, 4)


def test_recording_says_how_it_was_made(performed):
    info = read_session(performed[0] / "recording.mcap")
    assert (info.seed, info.mode, info.methods) == (11, "exact", ("own", "paper"))


def test_progress_names_each_task(performed):
    said = " ".join(performed[1])
    for task in ("opening the scene", "playing the session", "drawing the film"):
        assert task in said


def test_a_bad_tracker_fails_the_verb_and_the_verdict(in_tiny_room, tmp_path, capsys):
    in_tiny_room(offset_m=0.3)
    out = tmp_path / "demo"
    words = ["rehearse", "--headless", "--no-paper", "--json", "--out", str(out)]
    assert main(words) == 1
    printed = json.loads(capsys.readouterr().out)
    assert printed["rows"] == json.loads((out / "report.json").read_text())["rows"]
    page = (out / "report.html").read_text()
    assert "2 figures miss their limits" in page
    assert "chairs, place, mean 30.0 cm (limit 9.9)" in page


def test_without_a_display_it_says_so_and_goes_on(in_tiny_room, tmp_path, capsys):
    in_tiny_room()
    assert main(["rehearse", "--no-paper", "--out", str(tmp_path / "demo")]) == 0
    out, err = capsys.readouterr()
    assert "no display (DISPLAY is not set): rehearsing without a window" in err
    assert "rehearse.chairs.world_cm.mean" in out
    assert "pass" in out


def test_a_full_disk_is_one_line_and_leaves_nothing_that_looks_whole(
    in_tiny_room, tmp_path, capsys, monkeypatch
):
    in_tiny_room()

    def full(*_args, **_kwargs):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(recording.Writer, "finish", full)
    out = tmp_path / "demo"
    assert main(["rehearse", "--headless", "--no-paper", "--out", str(out)]) == 3
    assert "recording stopped: the disk is full" in capsys.readouterr().err
    assert not out.exists()
    left = [p for p in tmp_path.rglob("*") if p.is_file()]
    assert [p.name for p in left] == ["recording.mcap.part"]


def test_nothing_moved_is_said_and_is_no_success(tiny, in_tiny_room, tmp_path):
    def still():
        for count, message in enumerate(tiny.inputs()):
            if count < tiny.starts:
                yield message

    in_tiny_room(inputs=still)
    out = tmp_path / "demo"
    assert main(["rehearse", "--headless", "--out", str(out)]) == 0
    page = (out / "report.html").read_text()
    assert "Nothing moved" in page
    assert "went well" not in page


def test_the_view_from_above_shows_the_whole_floor_and_no_ceiling(tiny):
    twin = Twin(tiny.scene, renderer=None)
    camera, world_from_camera = twin.above(200)
    corners = np.array([[x, y, 0.0] for x in (-2, 2) for y in (-2, 2)])
    pixels, seen = camera.project(world_from_camera.inverse() @ corners)
    assert seen.all()
    west, north = pixels[0], pixels[1]
    assert west[0] < 100 < pixels[2][0]
    assert north[1] < 100 < pixels[0][1]
    assert world_from_camera.translation[2] == ABOVE_M


def test_a_resized_lens_sees_the_same_rays(tiny):
    message = next(iter(tiny.inputs()))
    lens = message.frame.rig.lenses[0]
    half = lens_camera(lens, lens.width_px // 2)
    pixels = np.array([[10.0, 20.0], [32.0, 32.0], [50.0, 44.0]])
    assert np.allclose(half.unproject(pixels / 2), lens.unproject(pixels))


def test_progress_in_a_file_is_lines_without_control_signs(tmp_path):
    with (tmp_path / "log").open("w") as log:
        progress = text_progress(log)
        progress.begin("drawing")
        progress.advance(0.5)
        progress.finish("7 pictures")
    assert (tmp_path / "log").read_text() == "drawing …\ndrawing: 0 s, 7 pictures\n"
