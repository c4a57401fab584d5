"""What every renderer must do, checked against formulas rather than against another renderer."""

import numpy as np
import pytest

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.render.renderer import LOW_PASS_PX2, PosedSplats, RenderOptions
from scenes.splats import SplatCloud, concatenate

PINHOLE = Pinhole(41, 31, 120.0, 120.0, 20.5, 15.5)
FISHEYE = Fisheye.from_fov(81, np.radians(240))
HERE = Pose.identity()


def test_a_round_splat_has_the_formulas_profile(renderer, ball, at_origin):
    sigma_px = np.sqrt((120.0 * 0.02 / 2.0) ** 2 + LOW_PASS_PX2)
    picture = renderer.render(at_origin(ball((0, 0, 2.0))), PINHOLE, HERE)
    distance = np.arange(41) - 20.0
    wanted = 0.8 * np.exp(-0.5 * (distance / sigma_px) ** 2)
    wanted[wanted < 1 / 255] = 0.0
    np.testing.assert_allclose(picture.alpha[15], wanted, atol=2e-6)
    np.testing.assert_allclose(picture.alpha[15 - 10 : 15 + 11, 20], wanted[10:31], atol=2e-6)
    np.testing.assert_allclose(picture.rgb, picture.alpha[..., None] * [1.0, 0.5, 0.25], atol=2e-6)
    assert picture.rgb.dtype == picture.alpha.dtype == picture.depth.dtype == np.float32


def test_antialiasing_keeps_the_light_of_a_tiny_splat(renderer, ball, at_origin):
    sharp = 120.0 * 0.001 / 2.0
    wanted = 0.8 * sharp**2 / (sharp**2 + LOW_PASS_PX2)
    options = RenderOptions(antialias=True)
    picture = renderer.render(at_origin(ball((0, 0, 2.0), sigma_m=0.001)), PINHOLE, HERE, options)
    assert picture.alpha[15, 20] == pytest.approx(wanted, rel=1e-5)


def test_alpha_of_one_splat_stops_at_its_limit(renderer, ball, at_origin):
    picture = renderer.render(at_origin(ball((0, 0, 2.0), opacity=1.0)), PINHOLE, HERE)
    assert picture.alpha[15, 20] == pytest.approx(0.99, abs=1e-6)


def test_the_background_shines_through(renderer, ball, at_origin):
    options = RenderOptions(background=(0.1, 0.2, 0.9))
    picture = renderer.render(at_origin(ball((0, 0, 2.0))), PINHOLE, HERE, options)
    alpha = picture.alpha[..., None]
    wanted = alpha * [1.0, 0.5, 0.25] + (1 - alpha) * [0.1, 0.2, 0.9]
    np.testing.assert_allclose(picture.rgb, wanted, atol=2e-6)


def test_depth_is_z_for_a_pinhole_and_range_for_a_fisheye(renderer, ball, at_origin):
    objects = at_origin(ball((0.3, 0.2, 2.0), sigma_m=0.05))
    through_pinhole = renderer.render(objects, PINHOLE, HERE).depth
    through_fisheye = renderer.render(objects, FISHEYE, HERE).depth
    assert through_pinhole.max() == pytest.approx(2.0, rel=1e-5)
    assert through_fisheye.max() == pytest.approx(np.hypot(np.hypot(0.3, 0.2), 2.0), rel=1e-5)
    assert (through_pinhole[through_pinhole > 0] > 1.99).all()


def test_depth_is_the_weighted_mean(renderer, ball, at_origin):
    objects = at_origin(ball((0, 0, 2.0), opacity=0.5), ball((0, 0, 4.0), opacity=0.5))
    picture = renderer.render(objects, PINHOLE, HERE)
    assert picture.depth[15, 20] == pytest.approx((0.5 * 2 + 0.25 * 4) / 0.75, rel=1e-5)
    assert picture.alpha[15, 20] == pytest.approx(0.75, rel=1e-5)


def test_objects_are_blended_in_one_order(renderer, ball, at_origin):
    near, far = ball((0, 0, 2.0), colour=(1, 0, 0)), ball((0, 0, 3.0), colour=(0, 1, 0))
    between = ball((0, 0, 2.5), colour=(0, 0, 1))
    picture = renderer.render(at_origin(concatenate([far, near]), between), PINHOLE, HERE)
    np.testing.assert_allclose(picture.rgb[15, 20], [0.8, 0.032, 0.16], atol=2e-6)
    swapped = renderer.render(at_origin(between, concatenate([near, far])), PINHOLE, HERE)
    np.testing.assert_array_equal(swapped.rgb, picture.rgb)


