"""Stages of a preparation, and a cut on a copy that can be undone byte for byte."""

import hashlib
import json
from pathlib import Path

import cv2
import numpy as np
import pytest

from scenes.package import load_package
from scenes.prepare.cutout.marks.drawn import Stroke
from studio.app.preparation.cut_job import (
    SHARPENED_M,
    CutJob,
    Mark,
    clean_words,
    cut_words,
    marked_place,
    sharpen_words,
    undo,
)
from studio.app.preparation.preparation_job import (
    PreparationJob,
    Scale,
    place_of_room,
    preparation_words,
    splat_file_words,
)
from studio.app.preparation.stage_lines import StageLine, seconds_of, stages_of
from tests.crate_room import HIGH, LOW


def digest(folder):
    files = sorted(path for path in folder.rglob("*") if path.is_file())
    return [(str(f.relative_to(folder)), hashlib.sha256(f.read_bytes()).digest()) for f in files]


def test_a_cut_works_on_a_copy_and_undo_gives_the_same_bytes_back(scene, marks):
    before = digest(scene)
    job = CutJob(scene, "Blue crate", marks)
    assert digest(scene) == before, "the scene is left alone while the copy is cut"
    assert job.wait(120)
    assert job.problem == ""
    assert job.report["object"] == "blue-crate"
    assert job.report["floaters"] >= 0
    assert sorted(path.name for path in job.pictures.iterdir()) == ["0.png", "1.png", "2.png"]
    assert digest(scene) == before
    kept = job.take()
    assert [item.object_id for item in load_package(scene).objects] == ["blue-crate"]
    assert digest(kept) == before
    undo(scene, kept)
    assert digest(scene) == before
    with pytest.raises(ValueError, match="cannot be undone"):
        undo(scene, kept)


def test_a_cut_of_nothing_says_why_and_leaves_the_scene(scene):
    before = digest(scene)
    job = CutJob(scene, "Nothing", [Mark("no.png", (1, 1, 9, 9))])
    assert job.wait(60)
    assert "no view 'no.png'" in job.problem
    with pytest.raises(ValueError, match="nothing to take"):
        job.take()
    assert digest(scene) == before


def test_marks_become_words_and_a_cut_without_any_is_refused(tmp_path):
    words = cut_words(tmp_path, " Chair ", [Mark("a", None, ((1, 2), (3, 4)))])
    assert words[2:] == ["--name", "Chair", "--json", "--click", "a", "1.0", "2.0", "3.0", "4.0"]
    with pytest.raises(ValueError, match="nothing is marked"):
        cut_words(tmp_path, "Chair", [Mark("a")])
    with pytest.raises(ValueError, match="type a name"):
        cut_words(tmp_path, "  ", [Mark("a", (0, 0, 1, 1))])


def test_what_a_hand_draws_becomes_words_of_cutting_and_of_cleaning(tmp_path):
    triangle = ((1.0, 2.0), (9.0, 2.0), (1.0, 8.0))
    mark = Mark("a", None, (), (triangle,), (Stroke(4.0, ((3.0, 3.0), (5.0, 3.0))),))
    words = cut_words(tmp_path, "Chair", [mark])[5:]
    assert words[:6] == ["--box", "a", "1.0", "2.0", "9.0", "8.0"]
    assert words[6:] == ["--click", "a", "3.0", "3.0", "5.0", "3.0"]
    words = clean_words(tmp_path, [mark])[2:]
    assert words[:2] == ["--clean", "--json"]
    assert words[2:10] == ["--lasso", "a", "1.0", "2.0", "9.0", "2.0", "1.0", "8.0"]
    assert words[10:] == ["--brush", "a", "4.0", "3.0", "3.0", "5.0", "3.0"]
    with pytest.raises(ValueError, match="draw around it, or brush over it"):
        clean_words(tmp_path, [Mark("a", None, ((1.0, 2.0),))])


