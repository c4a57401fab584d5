import math
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from devices.messages import Frame
from scenes.cameras import Fisheye, Rig
from scenes.pose import Pose
from scenes.quad import quad_of
from scenes.state import LiveSurface
from tracking.background.images import BackgroundImages
from tracking.surfaces.live import Occluders, SurfacesState, step
from tracking.surfaces.view import surface_view
from tracking.window.window import Layer

PHOTOS = Path(__file__).parents[3].parent / "shared" / "data" / "photos_lund" / "images"
LENS = Fisheye.from_fov(600, math.radians(200))
RIG = Rig((LENS,), (Pose.identity(),))
BOARD = np.array([[-0.6, -0.5, 1.5], [0.6, -0.5, 1.5], [0.6, 0.3, 1.5], [-0.6, 0.3, 1.5]])
SIZE = (150, 100)
SURFACE = LiveSurface("board", BOARD, SIZE, "cam")
HERE = Pose.identity()


def room():
    """A lens picture of a grey room with a patterned white board."""
    rng = np.random.default_rng(1)
    picture = np.full((600, 600, 3), 110, np.uint8)
    cv2.fillConvexPoly(picture, outline(BOARD), (225, 225, 220))
    for _ in range(12):
        x, y = LENS.project(rng.uniform([-0.5, -0.45, 1.5], [0.5, 0.25, 1.5]))[0][0]
        cv2.circle(picture, (int(x), int(y)), 4, (40, 60, 160), -1)
    return cv2.GaussianBlur(picture, (0, 0), 0.7)


def outline(points):
    return np.round(LENS.project(points)[0] - 0.5).astype(np.int32)


def drawn(picture, points, colour):
    return cv2.fillConvexPoly(picture.copy(), outline(np.array(points)), colour)


def with_arm(picture):
    """A dark arm that reaches from the right into the middle of the board."""
    arm = [[0.0, -0.15, 1.4], [1.2, -0.15, 1.4], [1.2, 0.0, 1.4], [0.0, 0.0, 1.4]]
    return drawn(picture, arm, (60, 40, 30))


def with_writing(picture):
    note = [[-0.4, -0.3, 1.5], [-0.1, -0.3, 1.5], [-0.1, -0.2, 1.5], [-0.4, -0.2, 1.5]]
    return drawn(picture, note, (200, 30, 30))


def frame(picture, seq=0, rig=RIG):
    noise = np.random.default_rng(seq).normal(scale=2.0, size=picture.shape)
    noisy = np.clip(picture + noise, 0, 255).astype(np.uint8)
    return Frame("cam", seq, seq * 33_000_000, 0, (noisy,) * len(rig.lenses), rig, HERE)


def play(pictures, state=None, **options):
    state, shown = state or SurfacesState(), []
    for seq, picture in enumerate(pictures):
        state, (surface,) = step(state, frame(picture, seq), [SURFACE], HERE, **options)
        shown.append(surface)
    return state, shown


def place(x, y):
    """Row and column of a place on the board, in metres."""
    return int((y + 0.5) / 0.8 * SIZE[1]), int((x + 0.6) / 1.2 * SIZE[0])


def test_what_reaches_in_from_outside_leaves_the_last_clean_picture():
    clean = room()
    state, shown = play([clean] * 4)
    assert all(surface.fresh.all() for surface in shown)
    before = shown[-1].picture
    _, (hidden,) = step(state, frame(with_arm(clean), 9), [SURFACE], HERE)
    arm, free = place(0.3, -0.08), place(-0.4, 0.1)
    assert not hidden.fresh[arm]
    assert hidden.fresh[free]
    # The whole arm is hidden, little beside it, and the board behind it is still shown.
    share = 1 - hidden.fresh.mean()
    true_share = 0.6 * 0.15 / (1.2 * 0.8)
    assert true_share < share < 2.2 * true_share
    assert np.abs(hidden.picture[~hidden.fresh].astype(int) - before[~hidden.fresh]).max() == 0
    assert hidden.picture.min(axis=2)[place(0.3, -0.08)] > 150
    # When the arm goes, everything is fresh again.
    _, (after,) = step(state, frame(clean, 10), [SURFACE], HERE)
    assert after.fresh.all()


