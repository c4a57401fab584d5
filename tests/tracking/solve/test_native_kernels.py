"""The native kernels of the tracker against their readable twins."""

import math
from dataclasses import replace

import numpy as np
import pytest

from scenes.cameras import Fisheye, Pinhole, Rig, pixel_centres
from scenes.frames import FRONT_FROM_BACK_LENS, look_at
from scenes.pose import Pose, rotation_angle, rotation_from_vector
from scenes.render.renderer import Rendering
from tests.twins import solver as reference
from tests.twins.reduction import contour_points, texture_points
from tracking.background.images import Exposure, expose
from tracking.background.learning import LEARNER, Care, surroundings
from tracking.evidence.evidence import Evidence
from tracking.kernels import native
from tracking.kernels.arrays import rows_of
from tracking.kernels.native import KERNELS, SeenWindow
from tracking.likelihood import contour_support as judgement
from tracking.likelihood.edges import measure_contour, projection
from tracking.model.colours import ColourModel
from tracking.model.templates import cut_out
from tracking.solve.measurement import Measurement, judged, refined
from tracking.window.contour import sample
from tracking.window.filters import bell_blurred
from tracking.window.reduction import contour_of
from tracking.window.window import Layer, window_around

LENS = Fisheye.from_fov(480, math.radians(200))
DISTORTED = replace(LENS, f_px=0.9 * LENS.f_px, distortion=(0.02, -0.01, 0.002, 0.0))
RIG = Rig((LENS, LENS), (Pose.identity(), FRONT_FROM_BACK_LENS))
CHAIR = np.array([0.0, 0.0, 0.4])


AXES_M = np.array([0.3, 0.2, 0.4])


def egg(camera, world_from_camera, world_from_object):
    """A coloured egg as a lens sees it: nine rays a pixel meet it where a quadratic says."""
    fine = camera.resized(3 * camera.width_px, 3 * camera.height_px)
    object_from_camera = world_from_object.inverse() @ world_from_camera
    eye = (object_from_camera.translation - CHAIR) / AXES_M
    rays = fine.unproject(pixel_centres(fine)) @ object_from_camera.rotation.T / AXES_M
    along, length2 = rays @ eye, (rays**2).sum(axis=1)
    root = along**2 - length2 * (eye @ eye - 1)
    hit = root > 0
    distance = np.where(hit, (-along - np.sqrt(np.maximum(root, 0))) / length2, 0.0)
    place = eye + distance[:, None] * rays
    colours = 0.45 + 0.15 * np.sin(9 * place) + 0.1 * place[:, 2:]
    shape = (camera.height_px, 3, camera.width_px, 3)

    def averaged(values):
        return (values * hit).reshape(shape).mean(axis=(1, 3)).astype(np.float32)

    alpha = averaged(np.ones(len(hit)))
    rgb = np.stack([averaged(channel) for channel in colours.T], axis=2)
    return Rendering(rgb, alpha, averaged(distance) / np.maximum(alpha, np.float32(1e-6)))


