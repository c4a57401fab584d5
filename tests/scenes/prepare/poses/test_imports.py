"""COLMAP models and transforms.json, both of the photographed room."""

from __future__ import annotations

import json
import shutil

import cv2
import numpy as np
import pytest
from PIL import ExifTags, Image

from scenes.formats.storage.error import FormatError
from scenes.frames import OPENGL_FROM_OPENCV
from scenes.prepare.footage.capture import CaptureError
from scenes.prepare.poses.colmap_folder import import_colmap
from scenes.prepare.poses.given_poses import as_report, import_poses, load_imported
from scenes.prepare.poses.import_transforms import (
    _picture_names,
    ignored_in,
    import_transforms,
)
from scenes.prepare.poses.sfm.job import SfmOptions
from scenes.prepare.reconstruction import read_picture

QUICK = SfmOptions(features=1500, finest=False, threads=2)


@pytest.fixture(scope="module")
def colmap_project(captured, reconstructed, tmp_path_factory):
    """sparse/0 and images, as COLMAP leaves them, and what our own mapping made of it."""
    capture, work = captured
    project = tmp_path_factory.mktemp("project")
    shutil.copytree(work / "sfm" / "models" / "kept", project / "sparse" / "0")
    shutil.copytree(capture.folder, project / "images")
    return project, reconstructed[0]


def test_a_colmap_model_gives_the_same_as_mapping_it(colmap_project, tmp_path):
    project, wanted = colmap_project
    got = import_colmap(project, tmp_path)
    assert [v.name for v in got.views] == [v.name for v in wanted.views]
    for a, b in zip(got.views, wanted.views, strict=True):
        assert a.camera == b.camera
        assert np.array_equal(read_picture(a), read_picture(b))
        assert np.allclose(a.world_from_camera.matrix(), b.world_from_camera.matrix(), atol=1e-9)
    assert len(got.points) == len(wanted.points)


def test_what_a_colmap_project_lacks_is_named(colmap_project, tmp_path):
    project, _ = colmap_project
    with pytest.raises(FormatError, match="no COLMAP model"):
        import_colmap(project / "images", tmp_path / "a")
    copy = tmp_path / "copy"
    shutil.copytree(project, copy)
    for k in range(7):
        (copy / "images" / f"{k:02d}.jpg").unlink()
    with pytest.raises(CaptureError, match=r"7 of 12 photos .* \(00.jpg: there is no such photo;"):
        import_colmap(copy, tmp_path / "b")
    shutil.rmtree(copy / "images")
    with pytest.raises(FormatError, match="no folder `images`"):
        import_colmap(copy, tmp_path / "c")


def with_turn(picture, orientation):
    """The same pixels with an EXIF tag that has viewers turn them."""
    exif = Image.Exif()
    exif[ExifTags.Base.Orientation] = orientation
    jpeg = picture.read_bytes()
    body = b"Exif\0\0" + exif.tobytes().removeprefix(b"Exif\0\0")
    segment = b"\xff\xe1" + (len(body) + 2).to_bytes(2, "big") + body
    picture.write_bytes(jpeg[:2] + segment + jpeg[2:])


@pytest.mark.parametrize("orientation", [3, 6])
def test_photos_of_a_colmap_model_are_never_turned_by_exif(colmap_project, tmp_path, orientation):
    project, wanted = colmap_project
    copy = tmp_path / "copy"
    shutil.copytree(project, copy)
    for picture in (copy / "images").glob("*.jpg"):
        with_turn(picture, orientation)
    got = import_colmap(copy, tmp_path / "work")
    for a, b in zip(got.views, wanted.views, strict=True):
        assert np.array_equal(read_picture(a), read_picture(b))
        with Image.open(a.image) as stored:
            assert ExifTags.Base.Orientation not in stored.getexif()


def test_missing_photos_of_a_colmap_model_are_left_out_and_named(colmap_project, tmp_path):
    project, _ = colmap_project
    copy = tmp_path / "copy"
    shutil.copytree(project, copy)
    (copy / "images" / "03.jpg").unlink()
    (copy / "images" / "05.jpg").write_bytes(b"no picture")
    (copy / "images" / "07.jpg").rename(copy / "images" / "07.JPG")
    got = import_poses(copy, copy / "images", tmp_path / "work")
    assert len(got.views) == 10
    assert "07.JPG" in [view.name for view in got.views]
    assert got.left_out == (
        "03.jpg: there is no such photo",
        "05.jpg: no picture that can be read",
    )
    assert load_imported(tmp_path / "work").left_out == got.left_out
    report = as_report(got, copy, copy / "images")
    assert report.failed == ("03.jpg", "05.jpg")
    assert "2 of 12 photos with a pose are left out (03.jpg: there is no" in report.advice[0]


