"""The thing that photos were taken around is marked as a person would mark it."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.package import ScenePackage
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.cutout.marks.marks_in_the_middle import looked_at, marks_in_the_middle
from scenes.splats import SplatCloud

CAMERA = Pinhole(240, 180, 200.0, 200.0, 120.0, 90.0)
CENTRE = np.array([0.3, -0.2, 0.1])
SIZE = np.array([0.3, 0.2, 0.2])


def splats_at(points):
    n = len(points)
    return SplatCloud(
        points, np.full((n, 3), 0.008), np.tile([1.0, 0, 0, 0], (n, 1)), np.full(n, 0.9),
        np.zeros((n, 1, 3)),
    )  # fmt: skip


def views_around(count):
    angles = np.linspace(0, 2 * np.pi, count, endpoint=False)
    away = np.column_stack(
        [0.9 * np.cos(angles), 0.9 * np.sin(angles), 0.5 + 0.05 * (np.arange(count) % 3)]
    )
    return tuple(
        ViewPoint(f"{k:02d}.jpg", CAMERA, look_at(CENTRE + step, CENTRE))
        for k, step in enumerate(away)
    )


def capture(views, *, crate=True, beside=False):
    rng = np.random.default_rng(4)
    points = [rng.uniform((-1.2, -1.2, -0.002), (1.2, 1.2, 0.002), (8000, 3))]
    if crate:
        points.append(CENTRE + SIZE * rng.uniform(-0.5, 0.5, (1500, 3)))
    if beside:
        other = CENTRE + np.array([0.45, 0.1, 0.0])
        points.append(other + SIZE * rng.uniform(-0.5, 0.5, (2500, 3)))
    cloud = splats_at(np.concatenate(points).astype(np.float32))
    footprint = np.array([[-1.0, -1.0], [1.0, 1.0]])
    return ScenePackage("c", cloud, (), (), Pose.identity(), footprint, None, (), views)


def box_of_crate(view):
    corners = CENTRE + SIZE * (np.array(np.meshgrid(*[[-0.5, 0.5]] * 3)).reshape(3, -1).T)
    pixels, _ = view.camera.project(view.world_from_camera.inverse() @ corners)
    return np.concatenate([pixels.min(axis=0), pixels.max(axis=0)])


@pytest.mark.parametrize("beside", [False, True])
def test_three_photos_from_different_sides_get_a_box_around_it(beside):
    package = capture(views_around(9), beside=beside)
    marks = marks_in_the_middle(package)
    views = {view.name: view for view in package.views}
    assert len(marks) == 3
    for name, prompt in marks.items():
        off = np.array(prompt.box_px) - box_of_crate(views[name])
        assert (off[:2] < 2).all()
        assert (off[2:] > -2).all()
        assert np.abs(off).max() < 9
    eyes = np.array([views[name].world_from_camera.translation for name in marks]) - CENTRE
    yaw = np.sort(np.arctan2(eyes[:, 1], eyes[:, 0]))
    assert np.diff(yaw).min() > np.deg2rad(60)


def test_the_point_looked_at_is_where_the_middle_rays_meet():
    assert looked_at(views_around(5)) == pytest.approx(CENTRE, abs=1e-9)


def test_photos_of_nothing_are_told():
    with pytest.raises(ValueError, match=r"nothing stands at .*--box VIEW"):
        marks_in_the_middle(capture(views_around(6), crate=False))


def test_photos_from_one_place_are_told():
    view = views_around(4)[0]
    with pytest.raises(ValueError, match="look the same way"):
        looked_at((view, ViewPoint("again.jpg", CAMERA, view.world_from_camera)))


def test_a_thing_that_no_photo_shows_whole_is_told():
    tele = replace(CAMERA, fx=900.0, fy=900.0)
    views = tuple(replace(view, camera=tele) for view in views_around(6))
    with pytest.raises(ValueError, match="no photo shows the whole"):
        marks_in_the_middle(capture(views))