def test_what_changes_on_the_surface_only_is_shown_at_once():
    clean = room()
    state, _ = play([clean] * 4)
    _, (written,) = step(state, frame(with_writing(clean), 9), [SURFACE], HERE)
    assert written.fresh.all()
    assert written.picture[place(-0.25, -0.25)][0] > written.picture[place(-0.25, -0.25)][2] + 80


def test_writing_that_stays_is_known_when_the_arm_comes_back():
    clean = room()
    written = with_writing(clean)
    _, shown = play([clean, clean, with_arm(clean), *[written] * 12, with_arm(written)])
    last = shown[-1]
    assert last.fresh[place(-0.25, -0.25)]
    assert not last.fresh[place(0.3, -0.08)]


def test_a_film_that_plays_is_fresh_while_somebody_stands_at_its_edge():
    clean = room()
    rng = np.random.default_rng(4)
    films = [
        drawn(clean, BOARD * [0.97, 0.97, 1], tuple(int(v) for v in rng.integers(20, 236, 3)))
        for _ in range(25)
    ]
    state, _ = play(films)
    edge = [[0.55, -0.6, 1.4], [0.9, -0.6, 1.4], [0.9, 0.6, 1.4], [0.55, 0.6, 1.4]]
    _, (watched,) = step(state, frame(drawn(films[3], edge, (10, 10, 10)), 30), [SURFACE], HERE)
    assert watched.fresh[:, : SIZE[0] // 2].all()


def test_exposure_that_drifts_hides_nothing():
    clean = room().astype(float)
    bright = [np.clip(clean * (1 + 0.01 * k), 0, 255) for k in range(12)]
    _, shown = play(bright)
    assert all(surface.fresh.mean() > 0.99 for surface in shown)


def test_with_background_images_the_first_frame_may_have_somebody_in_it():
    clean = room()
    whole = np.ones((600, 600), np.float32)
    background = BackgroundImages.of_pictures(HERE, (clean.astype(np.float32) / 255,), (whole,))
    first = frame(with_arm(clean))
    state, (seen,) = step(SurfacesState(), first, [SURFACE], HERE, Occluders(background=background))
    assert not seen.fresh[place(0.3, -0.08)]
    assert seen.picture[place(0.3, -0.08)].max() < 100  # there is nothing else to show
    _, (seen,) = step(state, frame(clean, 1), [SURFACE], HERE)
    assert seen.picture[place(0.3, -0.08)].min() > 180
    _, (unaware,) = step(SurfacesState(), first, [SURFACE], HERE)
    assert unaware.fresh.all()


@pytest.mark.parametrize(("away_m", "hides"), [(1.0, True), (2.5, False)])
def test_tracked_objects_hide_what_is_behind_them(away_m, hides):
    x, y = outline(np.array([[0.1, -0.1, 1.5]]))[0]
    side = 40
    layer = Layer(
        int(x) - side // 2,
        int(y) - side // 2,
        np.zeros((side, side, 3), np.float32),
        np.ones((side, side), np.float32),
        np.full((side, side), away_m, np.float32),
    )
    clean = room()
    state, _ = play([clean] * 2)
    chair = drawn(clean, BOARD * 0.1 + [0.04, -0.1, 1.35], (0, 0, 0))
    known = Occluders(layers=((layer,),))
    _, (surface,) = step(state, frame(chair, 9), [SURFACE], HERE, known)
    assert surface.fresh[place(0.1, -0.1)] != hides
    assert surface.fresh[place(-0.5, -0.4)]


def test_steps_are_pure_and_tables_are_kept_while_the_camera_stands():
    clean = room()
    state, _ = play([clean] * 2)
    before = state.memories["board"].picture.copy()
    following, first = step(state, frame(with_arm(clean), 5), [SURFACE], HERE)
    _, second = step(state, frame(with_arm(clean), 5), [SURFACE], HERE)
    np.testing.assert_array_equal(first[0].picture, second[0].picture)
    np.testing.assert_array_equal(state.memories["board"].picture, before)
    assert following.memories["board"].fine is state.memories["board"].fine
    moved = Pose(np.eye(3), np.array([0.05, 0.0, 0.0]))
    elsewhere, _ = step(following, frame(clean, 6), [SURFACE], moved)
    assert elsewhere.memories["board"].fine is not state.memories["board"].fine


def test_surfaces_come_go_and_belong_to_streams():
    clean = room()
    other = replace(SURFACE, surface_id="other", stream_id="another camera")
    state, shown = step(SurfacesState(), frame(clean), [SURFACE, other], HERE)
    assert [surface.surface_id for surface in shown] == ["board"]
    state, shown = step(state, frame(clean), [], HERE)
    assert shown == ()
    assert not state.memories
    behind = replace(SURFACE, corners_in_world=BOARD[[1, 0, 3, 2]])
    _, (unseen,) = step(state, frame(clean), [behind], HERE)
    assert unseen.lens is None
    assert not unseen.fresh.any()


def test_a_photograph_on_the_wall_is_registered_to_a_fifth_of_a_pixel(raycast):
    from scenes.mesh import TexturedMesh

    files = sorted(PHOTOS.glob("*.[jJ][pP]*[gG]"))
    if not files:
        pytest.skip(f"no photographs in {PHOTOS}")
    photo = cv2.cvtColor(cv2.imread(str(files[0])), cv2.COLOR_BGR2RGB)
    photo = cv2.resize(photo, (600, 400), interpolation=cv2.INTER_AREA)
    uv = np.array([[0, 1], [1, 1], [1, 0], [0, 0]], np.float32)
    mesh = TexturedMesh(BOARD, np.array([[0, 2, 1], [0, 3, 2]], np.int32), uv, photo)
    world_from_rig = Pose.from_yaw(0.3, (0.2, 0.1, 0.3))
    lens_picture, _, _ = raycast([(mesh, Pose.identity())], LENS, world_from_rig, shade=False)
    taken = Frame("cam", 0, 0, 0, (lens_picture,), RIG, world_from_rig)
    _, (shown,) = step(SurfacesState(), taken, [SURFACE], world_from_rig)
    want = cv2.resize(photo, SIZE, interpolation=cv2.INTER_AREA)
    greys = [cv2.cvtColor(p, cv2.COLOR_RGB2GRAY) for p in (want, shown.picture)]
    _, found = cv2.findTransformECC(
        *greys, np.eye(3, dtype=np.float32), cv2.MOTION_HOMOGRAPHY,
        (cv2.TERM_CRITERIA_EPS | cv2.TERM_CRITERIA_COUNT, 200, 1e-7), None, 3,
    )  # fmt: skip
    corners = np.array([[[0, 0], [150, 0], [150, 100], [0, 100]]], np.float32)
    moved = cv2.perspectiveTransform(corners, found) - corners
    assert np.linalg.norm(moved, axis=2).max() < 0.2


def test_view_and_step_agree():
    clean = frame(room())
    _, (shown,) = step(SurfacesState(), clean, [SURFACE], HERE)
    view = surface_view(quad_of(BOARD), RIG, HERE, SIZE)
    np.testing.assert_array_equal(shown.picture, view.picture(clean.images))


def test_what_was_there_at_first_and_went_is_forgotten_and_so_is_a_poster_put_up():
    clean, at = room(), place(0.3, -0.08)
    for first, then in ((with_arm(clean), clean), (clean, with_arm(clean))):
        state, levels = SurfacesState(), []
        for second in range(16):
            picture = first if second < 2 else then
            state, (seen,) = step(state, frame(picture, 30 * second), [SURFACE], HERE)
            levels.append(seen.picture[at].max())
        assert np.ptp(levels[:8]) < 20
        assert abs(float(levels[-1]) - float(levels[0])) > 100
