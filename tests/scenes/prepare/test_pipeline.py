"""From poses of another program to a package: a small ball, so that it takes seconds."""

import errno
import shutil
from dataclasses import replace

import numpy as np
import pytest

from scenes.formats.registry import write_splats
from scenes.package import load_package
from scenes.pose import Pose
from scenes.prepare import pipeline
from scenes.prepare.align.alignment import Anchor
from scenes.prepare.align.metric import stated_alignment
from scenes.prepare.cutout.cutout import undo_cut
from scenes.prepare.footage.capture import CaptureError
from scenes.prepare.options import KnownObject, PrepareOptions
from scenes.prepare.pipeline import prepare
from scenes.prepare.poses.colmap_folder import write_colmap_folder
from scenes.prepare.progress import Cancelled, silent
from scenes.prepare.stages import open_work_folder
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud, concatenate
from tests.scenes.prepare.conftest import painted_ball


@pytest.fixture(scope="module")
def project(filmed_ball, tmp_path_factory):
    """The ball's photos and poses as a COLMAP project."""
    folder = tmp_path_factory.mktemp("project")
    write_colmap_folder(folder, filmed_ball, filmed_ball.views)
    return folder


class Ticking:
    """A clock of one second a look."""

    def __init__(self):
        self.now = 0.0

    def __call__(self):
        self.now += 1.0
        return self.now


def prepared(project, folder, progress=silent, **options):
    work = open_work_folder(folder / "work", seconds=Ticking(), progress=progress)
    chosen = PrepareOptions(
        **{"poses": project, "collision": False, "steps": 30, "quality": "preview"} | options
    )
    return prepare(
        project / "images",
        folder / "ball.gnx",
        work=work,
        options=chosen,
        renderer=NativeRenderer(),
    )


def test_given_poses_are_trained_on_and_saved(project, filmed_ball, tmp_path):
    result = prepared(project, tmp_path)
    package = load_package(tmp_path / "ball.gnx")
    assert [view.name for view in package.views] == [view.name for view in filmed_ball.views]
    assert [stage.name for stage in package.stages][:2] == ["poses", "alignment"]
    assert result.sfm.mapper.endswith(project.name)
    assert "estimated" in result.alignment.warnings[0]
    assert result.training.history[-1].iteration == 30


def test_poses_in_metres_keep_their_scale(project, tmp_path):
    result = prepared(project, tmp_path, metric_poses=True)
    assert result.alignment.world_from_reconstruction.scale == 1.0
    assert "app" in result.alignment.warnings[0]


def test_trained_splats_in_the_frame_of_the_poses_become_the_room(project, tmp_path):
    file = tmp_path / "trained.ply"
    write_splats(file, painted_ball())
    result = prepared(project, tmp_path, splats=file, steps=None)
    room = load_package(tmp_path / "ball.gnx").room
    scale = result.alignment.world_from_reconstruction.scale
    assert len(room) == len(painted_ball())
    assert np.allclose(np.median(room.scales), 0.05 * scale, rtol=1e-4)
    assert result.training.psnr_db > 35
    assert "trained.ply" in result.training.trainer


def test_trained_splats_in_the_metric_world_are_taken_too(project, tmp_path):
    file = tmp_path / "trained.ply"
    write_splats(file, painted_ball())
    first = prepared(project, tmp_path, splats=file, steps=None)
    metric = tmp_path / "metric.ply"
    write_splats(metric, first.training.cloud)
    again = prepared(project, tmp_path, splats=metric, steps=None)
    assert np.allclose(again.training.cloud.means, first.training.cloud.means, atol=1e-5)


def test_trained_splats_in_a_third_frame_are_refused(project, tmp_path):
    file = tmp_path / "foreign.ply"
    cloud = painted_ball()
    write_splats(file, replace(cloud, means=3 * cloud.means[:, [1, 2, 0]] + 2))
    with pytest.raises(ValueError, match=r"foreign\.ply: draws the photos at .* dB, wanted"):
        prepared(project, tmp_path, splats=file, steps=None)
    assert not (tmp_path / "ball.gnx").exists()


def test_a_reopened_preparation_makes_nothing_again(project, tmp_path, monkeypatch):
    first = prepared(project, tmp_path)

    def never(*words, **named):
        raise AssertionError("made again")

    for name in ("import_poses", "metric_alignment", "train_room"):
        monkeypatch.setattr(pipeline, name, never)
    again = prepared(project, tmp_path)
    assert again.package.stages[:2] == first.package.stages[:2]
    assert np.array_equal(again.package.room.means, first.package.room.means)
    assert np.array_equal(
        again.alignment.world_from_reconstruction.matrix(),
        first.alignment.world_from_reconstruction.matrix(),
    )


def test_what_was_finished_before_a_cancellation_is_kept(project, tmp_path, monkeypatch):
    def stop(done, note):
        if note.startswith("training"):
            raise Cancelled

    with pytest.raises(Cancelled):
        prepared(project, tmp_path, progress=stop)
    assert not (tmp_path / "ball.gnx").exists()
    monkeypatch.setattr(pipeline, "import_poses", None)
    prepared(project, tmp_path)
    assert load_package(tmp_path / "ball.gnx").views