def test_ids_name_the_object_with_the_largest_weight(renderer, ball, at_origin):
    thin, firm = ball((0, 0, 2.0), opacity=0.2), ball((0, 0, 3.0), opacity=0.9)
    picture = renderer.render(at_origin(thin, firm), PINHOLE, HERE)
    if picture.ids is None:
        pytest.skip("this renderer does not tell objects apart")
    assert picture.ids.dtype == np.int32
    assert picture.ids[15, 20] == 1
    assert picture.ids[0, 0] == -1
    alone = renderer.render(at_origin(thin), PINHOLE, HERE)
    assert alone.ids[15, 20] == 0
    np.testing.assert_array_equal(alone.ids >= 0, alone.alpha > 0)


def test_equal_depths_keep_their_order(renderer, ball, at_origin):
    first, second = ball((0, 0, 2.0), colour=(1, 0, 0)), ball((0, 0, 2.0), colour=(0, 1, 0))
    picture = renderer.render(at_origin(first, second), PINHOLE, HERE)
    np.testing.assert_allclose(picture.rgb[15, 20], [0.8, 0.16, 0.0], atol=2e-6)
    swapped = renderer.render(at_origin(concatenate([second, first])), PINHOLE, HERE)
    np.testing.assert_allclose(swapped.rgb[15, 20], [0.16, 0.8, 0.0], atol=2e-6)


def test_near_splats_are_skipped(renderer, ball, at_origin):
    objects = at_origin(ball((0.0, 0.0, 0.3)))
    seen = renderer.render(objects, PINHOLE, HERE, RenderOptions(near_m=0.29))
    skipped = renderer.render(objects, PINHOLE, HERE, RenderOptions(near_m=0.31))
    assert seen.alpha.max() > 0.7
    assert skipped.alpha.max() == 0


@pytest.mark.parametrize("angle_deg", [0, 45, 90, 100, 118])
def test_a_fisheye_sees_beyond_90_degrees(renderer, ball, at_origin, angle_deg):
    angle = np.radians(angle_deg)
    mean = (2 * np.sin(angle), 0.0, 2 * np.cos(angle))
    picture = renderer.render(at_origin(ball(mean, sigma_m=0.1)), FISHEYE, HERE)
    row, column = np.unravel_index(np.argmax(picture.alpha), picture.alpha.shape)
    assert row == 40
    assert column + 0.5 == pytest.approx(FISHEYE.f_px * angle + FISHEYE.cx, abs=0.51)


def test_nothing_is_drawn_outside_the_lens_circle(renderer, ball, at_origin):
    objects = at_origin(ball((2.0, 0.0, -0.9), sigma_m=0.6, opacity=1.0))
    camera = Fisheye(100, 100, 20.0, 50.0, 50.0, np.radians(110))
    options = RenderOptions(background=(0.3, 0.6, 0.9))
    picture = renderer.render(objects, camera, HERE, options)
    y, x = np.mgrid[:100, :100] + 0.5 - 50.0
    is_outside = np.hypot(x, y) > 20.0 * np.radians(110)
    assert picture.alpha[~is_outside].max() > 0.5
    assert not picture.alpha[is_outside].any()
    assert not picture.depth[is_outside].any()
    assert picture.ids is None or (picture.ids[is_outside] == -1).all()
    np.testing.assert_allclose(picture.rgb[is_outside] - [0.3, 0.6, 0.9], 0.0, atol=1e-7)


def test_colour_depends_on_direction_in_the_objects_own_frame(renderer, ball, at_origin):
    plain = ball((0, 0, 0), sigma_m=0.05)
    sh = np.zeros((1, 4, 3), dtype=np.float32)
    sh[0, 3, 0] = -0.5
    cloud = SplatCloud(plain.means, plain.scales, plain.rotations, plain.opacities, sh)
    centre = [
        renderer.render(
            [PosedSplats(cloud, Pose.from_yaw(yaw))],
            PINHOLE,
            Pose(np.array([[0.0, 0, 1], [-1, 0, 0], [0, -1, 0]]), [-2.0, 0, 0]),
        )
        for yaw in (0.0, np.pi / 2, np.pi)
    ]
    red = [picture.rgb[15, 20, 0] / picture.alpha[15, 20] for picture in centre]
    np.testing.assert_allclose(red, [0.5 + 0.2443, 0.5, 0.5 - 0.2443], atol=1e-4)


def test_colours_are_clamped_below_only(renderer, ball, at_origin):
    picture = renderer.render(at_origin(ball((0, 0, 2.0), colour=(-1, 0, 3))), PINHOLE, HERE)
    np.testing.assert_allclose(picture.rgb[15, 20], [0, 0, 2.4], atol=1e-5)


