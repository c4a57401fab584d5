"""What few views found of a box on a floor, held against a walk around it."""

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.cutout.labelling.separate import separate
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.prepare.cutout.votes.lifting import share
from scenes.prepare.cutout.votes.room_views import held_against_views
from scenes.render.native import NativeRenderer
from scenes.splats import concatenate

CAMERA = Pinhole(160, 120, 140.0, 140.0, 80.0, 60.0)
SIZE = np.array([0.3, 0.2, 0.4])
STEP_M = 0.02
FLOOR, BOX, HAZE = 0, 1, 2


@pytest.fixture(scope="module")
def room(box_on_floor, flat_splats):
    """A floor, a box with an underside that no view shows, and faint haze around it."""
    floor, box = box_on_floor(SIZE, floor_m=1.0, step_m=STEP_M)
    rng = np.random.default_rng(4)
    air = rng.uniform((-0.35, -0.3, 0.05), (0.35, 0.3, 0.5), (900, 3))
    outside = (np.abs(air - (0, 0, 0.2)) > 0.5 * SIZE + 0.05).any(axis=1)
    haze = flat_splats(air[outside][:250], 2, (0.7, 0.65, 0.6), step_m=STEP_M, opacity=0.04)
    parts = [floor, box, haze]
    kind = np.concatenate([np.full(len(part), k) for k, part in enumerate(parts)])
    return concatenate(parts), kind


@pytest.fixture(scope="module")
def renderer():
    return NativeRenderer()


def walk(count):
    centre = np.array([0.0, 0.0, 0.2])
    turns = np.linspace(0, 2 * np.pi, count, endpoint=False) + 0.1
    return tuple(
        ViewPoint(
            f"{k}.jpg",
            CAMERA,
            look_at(np.array([1.2 * np.cos(a), 1.2 * np.sin(a), 0.7 + 0.3 * (k % 2)]), centre),
        )
        for k, a in enumerate(turns)
    )


def marked(room, renderer, views):
    cloud, kind = room
    masked = []
    for view in views:
        light = share(cloud, kind == BOX, view.camera, view.world_from_camera, renderer=renderer)
        mask = light > 0.5
        rows, columns = np.nonzero(mask)
        box = (columns.min() - 4.0, rows.min() - 4.0, columns.max() + 5.0, rows.max() + 5.0)
        masked.append(MaskedView(view.name, view.camera, view.world_from_camera, mask, box))
    return masked


def underside(cloud):
    return np.abs(cloud.means[:, 2]) < 0.002


def test_undersides_that_no_view_shows_are_kept(room, renderer):
    cloud, kind = room
    views = walk(20)
    found = separate(
        cloud, marked(room, renderer, views[::7]), renderer=renderer, viewpoints=views
    ).labels
    below = (kind == BOX) & underside(cloud)
    assert (found & below).sum() > 0.9 * below.sum()
    assert (found & (kind == BOX)).sum() / (found | (kind == BOX)).sum() > 0.95


def test_a_low_thing_keeps_its_lowest_part(box_on_floor, renderer):
    """Half of it lies as near to the floor as a trained floor is thick; the masks tell it apart."""
    floor, low = box_on_floor((0.3, 0.2, 0.04), floor_m=1.0, step_m=0.01)
    cloud = concatenate([floor, low])
    kind = np.repeat([FLOOR, BOX], [len(floor), len(low)])
    views = walk(20)
    masked = marked((cloud, kind), renderer, views[::7])
    found = separate(cloud, masked, renderer=renderer, viewpoints=views).labels
    sides = (kind == BOX) & (cloud.means[:, 2] < 0.02) & ~underside(cloud)
    assert (found & sides).sum() > 0.9 * sides.sum()
    assert (found & (kind == BOX)).sum() / (found | (kind == BOX)).sum() > 0.95


def test_faint_splats_go_with_the_surface_they_hang_at(room, flat_splats, renderer):
    """Whatever they were guessed to be: at the box's side, at the floor, and far from both."""
    cloud, kind = room
    rng = np.random.default_rng(7)
    places = {
        "box": rng.uniform((0.162, -0.08, 0.1), (0.168, 0.08, 0.38), (40, 3)),
        "floor": rng.uniform((0.3, -0.2, 0.006), (0.38, 0.2, 0.012), (40, 3)),
        "air": rng.uniform((0.22, -0.08, 0.2), (0.24, 0.08, 0.3), (40, 3)),
    }
    faint = [
        flat_splats(at, 2, (0.7, 0.65, 0.6), step_m=0.02, opacity=0.06) for at in places.values()
    ]
    both = concatenate([cloud, *faint])
    where = np.concatenate([np.full(len(cloud), ""), np.repeat(list(places), 40)])
    guess = np.concatenate([kind == BOX, np.ones(120, bool)])
    found = held_against_views(
        both,
        guess,
        np.ones(len(both), bool),
        walk(20),
        hidden=np.zeros(len(both), bool),
        renderer=renderer,
    )
    assert found[where == "box"].mean() > 0.9
    assert found[where == "floor"].mean() < 0.1
    assert found[where == "air"].mean() < 0.1


def test_many_views_leave_out_haze_that_three_views_take_in(room, renderer):
    cloud, kind = room
    views = walk(20)
    guess = (kind == BOX) | (kind == HAZE)
    hidden = (kind == BOX) & underside(cloud)
    within = (np.abs(cloud.means - (0, 0, 0.2)) < 0.4).all(axis=1)
    found = held_against_views(cloud, guess, within, views, hidden=hidden, renderer=renderer)
    assert (found & (kind == HAZE)).sum() < 0.25 * (kind == HAZE).sum()
    assert (found & (kind == BOX)).sum() > 0.97 * (kind == BOX).sum()


def test_what_a_guess_lacks_is_found_where_it_is_seen(room, renderer):
    """A tenth of the box was missed: its light falls into the silhouettes of the rest."""
    cloud, kind = room
    rng = np.random.default_rng(0)
    guess = (kind == BOX) & (rng.random(len(cloud)) > 0.1)
    within = kind != HAZE
    hidden = (kind == BOX) & underside(cloud)
    found = held_against_views(cloud, guess, within, walk(12), hidden=hidden, renderer=renderer)
    assert ((kind == BOX) & ~found).sum() < 0.3 * ((kind == BOX) & ~guess).sum()


def test_nothing_outside_what_may_be_the_thing_is_taken(room, renderer):
    cloud, kind = room
    within = (kind == BOX) & (cloud.means[:, 0] > 0)
    found = held_against_views(
        cloud, kind == BOX, within, walk(8), hidden=np.zeros(len(cloud), bool), renderer=renderer
    )
    assert found.any()
    assert not (found & ~within).any()


@pytest.mark.parametrize("count", [0, 2])
def test_too_few_views_change_nothing(room, renderer, count):
    cloud, kind = room
    guess, hidden = kind == BOX, (kind == BOX) & underside(cloud)
    within = np.ones(len(cloud), bool)
    found = held_against_views(
        cloud, guess & ~hidden, within, walk(count), hidden=hidden, renderer=renderer
    )
    np.testing.assert_array_equal(found, guess)


def test_views_that_cut_the_thing_off_do_not_speak(room, renderer):
    cloud, kind = room
    away = Pose(np.eye(3), np.array([0.0, 0.0, 5.0]))
    views = tuple(ViewPoint(f"{k}", CAMERA, away) for k in range(8))
    guess = kind == BOX
    nothing = np.zeros(len(cloud), bool)
    found = held_against_views(cloud, guess, guess, views, hidden=nothing, renderer=renderer)
    np.testing.assert_array_equal(found, guess)