def test_a_disk_that_fills_while_the_package_is_written_keeps_the_stages(
    project, tmp_path, monkeypatch
):
    def full(package, target):
        raise OSError(errno.ENOSPC, "No space left on device", str(target))

    with monkeypatch.context() as patch:
        patch.setattr(pipeline, "save_package", full)
        with pytest.raises(OSError, match="No space"):
            prepared(project, tmp_path)
    monkeypatch.setattr(pipeline, "train_room", None)
    prepared(project, tmp_path)
    assert load_package(tmp_path / "ball.gnx").views


def test_stray_splats_go_are_counted_and_come_back(project, tmp_path):
    stray = SplatCloud(
        np.array([[0.0, 0.0, 1.9], [0.4, 1.8, 0.2]], dtype=np.float32),
        np.full((2, 3), 0.004, dtype=np.float32),
        np.tile(np.array([1, 0, 0, 0], dtype=np.float32), (2, 1)),
        np.full(2, 0.9, dtype=np.float32),
        np.zeros((2, 1, 3), dtype=np.float32),
    )
    file = tmp_path / "trained.ply"
    whole = concatenate([painted_ball(), stray])
    write_splats(file, whole)
    result = prepared(project, tmp_path, splats=file, steps=None)
    package = load_package(tmp_path / "ball.gnx")
    assert result.floaters == 2
    assert len(package.room) == len(whole) - 2
    back = undo_cut(package).room
    assert np.array_equal(back.means, result.training.cloud.means)
    assert np.array_equal(back.opacities, result.training.cloud.opacities)
    kept = prepared(project, tmp_path, splats=file, steps=None, keep_floaters=True)
    assert kept.floaters == 0
    assert len(kept.package.room) == len(whole)


def test_photos_that_the_poses_do_not_know_are_told(project, tmp_path):
    folder = tmp_path / "project"
    shutil.copytree(project, folder)
    shutil.copy(next((folder / "images").iterdir()), folder / "images" / "zz.png")
    assert "16 of 17 photos" in prepared(folder, tmp_path).sfm.advice[0]


def test_poses_without_photos_are_refused(project, tmp_path):
    work = open_work_folder(tmp_path / "work", seconds=Ticking(), progress=silent)
    with pytest.raises(CaptureError, match="no folder of photos"):
        prepare(
            tmp_path / "absent",
            tmp_path / "x.gnx",
            work=work,
            options=PrepareOptions(poses=project),
            renderer=NativeRenderer(),
        )


def test_a_known_object_gives_the_scale_and_its_boxes_are_kept_in_mind(
    project, filmed_ball, tmp_path
):
    ball = painted_ball().means.astype(np.float64)
    boxes = {}
    for view in filmed_ball.views[::5]:
        pixels, _ = view.camera.project(view.world_from_camera.inverse() @ ball)
        boxes[view.name] = (*pixels.min(axis=0).tolist(), *pixels.max(axis=0).tolist())
    # Somebody measured a ball of 24 cm where the poses have one of 2 units.
    result = prepared(project, tmp_path, known_object=KnownObject(0.12 * ball, boxes))
    scale = result.alignment.world_from_reconstruction.scale
    assert scale == pytest.approx(0.12, rel=0.02)
    larger = prepared(project, tmp_path, known_object=KnownObject(0.24 * ball, boxes))
    assert larger.alignment.world_from_reconstruction.scale == pytest.approx(2 * scale, rel=1e-3)


def test_axes_are_stretched_on_demand_only_and_it_is_told(project, tmp_path, monkeypatch):
    square = 0.1 * np.array([[-1.0, 0, 1], [1, 0, 1], [1, 0, -1], [-1, 0, -1]])
    # Measured 3 % too narrow along x, and exactly as high as printed.
    seen = square * (1 / 1.03, 1, 1)

    def with_code(reconstruction, options, progress):
        anchor = Anchor("code", 0.2, Pose(np.eye(3), np.zeros(3)), seen, 0.1, 0.1, 0.1, ("a", "b"))
        found = stated_alignment(reconstruction, rng=np.random.default_rng(0))
        return replace(found, anchors=(anchor,))

    monkeypatch.setattr(pipeline, "metric_alignment", with_code)
    plain = prepared(project, tmp_path, sides_m=0.2)
    assert plain.axis_scale.anisotropy == pytest.approx(0.03, abs=2e-3)
    assert not any("Stretching" in words for words in plain.alignment.warnings)
    told = prepared(project, tmp_path, sides_m=0.2, per_axis=True)
    factors = np.array(told.axis_scale.factors)
    assert factors[[0, 2]] == pytest.approx([1.03, 1.0], abs=2e-3)
    assert "3.0" in told.alignment.warnings[-1]
    assert "scale per axis" in [stage.name for stage in told.package.stages]
    whole = undo_cut(told.package) if told.floaters else told.package
    was = undo_cut(plain.package) if plain.floaters else plain.package
    assert whole.room.means == pytest.approx(was.room.means * factors, rel=1e-5)
    eyes = [
        np.array([view.world_from_camera.translation for view in package.views])
        for package in (whole, was)
    ]
    assert eyes[0] == pytest.approx(eyes[1] * factors)
