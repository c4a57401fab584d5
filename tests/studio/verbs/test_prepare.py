"""`nexus prepare` as its user meets it: wrong command lines, input that makes no room."""

import av
import cv2
import numpy as np
import pytest

from studio.cli import EXIT_INPUT, EXIT_USAGE, main
from studio.verbs.prepare import QUALITIES, TRAINERS

OBJECT_BOX = ["--object-box", "1.jpg", "1", "2", "30", "40"]

pytestmark = pytest.mark.usefixtures("no_traceback")


@pytest.fixture
def asked(tmp_path, capsys):
    """Runs the verb on words; gives its exit code and what it said."""

    def ask(source, *words):
        code = main(["prepare", str(source), "--out", str(tmp_path / "x.gnx"), *map(str, words)])
        return code, capsys.readouterr().err

    return ask


@pytest.fixture
def photos(tmp_path):
    """Three good photos."""
    folder = tmp_path / "photos"
    folder.mkdir()
    rng = np.random.default_rng(0)
    for k in range(3):
        small = rng.integers(0, 256, (60, 80, 3), dtype=np.uint8)
        picture = cv2.resize(small, (640, 480), interpolation=cv2.INTER_NEAREST)
        cv2.imwrite(str(folder / f"{k}.jpg"), picture)
    return folder


def test_the_flags_offer_what_there_is():
    from scenes.prepare.options import BUILT_IN, PROGRAMS
    from scenes.prepare.train.trainer import PRESETS

    assert tuple(PRESETS) == QUALITIES
    assert (BUILT_IN, *PROGRAMS) == TRAINERS


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--qr-size", "-1"], "a code's side in metres"),
        (["--qr-size", "a=b"], "wanted metres such as 0.2"),
        (["--frames", "1"], "wanted 8 or more"),
        (["--length", "2"], "--length and --end belong together"),
        (["--length", "2", "--end", "c", "1.jpg", "1", "2"], "wanted a or b"),
        (
            ["--qr-size", "0.2", "--length", "2", "--end", "a", "1.jpg", "1", "2"],
            "both give the scale",
        ),
        (["--known-object", "1,2,3"], "--known-object and --object-box belong together"),
        (["--known-object", "1,2", *OBJECT_BOX], "wanted width, depth, height"),
        (["--known-object", "lab:sofa-9", *OBJECT_BOX], "has no object 'sofa-9'"),
        (["--known-object", "1,1,1", "--object-box", "1.jpg", "9", "2", "3", "4"], "left < right"),
        (["--known-object", "1,1,1", *OBJECT_BOX, "--qr-size", "0.2"], "a known object, and codes"),
        (["--per-axis"], "a scale per axis is measured on codes"),
        (["--splats", "photos"], "need the poses"),
        (["--trainer", "gsplat"], "say where it is"),
        (["--metric-poses"], "none are given"),
        (["--steps", "0"], "wanted at least 1"),
        (["--poses", "photos", "--splats", "photos", "--trainer", "brush"], "and a trainer"),
    ],
)
def test_a_command_line_that_contradicts_itself_is_a_usage_error(
    asked, photos, words, said, tmp_path, monkeypatch
):
    monkeypatch.chdir(tmp_path)
    code, text = asked(photos, *words)
    assert code == EXIT_USAGE
    assert said in text
    assert not (tmp_path / "x.gnx.prepare").exists()


@pytest.mark.parametrize("flag", ["--poses", "--splats", "--mesh", "--rig", "--anchors"])
def test_a_file_that_is_not_there_is_bad_input(asked, photos, flag, tmp_path):
    code, text = asked(photos, flag, tmp_path / "absent")
    assert code == EXIT_INPUT
    assert "absent" in text


def test_too_few_photos_say_how_many_are_wanted(asked, photos):
    code, text = asked(photos)
    assert code == EXIT_INPUT
    assert "3 usable pictures, wanted at least 8" in text


def test_blurred_photos_say_how_to_film(asked, photos):
    picture = cv2.GaussianBlur(cv2.imread(str(photos / "0.jpg")), (0, 0), 25)
    for k in range(10):
        cv2.imwrite(str(photos / f"{k}.jpg"), np.roll(picture, 20 * k, axis=1))
    code, text = asked(photos)
    assert code == EXIT_INPUT
    assert "blurred" in text or "without detail" in text


def test_a_video_of_nothing_says_what_to_film(asked, tmp_path):
    path = tmp_path / "nothing.mp4"
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=10)
        stream.width, stream.height, stream.pix_fmt = 320, 240, "yuv420p"
        grey = np.full((240, 320, 3), 70, dtype=np.uint8)
        for _ in range(20):
            frame = av.VideoFrame.from_ndarray(grey, format="rgb24")
            container.mux(stream.encode(frame))
        container.mux(stream.encode())
    code, text = asked(path)
    assert code == EXIT_INPUT
    assert "film furniture and corners" in text


def test_a_folder_without_poses_is_told_what_is_wanted(asked, photos):
    code, text = asked(photos, "--poses", photos)
    assert code == EXIT_INPUT
    assert "neither a COLMAP model nor a transforms.json" in text


def test_a_damaged_calibration_is_told(asked, photos, tmp_path):
    rig = tmp_path / "rig.json"
    rig.write_text('{"lenses": 3}')
    code, text = asked(photos, "--rig", rig)
    assert code == EXIT_INPUT
    assert "no calibration of a 360° camera" in text


def test_a_scene_that_is_something_else_is_not_overwritten(asked, photos, tmp_path):
    work = tmp_path / "x.gnx.prepare"
    work.mkdir()
    (work / "diary.txt").write_text("mine")
    code, text = asked(photos)
    assert code == EXIT_INPUT
    assert "--work" in text
    assert (work / "diary.txt").read_text() == "mine"
