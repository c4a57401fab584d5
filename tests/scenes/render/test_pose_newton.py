"""Normal equations against float64 differences, and how surely the solver finds a pose."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.cameras import Fisheye, Pinhole
from scenes.frames import look_at
from scenes.pose import Pose, rotation_angle, rotation_from_vector
from scenes.render.native import NativeRenderer
from scenes.render.pose_newton import (
    LUMA,
    STEP_ENTRIES,
    Brightness,
    PoseTarget,
    SolverOptions,
    normal_equations,
    solve_pose,
)
from scenes.render.pose_step import moved
from scenes.render.reference.differences import FrozenPicture
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SH_C0, SplatCloud

CAMERA_POSE = Pose(np.eye(3), [0.1, 0.2, -1.0])
OBJECT_POSE = Pose.from_yaw(0.3, (0.1, 0.2, 1.5))
STEP = 1e-6
TOLERANCE = 3e-6
"""The kernels place a splat to a ten-millionth of its tile; thin splats feel ten times that."""


def random_target(camera, rng):
    def picture():
        return rng.uniform(0, 1, (camera.height_px, camera.width_px)).astype(np.float32)

    return PoseTarget(picture(), picture(), picture(), picture(), picture())


def residuals(picture, target, light, camera):
    """Weighted grey residuals, then silhouette residuals, of the pixels inside the lens."""
    grey = picture.rgb @ np.array(LUMA)
    over = (1 - picture.alpha) * target.background - target.grey
    grey_residual = light.gain * grey + light.bias * picture.alpha + over
    inside = np.ones(picture.alpha.shape, dtype=bool)
    if isinstance(camera, Fisheye):
        y, x = np.mgrid[: camera.height_px, : camera.width_px] + 0.5
        radius = np.hypot(x - camera.cx, y - camera.cy)
        inside = radius <= camera.circle_px
    outline = picture.alpha - target.silhouette
    return np.concatenate(
        [
            (np.sqrt(target.grey_weight) * grey_residual)[inside],
            (np.sqrt(target.silhouette_weight) * outline)[inside],
        ]
    )


def assert_equations(equations, wanted_rows, wanted_residuals):
    jtj, jtr = wanted_rows @ wanted_rows.T, wanted_rows @ wanted_residuals
    scale = np.sqrt(np.diag(jtj))
    assert np.abs((equations.jtj - jtj) / np.outer(scale, scale)).max() <= TOLERANCE
    norm = np.linalg.norm(wanted_residuals)
    assert np.abs((equations.jtr - jtr) / (scale * norm)).max() <= TOLERANCE
    assert equations.cost == pytest.approx(norm**2, rel=1e-6)


@pytest.mark.parametrize(
    ("dof", "degree", "antialias"), [(3, 0, False), (4, 2, False), (6, 1, True), (6, 3, False)]
)
def test_equations_agree_with_differences(native, drawn_cloud, small_lens, dof, degree, antialias):
    options = RenderOptions(sh_degree=degree, antialias=antialias)
    posed = drawn_cloud(OBJECT_POSE, small_lens, CAMERA_POSE, options, seed=dof, count=25)
    target = random_target(small_lens, np.random.default_rng(dof))
    light = Brightness(1.2, -0.1)
    equations = normal_equations(
        native,
        posed,
        small_lens,
        CAMERA_POSE,
        target,
        degrees_of_freedom=dof,
        brightness=light,
        solve_brightness=True,
        options=options,
    )
    frozen = FrozenPicture([posed], small_lens, CAMERA_POSE, options)

    def at(unknowns):
        step = np.zeros(6)
        step[list(STEP_ENTRIES[dof])] = unknowns[:dof]
        picture = frozen.draw(world_from_objects=[moved(OBJECT_POSE, step)])
        lit = Brightness(light.gain + unknowns[-2], light.bias + unknowns[-1])
        return residuals(picture, target, lit, small_lens)

    steps = STEP * np.eye(dof + 2)
    rows = np.array([(at(step) - at(-step)) / (2 * STEP) for step in steps])
    assert_equations(equations, rows, at(np.zeros(dof + 2)))
    picture = frozen.draw()
    np.testing.assert_allclose(equations.alpha, picture.alpha, atol=2e-6)
    np.testing.assert_allclose(equations.grey, picture.rgb @ np.array(LUMA), atol=2e-6)


def test_an_occluder_hides_what_lies_behind_it(native, drawn_cloud, small_lens):
    options = RenderOptions()
    posed = drawn_cloud(OBJECT_POSE, small_lens, CAMERA_POSE, options, seed=5, count=60)
    camera_from_object = CAMERA_POSE.inverse() @ OBJECT_POSE
    in_camera = camera_from_object @ posed.cloud.means.astype(np.float64)
    is_pinhole = isinstance(small_lens, Pinhole)
    depths = in_camera[:, 2] if is_pinhole else np.linalg.norm(in_camera, axis=1)
    limit = float(np.median(depths)) + 1e-3
    near = PosedSplats(posed.cloud.select(depths < limit), OBJECT_POSE)
    shape = (small_lens.height_px, small_lens.width_px)
    rng = np.random.default_rng(2)
    free = random_target(small_lens, rng)
    hidden = replace(free, occluder_depth_m=np.full(shape, limit, dtype=np.float32))
    got = normal_equations(native, posed, small_lens, CAMERA_POSE, hidden)
    wanted = normal_equations(native, near, small_lens, CAMERA_POSE, free)
    np.testing.assert_allclose(got.alpha, wanted.alpha, atol=1e-6)
    scale = np.sqrt(np.diag(wanted.jtj))
    assert np.abs((got.jtj - wanted.jtj) / np.outer(scale, scale)).max() <= 1e-5


def test_an_occluder_hides_pixel_by_pixel(native, drawn_cloud, small_lens):
    """A near edge over the left half: there only what lies before it, right of it everything."""
    posed = drawn_cloud(OBJECT_POSE, small_lens, CAMERA_POSE, RenderOptions(), seed=5, count=60)
    in_camera = (CAMERA_POSE.inverse() @ OBJECT_POSE) @ posed.cloud.means.astype(np.float64)
    is_pinhole = isinstance(small_lens, Pinhole)
    depths = in_camera[:, 2] if is_pinhole else np.linalg.norm(in_camera, axis=1)
    limit = float(np.median(depths)) + 1e-3
    near = PosedSplats(posed.cloud.select(depths < limit), OBJECT_POSE)
    free = random_target(small_lens, np.random.default_rng(2))
    is_left = np.zeros(free.grey.shape, dtype=bool)
    is_left[:, : is_left.shape[1] // 2 + 1] = True

    def weighted(where, **more):
        """The target, counted in some pixels alone."""
        return replace(
            free,
            grey_weight=np.where(where, free.grey_weight, 0).astype(np.float32),
            silhouette_weight=np.where(where, free.silhouette_weight, 0).astype(np.float32),
            **more,
        )

    edge = np.where(is_left, limit, np.inf).astype(np.float32)
    hidden = replace(free, occluder_depth_m=edge)
    got = normal_equations(native, posed, small_lens, CAMERA_POSE, hidden)
    left = normal_equations(native, near, small_lens, CAMERA_POSE, weighted(is_left))
    right = normal_equations(native, posed, small_lens, CAMERA_POSE, weighted(~is_left))
    assert (left.alpha[is_left] < right.alpha[is_left]).any()
    np.testing.assert_allclose(
        got.alpha, np.where(is_left, left.alpha, right.alpha), rtol=0, atol=1e-6
    )
    wanted = left.jtj + right.jtj
    scale = np.sqrt(np.diag(wanted))
    assert np.abs((got.jtj - wanted) / np.outer(scale, scale)).max() <= 1e-5
    assert got.cost == pytest.approx(left.cost + right.cost, rel=1e-5)


def test_a_masked_pixel_shows_no_object(native, drawn_cloud, small_lens):
    posed = drawn_cloud(OBJECT_POSE, small_lens, CAMERA_POSE, RenderOptions(), seed=8, count=60)
    free = random_target(small_lens, np.random.default_rng(4))
    mask = np.random.default_rng(5).random(free.grey.shape) < 0.4
    masked = replace(free, occluder_mask=mask)
    ignored = replace(
        free,
        grey_weight=np.where(mask, 0, free.grey_weight).astype(np.float32),
        silhouette_weight=np.where(mask, 0, free.silhouette_weight).astype(np.float32),
    )
    got = normal_equations(native, posed, small_lens, CAMERA_POSE, masked)
    wanted = normal_equations(native, posed, small_lens, CAMERA_POSE, ignored)
    assert wanted.alpha[mask].max() > 0.1
    assert (got.alpha[mask] == 0).all()
    assert (got.grey[mask] == 0).all()
    np.testing.assert_array_equal(got.alpha[~mask], wanted.alpha[~mask])
    np.testing.assert_allclose(got.jtj, wanted.jtj, rtol=1e-6, atol=1e-6 * np.abs(got.jtj).max())
    np.testing.assert_allclose(got.jtr, wanted.jtr, rtol=1e-6, atol=1e-6 * np.abs(got.jtr).max())


def test_a_mask_and_a_depth_hide_together(native, ball):
    """A splat 2 m away: hidden by the mask on the left, by the near occluder above."""
    posed = PosedSplats(ball((0, 0, 2.0), sigma_m=0.3), Pose.identity())
    camera = Pinhole.from_fov(40, 40, 0.8)
    blank = np.zeros((40, 40), np.float32)
    depth_m = np.full((40, 40), np.inf, np.float32)
    depth_m[:20] = 1.5
    depth_m[20:] = 2.5
    mask = np.zeros((40, 40), bool)
    mask[:, :20] = True
    target = PoseTarget(blank, blank, occluder_depth_m=depth_m, occluder_mask=mask)
    alpha = normal_equations(native, posed, camera, Pose.identity(), target).alpha
    assert (alpha[:20] == 0).all()
    assert (alpha[:, :20] == 0).all()
    assert (alpha[20:, 20:] > 0).any()


def test_pixels_of_weight_zero_do_not_count(native, drawn_cloud, small_lens):
    posed = drawn_cloud(OBJECT_POSE, small_lens, CAMERA_POSE, RenderOptions(), seed=6, count=40)
    target = random_target(small_lens, np.random.default_rng(3))
    is_out = np.zeros(target.grey.shape, dtype=bool)
    is_out[:, ::3] = True
    ignored = replace(
        target,
        grey_weight=np.where(is_out, 0, target.grey_weight).astype(np.float32),
        silhouette_weight=np.where(is_out, 0, target.silhouette_weight).astype(np.float32),
    )
    other = replace(
        ignored,
        grey=np.where(is_out, 0.7, target.grey).astype(np.float32),
        silhouette=np.where(is_out, 0.2, target.silhouette).astype(np.float32),
    )
    one = normal_equations(native, posed, small_lens, CAMERA_POSE, ignored)
    two = normal_equations(native, posed, small_lens, CAMERA_POSE, other)
    np.testing.assert_array_equal(one.jtr, two.jtr)
    assert one.cost == two.cost


def test_the_number_of_threads_changes_nothing(native, wild_cloud, camera):
    posed = PosedSplats(wild_cloud(3000, degree=1, seed=2), Pose.from_yaw(0.4))
    pose = Pose(np.eye(3), [0.0, 0.0, -1.0])
    target = random_target(camera, np.random.default_rng(0))
    one, *others = (
        normal_equations(
            native, posed, camera, pose, target, options=RenderOptions(threads=threads)
        )
        for threads in (1, 2, 3, 8)
    )
    for many in others:
        for name in ("jtj", "jtr", "grey", "alpha"):
            np.testing.assert_array_equal(getattr(many, name), getattr(one, name))
        assert (many.grey_cost, many.silhouette_cost) == (one.grey_cost, one.silhouette_cost)


def test_wider_vectors_draw_the_same_bits(wild_cloud, camera):
    """Sums differ in their last digits, since lanes are added in another order."""
    posed = PosedSplats(wild_cloud(1500, degree=1, seed=3), Pose.from_yaw(0.4))
    pose = Pose(np.eye(3), [0.0, 0.0, -1.0])
    target = random_target(camera, np.random.default_rng(0))
    vectors = [name for name in NativeRenderer().available_instructions() if name != "scalar"]
    if len(vectors) < 2:
        pytest.skip("this machine has vectors of one width at most")
    narrow, wide = (
        normal_equations(NativeRenderer(instructions=name), posed, camera, pose, target)
        for name in vectors
    )
    np.testing.assert_array_equal(wide.grey, narrow.grey)
    np.testing.assert_array_equal(wide.alpha, narrow.alpha)
    scale = np.sqrt(np.diag(narrow.jtj))
    assert np.abs((wide.jtj - narrow.jtj) / np.outer(scale, scale)).max() <= 1e-6


def test_grey_and_alpha_are_the_renderers(native, wild_cloud, camera):
    posed = PosedSplats(wild_cloud(800, degree=2, seed=7), Pose.from_yaw(0.4))
    pose = Pose(np.eye(3), [0.0, 0.0, -1.0])
    target = random_target(camera, np.random.default_rng(0))
    equations = normal_equations(native, posed, camera, pose, target)
    drawn = native.render([posed], camera, pose)
    np.testing.assert_allclose(equations.alpha, drawn.alpha, atol=1e-4)
    np.testing.assert_allclose(equations.grey, drawn.rgb @ np.array(LUMA), atol=1e-4)


def test_damaged_splats_leave_the_equations_finite(native, wild_cloud, small_lens):
    cloud = wild_cloud(40, degree=1, seed=4, spread_m=0.4)
    arrays = {
        name: getattr(cloud, name).copy()
        for name in ("means", "scales", "rotations", "opacities", "sh")
    }
    arrays["means"][0] = np.nan
    arrays["scales"][1] = 0.0
    arrays["rotations"][2] = 0.0
    arrays["opacities"][3] = np.inf
    arrays["scales"][5] = 1e-30
    arrays["means"][7] = 1e5
    posed = PosedSplats(SplatCloud(**arrays), Pose.identity())
    pose = Pose(np.eye(3), [0.0, 0.0, -1.5])
    target = random_target(small_lens, np.random.default_rng(0))
    for antialias in (False, True):
        equations = normal_equations(
            native, posed, small_lens, pose, target, options=RenderOptions(antialias=antialias)
        )
        assert np.isfinite(equations.jtj).all()
        assert np.isfinite(equations.jtr).all()
        assert np.diag(equations.jtj).min() > 0


def test_an_object_out_of_sight_gives_no_step(native, ball):
    camera = Pinhole.from_fov(20, 10, 1.0)
    behind = PosedSplats(ball((0, 0, -2.0)), Pose.identity())
    target = PoseTarget(np.ones((10, 20), np.float32), np.zeros((10, 20), np.float32))
    solution = solve_pose(native, behind, camera, Pose.identity(), target)
    assert solution.equations.cost == 200
    assert not solution.equations.jtj.any()
    np.testing.assert_array_equal(solution.world_from_object.translation, 0)


def textured_box(rng, count=1500):
    """A box of 0.4 × 0.3 × 0.5 m covered with flat, coloured splats."""
    size = np.array([0.4, 0.3, 0.5])
    axes = rng.integers(0, 3, count)
    places = rng.uniform(-0.5, 0.5, (count, 3))
    places[np.arange(count), axes] = rng.choice([-0.5, 0.5], count)
    means = places * size
    scales = np.full((count, 3), 0.016)
    scales[np.arange(count), axes] = 0.002
    colours = 0.5 + 0.2 * np.sin(9 * means + 2 * axes[:, None]) + 0.2 * np.cos(17 * means[:, ::-1])
    return SplatCloud(
        means.astype(np.float32),
        scales.astype(np.float32),
        np.tile(np.array([1, 0, 0, 0], np.float32), (count, 1)),
        rng.uniform(0.7, 1.0, count).astype(np.float32),
        ((colours - 0.5) / SH_C0).astype(np.float32)[:, None],
    )


def a_nearby_pose(rng, dof):
    """5° and 2 cm away from the identity, along the free entries."""
    step = np.zeros(6)
    entries = list(STEP_ENTRIES[dof])
    step[entries] = rng.normal(size=dof)
    step[:3] *= 0.02 / np.linalg.norm(step[:3])
    step[3:] *= np.radians(5) / np.linalg.norm(step[3:])
    return moved(Pose.identity(), step)


@pytest.mark.parametrize("dof", [3, 4, 6])
@pytest.mark.parametrize("kind", ["pinhole", "fisheye"])
def test_nearly_every_start_finds_the_pose_in_six_steps(dof, kind):
    rng = np.random.default_rng(11)
    renderer = NativeRenderer()
    cloud = textured_box(rng)
    if kind == "pinhole":
        camera = Pinhole.from_fov(80, 80, np.radians(40))
    else:
        camera = Fisheye(80, 80, 110.0, 40.0, 40.0, np.radians(60))
    camera_pose = look_at(np.array([0.8, -0.7, 0.6]), np.zeros(3))
    truth = renderer.render([PosedSplats(cloud, Pose.identity())], camera, camera_pose)
    target = PoseTarget((truth.rgb @ np.array(LUMA)).astype(np.float32), truth.alpha)
    solver = SolverOptions(degrees_of_freedom=dof, max_steps=6)
    found = 0
    starts = 40
    for _ in range(starts):
        start = PosedSplats(cloud, a_nearby_pose(rng, dof))
        pose = solve_pose(
            renderer, start, camera, camera_pose, target, solver=solver
        ).world_from_object
        is_near = np.linalg.norm(pose.translation) < 0.001
        found += bool(is_near and rotation_angle(pose.rotation) < np.radians(0.1))
    assert found >= 0.95 * starts


def test_brightness_is_found_with_the_pose(native):
    rng = np.random.default_rng(12)
    cloud = textured_box(rng)
    camera = Pinhole.from_fov(80, 80, np.radians(40))
    camera_pose = look_at(np.array([0.8, -0.7, 0.6]), np.zeros(3))
    truth = native.render([PosedSplats(cloud, Pose.identity())], camera, camera_pose)
    grey = 0.7 * (truth.rgb @ np.array(LUMA)) + 0.1 * truth.alpha
    target = PoseTarget(grey.astype(np.float32), truth.alpha)
    solution = solve_pose(
        native,
        PosedSplats(cloud, moved(Pose.identity(), np.array([0.01, -0.01, 0.01, 0, 0, 0.05]))),
        camera,
        camera_pose,
        target,
        solver=SolverOptions(max_steps=12, solve_brightness=True),
    )
    assert solution.converged
    assert solution.steps < 12
    assert solution.brightness.gain == pytest.approx(0.7, abs=1e-3)
    assert solution.brightness.bias == pytest.approx(0.1, abs=1e-3)
    assert np.linalg.norm(solution.world_from_object.translation) < 1e-4


def test_a_turn_is_about_the_objects_own_origin(native, ball):
    """One round splat at the origin of its object: turns change nothing."""
    posed = PosedSplats(ball((0, 0, 0)), Pose(rotation_from_vector([0.1, 0.2, 0.3]), [0, 0, 2.0]))
    camera = Pinhole(41, 31, 120.0, 120.0, 20.5, 15.5)
    target = PoseTarget(np.zeros((31, 41), np.float32), np.zeros((31, 41), np.float32))
    jtj = normal_equations(native, posed, camera, Pose.identity(), target).jtj
    assert jtj[0, 0] > 1
    assert np.abs(jtj[3:, 3:]).max() < 1e-9 * jtj[0, 0]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"grey": np.zeros((3, 3), np.float32)}, r"target.grey: got float32 \(3, 3\), wanted"),
        ({"silhouette": np.zeros((10, 20))}, r"target.silhouette: got float64"),
        ({"background": [1.0]}, r"target.background: got list, wanted float32 \(10, 20\)"),
        (
            {"grey_weight": np.full((10, 20), -1, np.float32)},
            r"target.grey_weight: 200 of 200 values are bad, such as -1.0, wanted finite and >= 0",
        ),
        ({"grey": np.full((10, 20), np.inf, np.float32)}, r"target.grey: 200 of 200 values"),
        ({"occluder_depth_m": np.full((10, 20), np.nan, np.float32)}, r"target.occluder_depth_m"),
        (
            {"occluder_mask": np.zeros((10, 20), np.uint8)},
            r"target.occluder_mask: got uint8 \(10, 20\), wanted bool \(10, 20\)",
        ),
        ({"occluder_mask": np.zeros((20, 10), bool)}, r"target.occluder_mask: got bool \(20, 10\)"),
        ({"occluder_mask": [True]}, r"target.occluder_mask: got list, wanted bool"),
    ],
)
def test_wrong_targets_are_refused(native, ball, change, message):
    blank = np.zeros((10, 20), np.float32)
    target = replace(PoseTarget(blank, blank), **change)
    posed = PosedSplats(ball((0, 0, 2.0)), Pose.identity())
    with pytest.raises(ValueError, match=message):
        normal_equations(native, posed, Pinhole.from_fov(20, 10, 1.0), Pose.identity(), target)


def test_wrong_numbers_are_refused(native, ball):
    blank = np.zeros((10, 20), np.float32)
    posed = PosedSplats(ball((0, 0, 2.0)), Pose.identity())
    arguments = (native, posed, Pinhole.from_fov(20, 10, 1.0), Pose.identity())
    target = PoseTarget(blank, blank)
    with pytest.raises(ValueError, match="degrees_of_freedom: got 5, wanted 3, 4 or 6"):
        normal_equations(*arguments, target, degrees_of_freedom=5)
    with pytest.raises(ValueError, match=r"brightness: got .*nan.*, wanted finite"):
        normal_equations(*arguments, target, brightness=Brightness(np.nan, 0.0))
    with pytest.raises(ValueError, match=r"solver\.max_steps: got 0, wanted at least 1"):
        solve_pose(*arguments, target, solver=SolverOptions(max_steps=0))