def test_sharpening_is_of_what_is_marked_else_of_what_is_named_else_of_all(scene, marks):
    copy = scene.with_name("copy.gnx")
    words = sharpen_words(copy, "crate", marks=marks[:1], scene=scene)
    assert words[:2] == ["refine", str(copy)]
    assert words[-3:] == ["--work", str(scene.with_name("crate.gnx.prepare")), "--json"]
    at = np.array([float(value) for value in words[2].removeprefix("--at=").split(",")])
    assert np.all((at > LOW - 0.02) & (at < HIGH + 0.02)), "the mark is on the crate"
    assert words[3] == "--radius"
    assert 0.1 < float(words[4]) < 0.4
    assert sharpen_words(copy, " crate ", marks=(), scene=scene)[2] == "crate"
    assert sharpen_words(copy, "", marks=(), scene=scene)[2] == "--work"
    clicked = Mark(marks[0].view, None, ((120.0, 90.0),))
    assert marked_place(scene, clicked)[1] == SHARPENED_M
    with pytest.raises(ValueError, match="nothing is at the mark"):
        marked_place(scene, Mark(marks[0].view, None, ((120.0, -9.0),)))
    with pytest.raises(ValueError, match=r"no view '9\.png'"):
        marked_place(scene, Mark("9.png", None, ((1.0, 1.0),)))


def test_progress_lines_are_stages():
    lines = ["capture …", "capture: 3 s", "note: mind it", "training …"]
    lines += ["training  40%, 1 min 05 s left  step 400: 21 dB"]
    capture, training = stages_of(lines)
    assert capture == StageLine("capture", "done", 1.0, 0.0, 3.0)
    assert training == StageLine("training", "running", 0.4, 65.0, None, "step 400: 21 dB")
    assert stages_of(lines, has_failed=True)[1].state == "failed"
    assert seconds_of("soon") is None


def test_scale_becomes_flags_and_a_splat_file_without_it_is_refused():
    picks = {"a": (("3.jpg", 812.0, 400.0), ("7.jpg", 640.0, 391.0))}
    words = preparation_words(Path("p"), Path("o"), Scale(length_m=2.035, ends=picks))
    ends = "--end a 3.jpg 812.0 400.0 --end a 7.jpg 640.0 391.0"
    assert " ".join(words).endswith(f"--json --length 2.035 {ends}")
    assert splat_file_words(Path("a.ply"), Path("o.gnx"), Scale(height_m=2.5))[-1] == "2.5"
    with pytest.raises(ValueError, match="Scale unknown"):
        splat_file_words(Path("a.ply"), Path("o.gnx"), Scale())


def test_a_room_whose_objects_were_cut_out_is_not_made_again_in_its_place(scene, tmp_path):
    photos, splats = tmp_path / "crate", tmp_path / "crate.ply"
    photos.mkdir()
    splats.touch()
    assert place_of_room(photos) == scene, "nothing was cut out of it: it is made again"
    assert place_of_room(splats) == tmp_path / "crate-2.gnx"
    text = (scene / "scene.json").read_text()
    values = json.loads(text)
    (scene / "scene.json").write_text(json.dumps({**values, "objects": [{"id": "crate-1"}]}))
    assert place_of_room(photos) == tmp_path / "crate-2.gnx"


def test_poses_of_another_program_beside_the_photos_are_taken(tmp_path):
    (tmp_path / "images").mkdir()
    (tmp_path / "transforms.json").touch()
    words = preparation_words(tmp_path, Path("o"), Scale())
    assert words[:4] == ["prepare", str(tmp_path / "images"), "--out", "o"]
    assert words[words.index("--poses") + 1] == str(tmp_path / "transforms.json")
    assert "--poses" not in preparation_words(tmp_path / "images", Path("o"), Scale())


def test_a_preparation_that_cannot_be_says_what_to_do(tmp_path):
    photos = tmp_path / "photos"
    photos.mkdir()
    for number in range(3):
        noise = np.random.default_rng(number).integers(0, 255, (90, 120, 3), dtype=np.uint8)
        cv2.imwrite(str(photos / f"{number}.jpg"), noise)
    out = tmp_path / "room.gnx"
    stale = tmp_path / "room.gnx.prepare" / "outcome.json"
    stale.parent.mkdir()
    stale.write_text('{"headline": "of an earlier run"}')
    job = PreparationJob(preparation_words(photos, out, Scale()), out)
    assert job.wait(120)
    assert not job.is_done
    assert "3" in job.problem
    assert "Traceback" not in job.problem
    assert job.preview is None
    assert job.outcome == {}


def test_a_preparation_can_be_cancelled(tmp_path):
    out = tmp_path / "room.gnx"
    job = PreparationJob(["rehearse", "lab", "--headless", "--out", str(out)], out)
    job.cancel()
    assert job.wait(30)
    assert job.problem.startswith("cancelled")
    assert not out.exists()
