"""Shapes drawn by VTK, held to rays cast by numpy, and put among splats by depth."""

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.pose import Pose
from scenes.state import Annotation, Avatar, SceneState
from studio.app.model.documents.added_mesh import Geometry
from studio.app.model.documents.document import Primitive, TwinEdits
from studio.app.viewport.by_hand.picking import ray_of
from studio.app.viewport.drawing.mesh_picture import MeshDrawer, MeshPicture
from studio.app.viewport.drawing.shapes import Line, Shown, Solid, Surface, shapes_of
from studio.app.viewport.drawing.view_picture import composite

OFF_CENTRE = Pinhole(120, 90, 100.0, 80.0, 70.0, 30.0)
CENTRED = Pinhole.from_fov(120, 90, 1.0)
EYE = look_at(np.array([2.0, -1.0, 1.5]), np.array([0.1, 0.2, 0.3]))
CENTRE, RADIUS = np.array([0.0, 0.1, 0.4]), 0.5


@pytest.fixture(scope="module")
def drawer():
    made = MeshDrawer()
    yield made
    made.close()


def ball(opacity=1.0):
    size = 2 * RADIUS
    pose = Pose(np.eye(3), CENTRE)
    return Solid("ball", "ball", (size, size, size), (1.0, 0.5, 0.2), pose, opacity)


def cast(camera):
    """(H, W) z of the ball by ray casting; inf where it is missed."""
    x, y = np.meshgrid(np.arange(camera.width_px) + 0.5, np.arange(camera.height_px) + 0.5)
    rays = camera.unproject(np.stack([x.ravel(), y.ravel()], axis=1))
    centre = EYE.inverse() @ CENTRE
    along = rays @ centre
    gap = along**2 - (centre @ centre - RADIUS**2)
    z = np.where(gap > 0, (along - np.sqrt(np.maximum(gap, 0))) * rays[:, 2], np.inf)
    return z.reshape(x.shape)


@pytest.mark.parametrize("camera", [CENTRED, OFF_CENTRE])
def test_depth_is_that_of_rays(drawer, camera):
    drawn, truth = drawer.draw([ball()], camera, EYE), cast(camera)
    both = np.isfinite(truth) & np.isfinite(drawn.depth)
    assert both.sum() > 500
    # The ball has 28 corners around: its edge differs by some pixels, its face by millimetres.
    assert (np.isfinite(truth) != np.isfinite(drawn.depth)).sum() < 0.06 * both.sum()
    assert np.quantile(np.abs(drawn.depth[both] - truth[both]), 0.95) < 0.02


@pytest.mark.parametrize(("splats_at", "shows_mesh"), [(1.0, False), (5.0, True), (0.0, True)])
def test_each_hides_what_is_behind_it(drawer, splats_at, shows_mesh):
    drawn = drawer.draw([ball()], CENTRED, EYE)
    picture = np.zeros((90, 120, 3), np.uint8)
    composite(picture, np.full((90, 120), splats_at, np.float32), drawn)
    assert (picture.max() > 0) == shows_mesh


def test_half_transparent_shapes_have_depth_and_their_own_colour(drawer):
    full, half = (drawer.draw([ball(o)], CENTRED, EYE) for o in (1.0, 0.5))
    inside = np.isfinite(full.depth)
    assert np.allclose(half.depth[inside], full.depth[inside])
    assert abs(int(half.rgba[inside][:, 3].mean()) - 128) < 4
    assert np.abs(half.rgba[inside][:, :3].astype(int) - full.rgba[inside][:, :3]).mean() < 6


def test_edges_have_no_steps_and_the_colour_of_what_they_are_of(drawer):
    sharp = drawer.draw([ball()], CENTRED, EYE)
    smoother = MeshDrawer(samples=4)
    smooth = smoother.draw([ball()], CENTRED, EYE)
    smoother.close()
    edge = (smooth.rgba[..., 3] > 0) & (smooth.rgba[..., 3] < 255)
    assert not ((sharp.rgba[..., 3] > 0) & (sharp.rgba[..., 3] < 255)).any()
    assert edge.sum() > 60
    # The outline is the same: what pixels cover adds up to as much.
    covered = [float(drawn.rgba[..., 3].astype(int).sum()) for drawn in (smooth, sharp)]
    assert covered[0] == pytest.approx(covered[1], rel=0.02)
    assert np.isfinite(smooth.depth[edge]).all()
    # An orange ball has orange edges, red at least twice as strong as blue and no more than before.
    red, _, blue = smooth.rgba[edge][:, :3].astype(int).T
    assert (red >= 2 * blue).mean() > 0.95
    assert red.max() <= int(sharp.rgba[..., 0].max()) + 8


def test_a_moved_body_moves_and_a_removed_one_goes(drawer):
    there = drawer.draw([ball()], CENTRED, EYE)
    moved = Solid("ball", "ball", (1.0, 1.0, 1.0), (1.0, 0.5, 0.2), Pose.from_yaw(0, (0, 1.2, 0.4)))
    elsewhere = drawer.draw([moved], CENTRED, EYE)
    assert (np.isfinite(there.depth) != np.isfinite(elsewhere.depth)).sum() > 300
    assert not np.isfinite(drawer.draw([], CENTRED, EYE).depth).any()