@pytest.fixture
def transforms(photographed, tmp_path):
    """The true poses as nerfstudio writes them."""
    folder = tmp_path / "app"
    shutil.copytree(photographed.folder, folder / "images")
    c = photographed.camera
    values = {
        "camera_model": "OPENCV",
        "w": c.width_px,
        "h": c.height_px,
        "fl_x": c.fx,
        "fl_y": c.fy,
        "cx": c.cx,
        "cy": c.cy,
        "frames": [
            {
                "file_path": f"images/{name}",
                "transform_matrix": (world_from_camera @ OPENGL_FROM_OPENCV.inverse())
                .matrix()
                .tolist(),
            }
            for name, world_from_camera in photographed.world_from_camera.items()
        ],
    }
    return folder, values


def written(folder, values):
    path = folder / "transforms.json"
    path.write_text(json.dumps(values))
    return path


def test_poses_of_an_app_keep_their_metres_and_get_points(transforms, photographed, tmp_path):
    folder, values = transforms
    written(folder, values)
    got = import_transforms(folder, tmp_path / "work", options=QUICK)
    for view, world_from_camera in zip(
        got.views, photographed.world_from_camera.values(), strict=True
    ):
        assert view.camera == photographed.camera
        assert np.allclose(view.world_from_camera.matrix(), world_from_camera.matrix(), atol=1e-9)
    assert [view.name for view in got.views] == list(photographed.world_from_camera)
    x, z = np.abs(got.points[:, 0]), np.abs(got.points[:, 2])
    on_shell = np.minimum.reduce([x, np.abs(got.points[:, 1] - 4), z])
    crate_top = np.abs(z - 0.9)
    assert len(got.points) > 300
    assert np.median(np.minimum(on_shell, crate_top)) < 0.02
    assert np.median(got.errors_px) < 1.0


@pytest.mark.parametrize(
    ("files", "names"),
    [
        (["a/IMG_1.JPG", "frame.02", "..\\b\\3.png"], ["IMG_1.jpg", "frame.02.jpg", "3.jpg"]),
        (["left/1.jpg", "right/1.png"], ["frame-0000.jpg", "frame-0001.jpg"]),
        (["my photo.jpg", "", "2.jpg"], ["frame-0000.jpg", "frame-0001.jpg", "2.jpg"]),
    ],
)
def test_photos_keep_their_names_where_these_are_fit(files, names):
    assert _picture_names(files) == names


def test_distortion_of_an_app_is_taken_out(transforms, tmp_path):
    folder, values = transforms
    values |= {"k1": -0.08, "k2": 0.01}
    values["frames"] = values["frames"][:4]
    height, width = values["h"], values["w"]
    grid = np.stack(np.meshgrid(np.arange(width), np.arange(height)), -1).astype(np.float32)
    matrix = np.array(
        [
            [values["fl_x"], 0, values["cx"] - 0.5],
            [0, values["fl_y"], values["cy"] - 0.5],
            [0, 0, 1],
        ]
    )
    straight = cv2.undistortPoints(
        grid.reshape(-1, 1, 2), matrix, np.array([-0.08, 0.01, 0, 0]), P=matrix
    ).reshape(height, width, 2)
    for frame in values["frames"]:
        path = folder / frame["file_path"]
        bent = cv2.remap(cv2.imread(str(path)), straight, None, cv2.INTER_LINEAR)
        cv2.imwrite(str(path.with_suffix(".png")), bent)
        frame["true"] = str(path)
        frame["file_path"] = frame["file_path"].replace(".jpg", "")
        path.rename(path.with_suffix(".true"))
    written(folder, values)
    got = import_transforms(folder, tmp_path / "work", options=QUICK)
    for view, frame in zip(got.views, values["frames"], strict=True):
        true = cv2.imread(str(folder / frame["true"].replace(".jpg", ".true")), 0)
        flat = cv2.cvtColor(read_picture(view), cv2.COLOR_RGB2GRAY)
        for part in (np.s_[40:180, 40:240], np.s_[180:320, 240:440], np.s_[180:320, 40:240]):
            shift, _ = cv2.phaseCorrelate(np.float64(true[part]), np.float64(flat[part]))
            assert np.hypot(*shift) < 0.1


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda v: (v.pop("fl_x"), v.pop("fl_y")), "frame 0: neither fl_x nor camera_angle_x"),
        (lambda v: v.update(fl_x="wide"), "frame 0: fl_x is 'wide'"),
        (lambda v: v.update(w=640), "the picture is 480×360 px, the file says 640×360"),
        (lambda v: v.update(camera_model="EQUIRECTANGULAR"), "EQUIRECTANGULAR"),
        (lambda v: v.update(frames=[]), "frames: missing or empty"),
        (lambda v: v.update(is_fisheye=True), "camera_model 'OPENCV' and is_fisheye contradict"),
        (lambda v: v.update(ftheta_p0=1.5), "ftheta_p0 is 1.5, which seems to describe the lens"),
        (lambda v: v.update(frames=[{**f, "k4": 0.1} for f in v["frames"]]), "k4 is 0.1, which"),
        (lambda v: [f.pop("file_path") for f in v["frames"]], "file_path is missing"),
        (
            lambda v: [f.update(transform_matrix=(2 * np.eye(4)).tolist()) for f in v["frames"]],
            "no rigid motion",
        ),
    ],
)
def test_what_a_file_of_an_app_lacks_is_named(transforms, tmp_path, change, message):
    folder, values = transforms
    change(values)
    with pytest.raises(FormatError, match=message):
        import_transforms(written(folder, values), tmp_path / "work")


