from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import cv2
import numpy as np
import pycolmap
import pytest

from scenes.pose import rotation_angle
from scenes.prepare.footage.capture import Capture, CaptureError, CaptureKind, CaptureOptions, Frame
from scenes.prepare.footage.gather import gather
from scenes.prepare.poses.sfm import mapping as sfm_mapping
from scenes.prepare.poses.sfm import run as sfm_module
from scenes.prepare.poses.sfm.job import Attempt, JobResult, SfmOptions, job_from_json
from scenes.prepare.poses.sfm.run import WorkerError, reconstruct
from scenes.prepare.poses.sfm.verdict import describe, judge_result
from scenes.prepare.progress import Cancelled
from scenes.prepare.reconstruction import read_picture

QUICK = SfmOptions(features=1500, finest=False, threads=2)
FEW = CaptureOptions(frames=12, least_frames=3)


def similarity(source, target):
    """Scale, rotation and shift that take points to points (Umeyama 1991)."""
    a, b = source - source.mean(axis=0), target - target.mean(axis=0)
    u, s, vt = np.linalg.svd(b.T @ a)
    signs = np.array([1.0, 1.0, np.sign(np.linalg.det(u @ vt))])
    rotation = (u * signs) @ vt
    scale = float((s * signs).sum() / (a**2).sum())
    return scale, rotation, target.mean(axis=0) - scale * rotation @ source.mean(axis=0)


def test_every_photo_is_placed_where_it_was_taken(reconstructed, photographed):
    reconstruction, report, _ = reconstructed
    assert len(reconstruction.views) == len(report.placed) == 12
    assert not report.failed
    assert not report.advice
    assert report.error_px < 1.0
    true = [photographed.world_from_camera[view.name] for view in reconstruction.views]
    centres = np.array([view.world_from_camera.translation for view in reconstruction.views])
    wanted = np.array([world_from_camera.translation for world_from_camera in true])
    scale, rotation, shift = similarity(centres, wanted)
    off = np.linalg.norm(scale * centres @ rotation.T + shift - wanted, axis=1)
    assert off.max() < 0.02
    for view, world_from_camera in zip(reconstruction.views, true, strict=True):
        turned = (rotation @ view.world_from_camera.rotation).T @ world_from_camera.rotation
        assert rotation_angle(turned) < np.radians(0.5)


def test_cameras_pictures_and_points_belong_together(reconstructed, photographed):
    reconstruction, _, _ = reconstructed
    assert [view.name for view in reconstruction.views] == sorted(photographed.world_from_camera)
    camera = reconstruction.views[0].camera
    assert camera.fx == pytest.approx(photographed.camera.fx, rel=0.02)
    agree = []
    for view in reconstruction.views:
        picture = read_picture(view)
        pixels, seen = view.camera.project(view.world_from_camera.inverse() @ reconstruction.points)
        x, y = np.floor(pixels[seen]).astype(int).T.clip(0)
        x, y = np.minimum(x, picture.shape[1] - 1), np.minimum(y, picture.shape[0] - 1)
        off = np.abs(picture[y, x].astype(int) - reconstruction.colours[seen]).max(axis=1)
        agree.append(np.mean(off < 40))
    assert np.mean(agree) > 0.6
    assert len(reconstruction.points) > 300


def test_progress_grows_to_the_end(reconstructed):
    told = [done for done, _ in reconstructed[2]]
    assert told == sorted(told)
    assert told[-1] == 1.0
    assert len(set(told)) > 8


def test_a_second_run_does_nothing_again(reconstructed, captured):
    capture, work = captured
    stages = work / "sfm" / "stages.json"
    stamp = stages.stat().st_mtime_ns
    again, report = reconstruct(capture, work, options=QUICK)
    assert stages.stat().st_mtime_ns == stamp
    assert report == reconstructed[1]
    assert np.array_equal(again.points, reconstructed[0].points)