@pytest.fixture(scope="module", params=[LENS, DISTORTED], ids=["equidistant", "distorted"])
def seen(request):
    """A window with an egg in front of noise, and the egg alone."""
    rng = np.random.default_rng(4)
    rig = Rig((request.param, request.param), (Pose.identity(), FRONT_FROM_BACK_LENS))
    world_from_rig = look_at(np.array([2.0, 0.3, 1.2]), np.array([0.0, 0.5, 0.4]))
    world_from_object = Pose.from_yaw(0.4, (0.0, 0.0, 0.0))
    window = window_around(rig, world_from_rig, world_from_object @ CHAIR, radius_m=0.6)
    drawn = egg(window.camera, window.world_from_camera, world_from_object)
    alpha = drawn.alpha[..., None]
    room = rng.uniform(0.55, 0.75, drawn.rgb.shape)
    noise = rng.normal(0, 0.02, drawn.rgb.shape)
    live = np.clip(drawn.rgb + (1 - alpha) * room + noise, 0, 1).astype(np.float32)
    foreground = np.clip(drawn.alpha + rng.normal(0, 0.05, drawn.alpha.shape), 0, 1)
    foreground = foreground.astype(np.float32)
    own = foreground * rng.uniform(0.8, 1.0, foreground.shape).astype(np.float32)
    hidden = np.zeros_like(foreground)
    hidden[:, : hidden.shape[1] * 46 // 100] = 1.0
    shape = (window.camera.width_px, window.camera.height_px)
    seen = SeenWindow(live, foreground, own, hidden, shape)
    return Evidence(window, live, foreground, own, hidden, (), seen), drawn, world_from_object


def measured(evidence, drawn, world_from_object, *, is_round=False):
    camera = evidence.camera
    object_from_camera = world_from_object.inverse() @ evidence.world_from_camera
    picture = bell_blurred(drawn.rgb, 0.8, 3)
    return Measurement(
        camera=camera,
        world_from_camera=evidence.world_from_camera,
        outline=contour_of(drawn, camera, object_from_camera, limit=150, reach_px=6.0),
        texture=texture_points(
            drawn, picture, camera, object_from_camera, limit=120, min_slope=0.01
        ),
        textured=True,
        centre_m=CHAIR,
        prior_world_from_object=world_from_object,
        prior_sigma=np.array([0.2, 0.2, 0.1, 0.05, 0.05, 0.4, 0.002]),
        prior_silhouette_bias_m=0.002,
        low_pass_px=0.3,
        is_round=is_round,
    )


@pytest.mark.parametrize("limit", [60, 100_000])
def test_contours_are_the_readable_ones(seen, limit):
    evidence, drawn, world_from_object = seen
    object_from_camera = world_from_object.inverse() @ evidence.world_from_camera
    found = contour_of(drawn, evidence.camera, object_from_camera, limit=limit, reach_px=6.0)
    wanted = contour_points(drawn, evidence.camera, object_from_camera, limit=limit)
    assert len(found) == len(wanted) > 50
    np.testing.assert_allclose(found.points, wanted.points, atol=1e-5)
    np.testing.assert_allclose(found.normals, wanted.normals, atol=1e-4)
    np.testing.assert_allclose(found.colours, wanted.colours, atol=1e-4)
    for one, other in ((found.inner_px, wanted.inner_px), (found.outer_px, wanted.outer_px)):
        # A width is a whole number of steps: alpha within rounding of ½ may fall either way.
        assert (np.abs(one - other) < 1e-6).mean() > 0.98


def test_a_contour_projects_back_to_where_it_was_found(seen):
    evidence, drawn, world_from_object = seen
    object_from_camera = world_from_object.inverse() @ evidence.world_from_camera
    found = contour_of(drawn, evidence.camera, object_from_camera, limit=500, reach_px=6.0)
    pixels, _ = evidence.camera.project(object_from_camera.inverse() @ found.points)
    left, top = np.floor(pixels - 0.5).astype(int).T
    corners = np.stack([drawn.alpha[top + b, left + a] for a in (0, 1) for b in (0, 1)])
    assert (corners.min(axis=0) < 0.5).all()
    assert (corners.max(axis=0) > 0.5).all()


@pytest.mark.parametrize("reach_px", [2.5, 9.0])
def test_edges_are_the_readable_ones(seen, reach_px):
    evidence, drawn, world_from_object = seen
    measurement = measured(evidence, drawn, world_from_object)
    pose = Pose.from_yaw(0.43, (0.01, -0.012, 0.005))
    silhouette_bias_m = 0.003
    scale = reference.px_per_m(measurement, pose)
    wanted = measure_contour(
        evidence,
        measurement.outline,
        pose,
        reach_px=reach_px,
        offset_px=measurement.low_pass_px + silhouette_bias_m * scale,
    )
    offset, sigma, found, hidden = KERNELS.edges(
        evidence.seen, measurement.request(), rows_of(pose), silhouette_bias_m, reach_px=reach_px
    )
    same = np.abs(offset - wanted.offset_px) < 1e-3
    assert same.mean() > 0.97
    assert (found == wanted.found).mean() > 0.97
    np.testing.assert_array_equal(hidden, wanted.hidden)
    np.testing.assert_allclose(sigma[same], wanted.sigma_px[same], atol=1e-3)
    assert found.mean() > 0.5
    assert 0.0 < hidden.mean() < 0.5


@pytest.mark.parametrize("is_textured", [False, True])
@pytest.mark.parametrize("shift_m", [0.0, 0.01])
def test_pose_statistics_is_the_readable_one(seen, is_textured, shift_m):
    evidence, drawn, world_from_object = seen
    measurement = replace(measured(evidence, drawn, world_from_object), textured=is_textured)
    pose = Pose(
        world_from_object.rotation, world_from_object.translation + np.array([shift_m, 0.0, 0.0])
    )
    surface, colours = measurement.texture.points, measurement.texture.values
    silhouette_bias_m = 0.003
    found = judged(
        evidence.seen, measurement, pose, silhouette_bias_m, surface=surface, colours=colours
    )
    wanted = judgement.judged(
        evidence,
        measurement.outline,
        surface,
        colours,
        pose,
        offset_px=measurement.low_pass_px
        + silhouette_bias_m * reference.px_per_m(measurement, pose),
        is_textured=is_textured,
    )
    for name in ("edge_inlier_ratio", "unoccluded_ratio", "visible", "covered"):
        # An edge within rounding of a limit may fall either way.
        assert getattr(found, name) == pytest.approx(getattr(wanted, name), abs=0.02)
    for name in ("contour_chi2", "mean_edge_chi2", "variance_inflation", "colour_correlation"):
        assert getattr(found, name) == pytest.approx(getattr(wanted, name), rel=0.03)
    assert 0.2 < found.edge_inlier_ratio < 0.9
    assert found.colour_correlation > 0.3


@pytest.mark.parametrize("is_round", [False, True])
def test_a_refinement_is_the_readable_one(seen, is_round):
    evidence, drawn, world_from_object = seen
    measurement = measured(evidence, drawn, world_from_object, is_round=is_round)
    turned = rotation_from_vector([0.01, -0.02, 0.05]) @ world_from_object.rotation
    start = Pose(turned, world_from_object.translation + np.array([0.02, -0.015, 0.01]))
    rounds = [(6.0, 2), (2.5, 3)]
    found = refined(evidence.seen, measurement, start, 0.002, rounds=rounds)
    wanted = reference.refined(evidence, measurement, start, 0.002, rounds=rounds)
    apart = found[0].inverse() @ wanted[0]
    assert float(np.linalg.norm(apart.translation)) < 2e-4
    assert math.degrees(rotation_angle(apart.rotation)) < 0.03
    assert abs(found[1] - wanted[1]) < 1e-4
    np.testing.assert_allclose(found[2], wanted[2], rtol=0.03, atol=0.03 * np.abs(wanted[2]).max())


def test_a_refinement_comes_near_the_pose_that_was_drawn(seen):
    evidence, drawn, world_from_object = seen
    measurement = measured(evidence, drawn, world_from_object)
    measurement = replace(measurement, low_pass_px=0.0, prior_silhouette_bias_m=0.0)
    start = Pose.from_yaw(world_from_object.yaw() + 0.04, (0.03, -0.02, 0.01))
    found, _, _ = refined(evidence.seen, measurement, start, 0.0, rounds=[(9.0, 3), (3.0, 6)])
    apart = found.inverse() @ world_from_object
    assert float(np.linalg.norm(apart.translation)) < 0.02
    # Half of it is hidden, and the outline of an egg slides over it as it turns.
    assert rotation_angle(apart.rotation) < 0.75 * 0.04


def test_the_readable_derivatives_are_differences(seen):
    evidence, drawn, world_from_object = seen
    outline = measured(evidence, drawn, world_from_object).outline
    camera_from_world = evidence.world_from_camera.inverse()
    camera = evidence.camera

    def pixels(step):
        pose = Pose(
            rotation_from_vector(step[3:]) @ world_from_object.rotation,
            world_from_object.translation + step[:3],
        )
        return camera.project(camera_from_world @ (pose @ outline.points))[0]

    _, derivative = projection(outline.points, world_from_object, camera, camera_from_world)
    for k in range(6):
        step = 1e-5 * np.eye(6)[k]
        difference = (pixels(step) - pixels(-step)) / 2e-5
        np.testing.assert_allclose(derivative[:, :, k], difference, atol=1e-3)


@pytest.mark.parametrize("camera", [LENS, DISTORTED, Pinhole(90, 80, 70.0, 75.0, 44.0, 41.0)])
def test_projections_know_every_camera(camera):
    rng = np.random.default_rng(3)
    points = rng.normal(0, 0.4, (40, 3)) + np.array([0, 0, 2.0])
    _, derivative = projection(points, Pose.identity(), camera, Pose.identity())
    for k in range(3):
        step = 1e-6 * np.eye(3)[k]
        difference = (camera.project(points + step)[0] - camera.project(points - step)[0]) / 2e-6
        np.testing.assert_allclose(derivative[:, :, k], difference, rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize("shrink", [1, 2])
@pytest.mark.parametrize("seed", range(3))
def test_changes_are_the_readable_ones(seed, shrink):
    rng = np.random.default_rng(seed)
    window = window_around(RIG, Pose.identity(), (0.1, 0.2, 1.5 / shrink), radius_m=0.4)
    while window.shrink != shrink:
        window = window_around(RIG, Pose.identity(), (0.1, 0.1, 0.62), radius_m=0.55)
    width, height = window.camera.width_px * shrink, window.camera.height_px * shrink
    smooth = bell_blurred(rng.uniform(0, 1, (height, width, 3)).astype(np.float32), 3.0, 9)
    background_image = np.clip(0.5 + 6 * (smooth - 0.5), 0, 1)
    relit = background_image * rng.uniform(0.6, 1.2, (height, width, 1)).astype(np.float32)
    live = (np.where(rng.random((height, width, 1)) < 0.7, background_image, relit) * 255).astype(
        np.uint8
    )
    noise = rng.uniform(0.01, 0.06, (height, width)).astype(np.float32)
    exposure = Exposure(np.array([1.1, 1.0, 0.9]), np.array([-0.1, 0, 0.1]), np.full(3, 0.02))
    colours = ColourModel.of_pixels(rng.uniform(0.3, 0.7, (200, 3)))
    shape = (40, 50)
    layers = [
        Layer(
            window.left + left,
            window.top + top,
            rng.uniform(0, 0.5, (*shape, 3)).astype(np.float32),
            rng.uniform(0, 1, shape).astype(np.float32),
            rng.uniform(0, 3, shape).astype(np.float32),
        )
        for left, top in ((-20, 11), (30, -9))
    ]
    size = (LENS.width_px, LENS.height_px)
    wanted = reference.change(
        live,
        background_image,
        noise,
        lens_size=size,
        window=window,
        exposure=exposure,
        layers=layers,
        colours=colours,
    )
    found = KERNELS.change(
        live,
        [background_image[:7], background_image[7:]],
        [noise],
        lens_size=size,
        window=window.corner_and_size,
        shrink=shrink,
        exposure=exposure.rows(),
        layers=[layer.request(window.target_range_m) for layer in layers],
        table=colours.table,
    )
    for one, other, tolerance in zip(found[:4], wanted, (1e-6, 2e-3, 2e-3, 1e-6), strict=True):
        assert (np.abs(one.reshape(other.shape) - other) < tolerance).mean() > 0.999
    assert 0.05 < float((wanted[1] > 0.5).mean()) < 0.95


def test_exposures_are_the_readable_ones():
    rng = np.random.default_rng(1)
    background_image, radius2 = rng.uniform(0, 1, 400), rng.uniform(0, 1, 400)
    seen = background_image * (1.2 - 0.3 * radius2) - 0.02 + rng.normal(0, 0.01, 400)
    seen[::5] = rng.uniform(0, 1, 80)
    found = native.exposure(background_image, radius2, seen, 6)
    np.testing.assert_allclose(
        found, reference.exposure(background_image, radius2, seen, 6), atol=1e-9
    )
    np.testing.assert_allclose(found, (1.2, -0.3, -0.02), atol=0.02)


def test_patches_of_a_lens_in_a_wide_picture_are_averaged():
    picture = np.random.default_rng(2).integers(0, 256, (40, 90, 3), dtype=np.uint8)
    lens = picture[:, 45:]
    corners = np.array([[0, 0], [40, 35], [7, 20]])
    found = native.patch_means(lens, corners, 5).reshape(-1, 3)
    wanted = [lens[y : y + 5, x : x + 5].mean(axis=(0, 1)) / 255 for x, y in corners]
    np.testing.assert_allclose(found, wanted, atol=1e-6)
    with pytest.raises(ValueError, match="wanted 5 px squares within 45×40 px"):
        native.patch_means(lens, np.array([[41, 0]]), 5)


@pytest.mark.parametrize("care", Care)
@pytest.mark.parametrize("size", [(368, 92), (361, 75)], ids=["squares", "cut off"])
def test_rows_are_learned_as_in_numpy(size, care):
    (width, height), is_cautious = size, care is not Care.LITTLE
    rng = np.random.default_rng(6)
    room = bell_blurred(rng.uniform(0, 1, (height, width, 3)).astype(np.float32), 4.0, 12)
    room = np.clip(0.5 + 4 * (room - 0.5), 0.05, 0.95)
    exposure = Exposure(np.array([1.1, 0.95, 1.0]), np.full(3, -0.08), np.full(3, 0.01))
    x = ((np.arange(width) + 0.5) / width - 0.5) * 2
    y = ((np.arange(height) + 40.5) / 300 - 0.5) * 2
    lit = expose(room, exposure, radius2=(x[None, :] ** 2 + y[:, None] ** 2).astype(np.float32))
    lit[20:50, 40:90] *= 0.6  # a shadow
    lit[20:60, 150:200] = 0.9  # a thing
    live = np.clip(255 * lit + rng.normal(0, 2, lit.shape), 0, 255).astype(np.uint8)
    background_image = np.clip(room + rng.normal(0, 0.03, room.shape), 0, 1).astype(np.float32)
    learned, usable = rng.random((2, height, width)) < np.array([0.3, 0.9])[:, None, None]
    known = {"lens_size": (width, 300), "top": 40, "level": 0.07, "is_cautious": is_cautious}
    known["sides"] = surroundings(width, care)
    wanted = reference.learned_rows(
        live, background_image, learned, usable, exposure=exposure, **known
    )
    found = LEARNER.learn(
        live, background_image, learned, usable, exposure=exposure.rows(), **known
    )
    image, noise, mask = (a.reshape(b.shape) for a, b in zip(found, wanted, strict=True))
    np.testing.assert_array_equal(mask, wanted[2])
    np.testing.assert_allclose(image, wanted[0], atol=1e-5)
    np.testing.assert_allclose(noise, wanted[1], atol=1e-5)
    taken = mask & ~learned & usable
    assert taken[25:45, 50:80].any() != is_cautious
    assert not taken[30:50, 160:190].any()
    assert taken[:, 240:].mean() > 0.5


def test_the_learner_refuses_surroundings_without_a_middle():
    pixels = np.zeros((4, 8, 3), np.uint8)
    background_image, flags = np.zeros((4, 8, 3), np.float32), np.ones((4, 8), bool)
    with pytest.raises(ValueError, match="odd sides"):
        LEARNER.learn(
            pixels, background_image, flags, flags, lens_size=(8, 8), top=0,
            exposure=[[1.0] * 3, [0.0] * 3, [0.0] * 3], sides=(3, 4, 3), level=0.07,
            is_cautious=False,
        )  # fmt: skip


def test_what_is_changed_is_what_the_solver_sees(seen):
    evidence, drawn, world_from_object = seen
    measurement = measured(evidence, drawn, world_from_object)
    start = rows_of(world_from_object)
    view, rng = evidence.view, np.random.default_rng(8)
    shape = evidence.live.shape[:2]
    live = np.clip(255 * evidence.live, 0, 255).astype(np.uint8)
    *pictures, solver = KERNELS.change(
        live,
        [np.full((*shape, 3), 0.65, np.float32)],
        [np.full(shape, 0.03, np.float32)],
        lens_size=(480, 480),
        window=(view.left, view.top, shape[1], shape[0]),
        shrink=1,
        exposure=[[1.0] * 3, [0.0] * 3, [0.0] * 3],
        layers=[],
        table=rng.uniform(0, 1, (24, 24, 24)).astype(np.float32),
    )
    same = SeenWindow(*pictures, (shape[1], shape[0]))
    found, wanted = (
        KERNELS.edges(window, measurement.request(), start, 0.002, reach_px=4.0)
        for window in (solver, same)
    )
    for one, other in zip(found, wanted, strict=True):
        np.testing.assert_array_equal(one, other)


def test_a_window_without_all_its_rows_is_refused():
    live, background_image = np.zeros((8, 8, 3), np.uint8), np.zeros((8, 8, 3), np.float32)
    with pytest.raises(ValueError, match=r"plate: parts of .*wanted 8 rows of 24 values"):
        KERNELS.change(
            live, [background_image[:5]], [background_image[..., 0].copy()], lens_size=(8, 8),
            window=(0, 0, 8, 8), shrink=1, layers=[], table=np.zeros((24, 24, 24), np.float32),
            exposure=[[1.0] * 3, [0.0] * 3, [0.0] * 3],
        )  # fmt: skip


@pytest.mark.parametrize("lens", [LENS, DISTORTED], ids=["equidistant", "distorted"])
def test_places_are_cut_out_as_in_numpy(lens):
    rng = np.random.default_rng(2)
    picture = bell_blurred(rng.uniform(0, 1, (480, 480, 3)).astype(np.float32), 3.0, 9)
    foreground = np.clip(4 * (picture[..., :2] - 0.4), 0, 1)
    picture = np.ascontiguousarray(np.concatenate([picture, foreground], axis=2))
    world_from_lens = look_at(np.array([0.2, 0.1, 1.2]), np.array([1.0, 2.0, 0.6]))
    # Near, far, beside the lens, and behind it.
    centres = np.array([[1.0, 2.0, 0.5], [3.0, 6.0, 0.0], [3.5, -1.0, 0.2], [-2.0, -3.0, 1.0]])
    wanted = reference.cut_out(picture, lens, world_from_lens, centres, 0.5)
    found = cut_out(picture, lens, world_from_lens, centres, 0.5)
    for name in ("colours", "own", "free"):
        one, other = getattr(found, name), getattr(wanted, name)
        # OpenCV takes the nearest of 32 places between two pixels.
        assert np.abs(one - other).mean() < 1e-3
        assert (np.abs(one - other) < 0.02).mean() > 0.998
    np.testing.assert_allclose(found.azimuth_rad, wanted.azimuth_rad)
    np.testing.assert_allclose(found.elevation_rad, wanted.elevation_rad)
    assert [bool(own.any()) for own in found.own[[0, 1, 3]]] == [True, True, False]


def test_a_window_is_sampled_as_in_numpy(seen):
    evidence, _, _ = seen
    height, width = evidence.own.shape
    pixels = np.random.default_rng(5).uniform(-3, [width + 3, height + 3], (200, 2))
    smooth = bell_blurred(evidence.live, 0.8, 3)
    wanted = [sample(p, pixels) for p in (evidence.foreground, evidence.own, evidence.hidden)]
    found = evidence.seen.sample(pixels).reshape(-1, 6)
    np.testing.assert_allclose(found[:, :3], np.stack(wanted, axis=1), atol=1e-6)
    np.testing.assert_allclose(found[:, 3:], sample(smooth, pixels), atol=1e-5)