def test_a_cylinder_stands_upright(drawer):
    pose = Pose(np.eye(3), np.array([0.0, 0.0, 1.0]))
    tall = Solid("tall", "cylinder", (0.2, 0.2, 2.0), (1, 1, 1), pose)
    drawn = np.isfinite(drawer.draw([tall], CENTRED, EYE).depth)
    assert np.ptp(np.flatnonzero(drawn.any(axis=1))) > 2 * np.ptp(np.flatnonzero(drawn.any(axis=0)))


def test_lines_are_drawn_where_they_project(drawer):
    points = np.array([[0.0, 0.0, 0.5], [0.0, 0.6, 0.5]])
    drawn = drawer.draw([Line("line", points, (1, 1, 1), 3.0)], OFF_CENTRE, EYE)
    pixels, _ = OFF_CENTRE.project(EYE.inverse() @ points.mean(axis=0, keepdims=True))
    x, y = np.floor(pixels[0]).astype(int)
    assert np.isfinite(drawn.depth[y - 1 : y + 2, x - 1 : x + 2]).any()


def test_an_added_mesh_is_drawn_in_its_colours_where_it_stands(drawer):
    corners = np.array([[-0.4, 0, 0], [0.4, 0, 0], [0.4, 0, 0.8], [-0.4, 0, 0.8]], np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    red = Geometry(corners, faces, np.tile(np.array([250, 10, 10], np.uint8), (4, 1)))
    drawn = {}
    for x in (0.0, 0.6):
        pose = Pose.from_yaw(0.0, (x, 0.0, 0.0))
        drawn[x] = drawer.draw([Surface("mesh m", red, pose)], CENTRED, EYE)
        seen = np.isfinite(drawn[x].depth)
        rays = CENTRED.project(EYE.inverse() @ np.array([[x, 0.0, 0.4]]))[0][0]
        column, row = np.floor(rays).astype(int)
        assert seen[row, column]
        wanted = (EYE.inverse() @ np.array([x, 0.0, 0.4]))[2]
        assert drawn[x].depth[row, column] == pytest.approx(wanted, abs=0.03)
        red_, green, blue, alpha = drawn[x].rgba[row, column].astype(int)
        assert alpha == 255
        assert red_ > 80 > green == pytest.approx(blue, abs=3)
    assert (np.isfinite(drawn[0.0].depth) != np.isfinite(drawn[0.6].depth)).sum() > 300


def test_nothing_to_show_leaves_the_picture():
    picture = np.full((4, 4, 3), 7, np.uint8)
    empty = MeshPicture(np.zeros((4, 4, 4), np.uint8), np.full((4, 4), np.inf, np.float32))
    composite(picture, np.zeros((4, 4), np.float32), empty)
    assert (picture == 7).all()


def test_shapes_follow_what_is_shown_and_nobody_sees_their_own_head():
    head = look_at(np.array([0.0, 0.0, 1.6]), np.array([1.0, 0.0, 1.5]))
    state = SceneState(
        avatars={"ana": Avatar("ana", "remote", head, (np.zeros((5, 3)),), np.zeros((2, 3)))},
        annotations={"n": Annotation("n", "ana", np.zeros((2, 3)), (1, 0, 0))},
    )
    body = Primitive("p", "box", (1.0, 1.0, 0.4), (1, 1, 1), Pose.identity())

    def keys(shown, seen_by=""):
        return {
            shape.key
            for shape in shapes_of(
                state,
                shown=shown,
                twin=TwinEdits(primitives={"p": body}),
                world_from_rig=None,
                seen_by=seen_by,
            )
        }

    everything = keys(Shown())
    assert {"body p", "avatar ana body", "avatar ana ray", "note n"} <= everything
    assert not any(key.startswith("avatar") for key in keys(Shown(avatars=False)))
    own = {key for key in keys(Shown(), seen_by="ana") if key.startswith("avatar")}
    assert own == {"avatar ana ray", "avatar ana arms"}
    assert ray_of(CENTRED, EYE, 60.0, 45.0)[1] @ EYE.rotation[:, 2] > 0.999


def person_seen(drawer, *, away_m, role="remote"):
    """Picture of somebody who faces a viewer at their eyes' height."""
    head = look_at(np.array([0.0, 0.0, 1.6]), np.array([1.0, 0.0, 1.6]))
    state = SceneState(avatars={"ana": Avatar("ana", role, head)})
    shapes = shapes_of(state, shown=Shown(), twin=TwinEdits(), world_from_rig=None)
    eye = look_at(np.array([away_m, 0.0, 1.6]), np.array([0.0, 0.0, 1.35]))
    return drawer.draw(shapes, CENTRED, eye)


def test_a_person_is_one_opaque_figure_that_faces_where_they_look(drawer):
    drawn = person_seen(drawer, away_m=2.2)
    seen = np.isfinite(drawn.depth)
    assert (drawn.rgba[seen][:, 3] == 255).mean() > 0.99
    rows, columns = np.flatnonzero(seen.any(axis=1)), np.flatnonzero(seen.any(axis=0))
    assert np.ptp(rows) > 1.2 * np.ptp(columns), "taller than wide"
    assert 1.9 < drawn.depth[seen].min() < 2.3


@pytest.mark.parametrize(("role", "is_clear"), [("remote", True), ("local", False)])
def test_a_remote_person_before_the_viewer_is_transparent(drawer, role, is_clear):
    drawn = person_seen(drawer, away_m=0.55, role=role)
    seen = np.isfinite(drawn.depth)
    assert seen.sum() > 500
    assert (np.median(drawn.rgba[seen][:, 3]) < 200) == is_clear