def test_a_killed_run_goes_on_after_what_was_finished(reconstructed, captured, tmp_path):
    capture, work = captured
    shutil.copytree(work / "sfm", tmp_path / "sfm")
    stages = tmp_path / "sfm" / "stages.json"
    stamps = json.loads(stages.read_text())
    for stage in ("matching", "mapping", "undistortion"):
        stamps[stage] = {"key": stamps[stage]["key"], "finished": False}
    stages.write_text(json.dumps(stamps))
    told = []
    _, report = reconstruct(
        capture, tmp_path, options=QUICK, progress=lambda done, note: told.append(note)
    )
    assert len(report.placed) == 12
    assert not any(note.startswith("features") for note in told)
    assert report.times["extraction"] == reconstructed[1].times["extraction"]


def test_other_options_redo_only_what_depends_on_them(reconstructed, captured, tmp_path):
    capture, work = captured
    shutil.copytree(work / "sfm", tmp_path / "sfm")
    told = []
    options = SfmOptions(features=1500, finest=False, threads=2, mapper="global")
    _, report = reconstruct(
        capture, tmp_path, options=options, progress=lambda done, note: told.append(note)
    )
    assert report.mapper == "global"
    assert len(report.placed) == 12
    assert not any(note.startswith(("features", "matching: ")) for note in told)


def test_it_can_be_stopped_and_leaves_no_process(captured, tmp_path):
    capture, _ = captured

    def stop(done, note):
        if done > 0:
            raise Cancelled

    with pytest.raises(Cancelled):
        reconstruct(capture, tmp_path, options=QUICK, progress=stop)
    reconstruct(capture, tmp_path, options=QUICK)


def test_a_crash_is_an_error_with_the_log(captured, tmp_path, monkeypatch):
    capture, _ = captured
    broken = tmp_path / "scenes"
    monkeypatch.setattr(sys, "executable", str(_crashing_python(tmp_path)))
    with pytest.raises(WorkerError, match=r"signal 6: it went wrong here.*log\.txt"):
        reconstruct(capture, broken, options=QUICK)


def test_a_full_disk_is_said_to_be_full(captured, tmp_path, monkeypatch):
    capture, _ = captured
    monkeypatch.setattr(sys, "executable", str(_crashing_python(tmp_path)))
    usage = shutil.disk_usage(tmp_path)._replace(free=1000)
    monkeypatch.setattr(sfm_module.shutil, "disk_usage", lambda _: usage)
    with pytest.raises(OSError, match="the disk is full"):
        reconstruct(capture, tmp_path / "work", options=QUICK)


def _crashing_python(folder: Path) -> Path:
    script = folder / "python"
    script.write_text("#!/bin/sh\necho it went wrong here >&2\nkill -ABRT $$\n")
    script.chmod(0o755)
    return script


def test_photos_of_different_rooms_do_not_become_one(speckled, tmp_path):
    folder = tmp_path / "photos"
    folder.mkdir()
    for k in range(8):
        picture = speckled(np.random.default_rng(100 + k))
        cv2.imwrite(str(folder / f"{k}.jpg"), picture)
    capture = gather(folder, tmp_path, options=FEW)
    with pytest.raises(CaptureError, match=r"only \d of 8 pictures could be placed.*wanted"):
        reconstruct(capture, tmp_path, options=QUICK)


def test_a_photo_that_rests_on_a_corner_of_itself_is_taken_out(reconstructed, captured):
    model, job = kept_model(captured)
    weak = next(image for image in model.images.values() if image.name == "05.jpg")
    observations = pycolmap.ObservationManager(model)
    seen = [k for k, point in enumerate(weak.points2D) if point.has_point3D()]
    corner = np.argsort([np.linalg.norm(weak.points2D[k].xy) for k in seen])[:8]
    for k in set(seen) - {seen[i] for i in corner}:
        observations.delete_observation(weak.image_id, k)
    sfm_mapping._take_out_unsure(model, job)
    assert [image.name for image in model.images.values() if not image.has_pose] == ["05.jpg"]


def test_photos_that_hold_each_other_all_stay(reconstructed, captured):
    model, job = kept_model(captured)
    sfm_mapping._take_out_unsure(model, job)
    assert all(image.has_pose for image in model.images.values())