def test_bad_frames_are_left_out_and_named(transforms, tmp_path):
    folder, values = transforms
    frames = values["frames"]
    frames[1].pop("file_path")
    frames[2].update(file_path="images/99.jpg")
    frames[3].pop("transform_matrix")
    frames[5].update(transform_matrix=(2 * np.eye(4)).tolist())
    frames[7].update(transform_matrix=np.full((4, 4), np.nan).tolist())
    frames[9].update(fl_x="wide")
    path = written(folder, values)
    got = import_poses(path, folder / "images", tmp_path / "work", options=QUICK)
    assert len(got.views) == 6
    faults = dict(words.split(": ", 1) for words in got.left_out)
    assert faults["frame 1"] == "file_path is missing"
    assert faults["images/99.jpg"].startswith("there is no picture")
    assert faults["images/03.jpg"].startswith("transform_matrix is missing")
    assert faults["images/05.jpg"].startswith("transform_matrix is no rigid motion")
    assert faults["images/07.jpg"].startswith("transform_matrix is missing or not 4×4 finite")
    assert faults["images/09.jpg"] == "fl_x is 'wide'"
    advice = as_report(got, path, folder / "images").advice[0]
    assert advice.startswith("6 of 12 photos with a pose are left out (frame 1: file_path")


def test_a_file_most_of_whose_photos_are_missing_is_refused(transforms, tmp_path):
    folder, values = transforms
    for number in range(7):
        (folder / "images" / f"{number:02d}.jpg").unlink()
    with pytest.raises(CaptureError, match="7 of 12 photos cannot be used"):
        import_transforms(written(folder, values), tmp_path / "work", options=QUICK)


def test_backslashes_and_byte_order_marks_are_read(transforms, photographed, tmp_path):
    folder, values = transforms
    for frame in values["frames"]:
        frame["file_path"] = "C:\\scan\\" + frame["file_path"].replace("/", "\\")
    values["exposure_bracket"] = 3
    values["aabb_scale"] = 16
    path = folder / "transforms.json"
    path.write_text(json.dumps(values), encoding="utf-16")
    assert ignored_in(path) == ("exposure_bracket",)
    path.write_text(json.dumps(values), encoding="utf-8-sig")
    got = import_transforms(folder, tmp_path / "work", options=QUICK)
    assert len(got.views) == len(photographed.world_from_camera)
    assert as_report(got, path, folder / "images").advice == (
        "transforms.json has keys that are not understood and not used: exposure_bracket",
    )


def test_photos_of_an_app_are_never_turned_by_exif(transforms, photographed, tmp_path):
    folder, values = transforms
    for picture in (folder / "images").glob("*.jpg"):
        with_turn(picture, 3)
    got = import_transforms(written(folder, values), tmp_path / "work", options=QUICK)
    for view, name in zip(got.views, photographed.world_from_camera, strict=True):
        stored = cv2.imread(str(photographed.folder / name))[..., ::-1]
        assert np.abs(read_picture(view).astype(int) - stored).mean() < 8.0
    assert np.median(got.errors_px) < 1.0


def test_photos_whose_stated_size_is_the_turned_one_are_turned(transforms, photographed, tmp_path):
    folder, values = transforms
    for name in photographed.world_from_camera:
        picture = folder / "images" / name
        turned = cv2.rotate(cv2.imread(str(picture)), cv2.ROTATE_90_COUNTERCLOCKWISE)
        cv2.imwrite(str(picture), turned, [cv2.IMWRITE_JPEG_QUALITY, 95])
        with_turn(picture, 6)
    got = import_transforms(written(folder, values), tmp_path / "work", options=QUICK)
    assert got.views[0].camera == photographed.camera


def test_files_that_are_no_transforms_are_refused(tmp_path):
    (tmp_path / "transforms.json").write_text("{")
    with pytest.raises(FormatError, match="not JSON"):
        import_transforms(tmp_path, tmp_path / "work")
    with pytest.raises(FormatError, match="no such file"):
        import_transforms(tmp_path / "absent.json", tmp_path / "work")


def test_poses_of_other_pictures_are_found_out(transforms, tmp_path):
    folder, values = transforms
    frames = values["frames"]
    matrices = [frame["transform_matrix"] for frame in frames]
    order = np.random.default_rng(0).permutation(len(frames))
    for frame, other in zip(frames, order, strict=True):
        frame["transform_matrix"] = matrices[other]
    written(folder, values)
    with pytest.raises(CaptureError, match="poses do not belong to these pictures"):
        import_transforms(folder, tmp_path / "work", options=QUICK)
