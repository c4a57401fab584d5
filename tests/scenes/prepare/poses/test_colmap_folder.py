"""A folder that COLMAP itself can read."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.cameras import Fisheye
from scenes.prepare.poses.colmap_folder import write_colmap_folder


def test_colmap_reads_what_was_written(filmed_ball, tmp_path):
    pycolmap = pytest.importorskip("pycolmap")
    write_colmap_folder(tmp_path / "out", filmed_ball, filmed_ball.views[:3])
    read = pycolmap.Reconstruction(str(tmp_path / "out" / "sparse" / "0"))
    assert read.num_images() == 3
    assert read.num_points3D() == len(filmed_ball.points)
    for image in read.images.values():
        view = next(view for view in filmed_ball.views if view.name == image.name)
        assert (tmp_path / "out" / "images" / image.name).read_bytes() == view.image.read_bytes()
        pose = image.cam_from_world() if callable(image.cam_from_world) else image.cam_from_world
        wanted = view.world_from_camera.inverse().matrix()[:3]
        np.testing.assert_allclose(pose.matrix(), wanted, atol=1e-12)
        camera = read.cameras[image.camera_id]
        assert (camera.width, camera.height) == (view.camera.width_px, view.camera.height_px)
        np.testing.assert_allclose(
            camera.params,
            [view.camera.fx, view.camera.fy, view.camera.cx, view.camera.cy],
        )
    points = np.array([read.points3D[k + 1].xyz for k in range(len(filmed_ball.points))])
    np.testing.assert_array_equal(points, filmed_ball.points)


def test_a_fisheye_is_refused(filmed_ball, tmp_path):
    view = replace(filmed_ball.views[0], camera=Fisheye.from_fov(96, 3.0))
    with pytest.raises(ValueError, match=r"00\.png: a Fisheye photo"):
        write_colmap_folder(tmp_path / "out", filmed_ball, [view])
    assert not (tmp_path / "out").exists()