def test_moving_scene_and_camera_together_changes_nothing(renderer, wild_cloud, camera):
    cloud = wild_cloud(60, degree=3, seed=3)
    moved = Pose.from_quaternion(np.array([0.5, -0.5, 0.5, 0.5]), (0.25, -0.5, 0.125))
    camera_pose = Pose.from_yaw(0.4, (0.1, -0.2, -2.5))
    still = renderer.render([PosedSplats(cloud, Pose.identity())], camera, camera_pose)
    both = renderer.render([PosedSplats(cloud, moved)], camera, moved @ camera_pose)
    # Rounding may push a few samples over the 1/255 step.
    assert np.mean(np.abs(both.rgb - still.rgb) > 1e-5) < 1e-3
    assert still.alpha.max() > 0.5


def test_splitting_a_cloud_changes_nothing(renderer, wild_cloud, at_origin, camera):
    cloud = wild_cloud(80, degree=1, seed=5)
    pose = Pose(np.eye(3), [0.0, 0.0, -2.0])
    whole = renderer.render(at_origin(cloud), camera, pose)
    parts = [cloud.select(np.arange(k, 80, 3)) for k in range(3)]
    split = renderer.render(at_origin(*parts), camera, pose)
    np.testing.assert_array_equal(split.rgb, whole.rgb)
    np.testing.assert_array_equal(split.alpha, whole.alpha)
    np.testing.assert_array_equal(split.depth, whole.depth)
    if split.ids is not None:
        assert split.ids.max() > 0
        np.testing.assert_array_equal(split.ids >= 0, whole.ids >= 0)


def test_nothing_to_draw(renderer, wild_cloud, at_origin, camera):
    options = RenderOptions(background=(0.1, 0.2, 0.3))
    for objects in (
        (),
        at_origin(wild_cloud(0)),
        at_origin(wild_cloud(0, degree=3), wild_cloud(0)),
    ):
        picture = renderer.render(objects, camera, HERE, options)
        assert picture.rgb.shape == (camera.height_px, camera.width_px, 3)
        np.testing.assert_allclose(picture.rgb - [0.1, 0.2, 0.3], 0.0, atol=1e-7)
        assert not picture.alpha.any()
        assert not picture.depth.any()
        assert picture.ids is None or (picture.ids == -1).all()


@pytest.mark.parametrize("size", [(1, 1), (1, 40), (40, 1), (16, 16), (17, 33)])
def test_every_size_of_picture(renderer, ball, at_origin, size):
    camera = Pinhole(*size, 30.0, 30.0, 0.5 * size[0], 0.5 * size[1])
    picture = renderer.render(at_origin(ball((0, 0, 2.0), sigma_m=5.0)), camera, HERE)
    assert picture.alpha.shape == size[::-1]
    assert picture.alpha.min() > 0.75


@pytest.mark.parametrize(
    ("options", "named"),
    [
        (RenderOptions(sh_degree=4), "sh_degree"),
        (RenderOptions(near_m=0.0), "near_m"),
        (RenderOptions(near_m=float("nan")), "near_m"),
        (RenderOptions(threads=-1), "threads"),
        (RenderOptions(background=(0.0, float("inf"), 0.0)), "background"),
        (RenderOptions(background=(0.0, 0.0, -2e15)), "background"),
        (RenderOptions(background=(0.0, 0.0)), "background"),  # type: ignore[arg-type]
    ],
)
def test_bad_options_are_named(renderer, ball, at_origin, options, named):
    with pytest.raises(ValueError, match=rf"options\.{named}: got .*, wanted "):
        renderer.render(at_origin(ball((0, 0, 2.0))), PINHOLE, HERE, options)


@pytest.mark.parametrize(
    ("field", "array"),
    [
        ("means", np.zeros((3, 3))),
        ("means", np.zeros((3, 2), dtype=np.float32)),
        ("scales", np.zeros((2, 3), dtype=np.float32)),
        ("rotations", np.zeros((3, 4), dtype=np.float16)),
        ("opacities", np.zeros((3, 1), dtype=np.float32)),
        ("sh", np.zeros((3, 5, 3), dtype=np.float32)),
        ("sh", np.zeros((3, 4, 6), dtype=np.float32)[:, :, ::2]),
        ("opacities", [0.1, 0.2, 0.3]),
    ],
)
def test_wrong_arrays_are_named(renderer, wild_cloud, at_origin, field, array):
    cloud = wild_cloud(3)
    object.__setattr__(cloud, field, array)
    with pytest.raises(
        ValueError, match=rf"objects\[0\]\.cloud\.{field}: got .*, wanted .*float32"
    ):
        renderer.render(at_origin(cloud), PINHOLE, HERE)


def test_wrong_types_are_named(renderer, ball):
    with pytest.raises(TypeError, match="PosedSplats"):
        renderer.render([ball((0, 0, 2.0))], PINHOLE, HERE)
    with pytest.raises(TypeError, match="camera"):
        renderer.render([], "pinhole", HERE)