def kept_model(captured):
    """The model of all photos as it was kept, and its job."""
    _, work = captured
    job = job_from_json(json.loads((work / "sfm" / "job.json").read_text()))
    return pycolmap.Reconstruction(work / "sfm" / "models" / "kept"), job


def test_only_sift_is_ever_asked_for():
    code = Path(sfm_module.__file__).with_name("features.py").read_text(encoding="utf-8")
    assert "FeatureExtractorType.SIFT" in code
    assert "FeatureMatcherType.SIFT_BRUTEFORCE" in code
    assert "ALIKED" not in code


def test_the_studio_itself_never_loads_pycolmap():
    done = subprocess.run(
        [
            sys.executable,
            "-c",
            "import sys, scenes.prepare.poses.sfm.run; print('pycolmap' in sys.modules)",
        ],
        capture_output=True,
        text=True,
        env=os.environ | {"PYTHONPATH": str(Path(__file__).parents[4])},
        check=True,
    )
    assert done.stdout.strip() == "False"


@pytest.mark.parametrize(
    "wrong",
    [{"matching": "all"}, {"mapper": "best"}, {"features": 3}, {"least_registered": 0.0}],
)
def test_options_that_make_no_sense_are_refused(wrong):
    with pytest.raises(ValueError, match=f"SfmOptions.*{next(iter(wrong.values()))}"):
        SfmOptions(**wrong)


def imagined(count, *, video=True):
    frames = tuple(
        Frame(f"{k:04d}.jpg", f"room.mp4 at 0:{k:04.1f}" if video else f"p{k}.jpg", 0.3, "")
        for k in range(count)
    )
    kind = CaptureKind.VIDEO if video else CaptureKind.PHOTOS
    return Capture(kind, "room.mp4", Path(), frames)


def found(capture, placed, links, *, features=1000, turning=0.0):
    names = [frame.name for frame in capture.frames]
    return JobResult(
        (Attempt("incremental", (tuple(names[i] for i in placed),)),),
        dict.fromkeys(names, features),
        tuple((i, j, 100) for i, j in links),
        turning,
        0.5,
        None,
        {},
    )


def test_the_verdict_names_the_passage_to_film_again():
    capture = imagined(20)
    links = [(i, i + 1) for i in range(19)]
    verdict = judge_result(capture, found(capture, [*range(8), *range(12, 20)], links))
    assert len(verdict.failed) == 4
    assert "4 pictures (0:08.0–0:11.0)" in verdict.advice[0]
    assert any("film these passages again" in line for line in verdict.advice)


def test_the_verdict_names_groups_that_share_nothing():
    capture = imagined(20, video=False)
    links = [(i, i + 1) for i in range(19) if i != 9]
    verdict = judge_result(capture, found(capture, range(10), links))
    text = " ".join(verdict.advice)
    assert "2 groups that show nothing in common" in text
    assert "p0.jpg–p9.jpg" in text
    assert "p10.jpg–p19.jpg" in text


def test_the_verdict_tells_turning_and_bare_walls():
    capture = imagined(12)
    links = [(i, i + 1) for i in range(11)]
    turning = judge_result(capture, found(capture, range(12), links, turning=0.9))
    assert any("walk sideways" in line for line in turning.advice)
    bare = judge_result(capture, found(capture, range(6), links, features=20))
    assert any("hardly any texture" in line for line in bare.advice)
    assert not judge_result(capture, found(capture, range(12), links)).advice


def test_long_lists_are_cut_short():
    capture = imagined(40)
    words = describe(capture, [frame.name for frame in capture.frames[::2]])
    assert words.startswith("20 pictures")
    assert "and 14 more passages" in words


@pytest.mark.slow
def test_real_photos_of_a_street_find_their_places(real_photos, tmp_path):
    capture = gather(real_photos, tmp_path)
    reconstruction, report = reconstruct(capture, tmp_path)
    assert len(capture.frames) == 29
    assert len(reconstruction.views) >= 26
    assert report.error_px < 1.0
    steps = np.linalg.norm(
        np.diff([view.world_from_camera.translation for view in reconstruction.views], axis=0),
        axis=1,
    )
    assert steps.max() < 4 * np.median(steps)
