"""A hand's marks take what hangs in a room, and leave the room behind it."""

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.package import ScenePackage
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.cutout.cutout import undo_cut
from scenes.prepare.cutout.marks.drawn import Drawn
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.prepare.cutout.remainder.cleaning import marked_splats, remove_marked
from scenes.render.native import NativeRenderer
from scenes.splats import SplatCloud

CAMERA = Pinhole(160, 120, 130.0, 130.0, 80.0, 60.0)
FLOATER = np.array([0.1, 0.0, 0.8])
EYES = (np.array([0.3, -1.8, 1.6]), np.array([-1.7, 0.4, 1.5]))


@pytest.fixture(scope="module")
def package():
    """A floor with a cloud of stray splats above it, seen from two sides."""
    rng = np.random.default_rng(3)
    floor = rng.uniform((-1.5, -1.5, 0.0), (1.5, 1.5, 0.001), (8000, 3))
    stray = FLOATER + rng.normal(0.0, 0.03, (60, 3))
    means = np.concatenate([floor, stray])
    scales = np.full((len(means), 3), 0.02)
    sh = np.zeros((len(means), 1, 3))
    turned = np.tile([1.0, 0, 0, 0], (len(means), 1))
    opacities = np.concatenate([np.full(len(floor), 0.95), np.full(len(stray), 0.5)])
    room = SplatCloud(means, scales, turned, opacities, sh)
    target = np.array([0.0, 0.0, 0.5])
    views = tuple(ViewPoint(f"{k}.png", CAMERA, look_at(eye, target)) for k, eye in enumerate(EYES))
    return ScenePackage(
        "dusty",
        room,
        (),
        (),
        Pose.identity(),
        np.array([[-1.5, -1.5], [1.5, 1.5]]),
        None,
        (),
        views,
    )


def marked(package, number, radius_px=16.0, shift=(0.0, 0.0)):
    view = package.views[number]
    pixels, _ = CAMERA.project((view.world_from_camera.inverse() @ FLOATER)[None])
    x, y = pixels[0] + shift
    angles = np.linspace(0, 2 * np.pi, 20)
    outline = tuple(
        (float(x + radius_px * np.cos(a)), float(y + radius_px * np.sin(a))) for a in angles
    )
    mask = Drawn(outlines=(outline,)).mask(160, 120)
    return MaskedView(view.name, CAMERA, view.world_from_camera, mask)


@pytest.mark.parametrize("numbers", [(0,), (1,), (0, 1)])
def test_what_hangs_there_is_meant_and_the_floor_behind_is_not(package, numbers):
    views = [marked(package, number) for number in numbers]
    found = marked_splats(package.room, views, renderer=NativeRenderer())
    assert found[8000:].mean() > 0.9
    assert found[:8000].sum() <= 2


def test_removing_is_undone_to_the_bit(package):
    cleaned, count = remove_marked(package, [marked(package, 0)], renderer=NativeRenderer())
    assert count == len(package.room) - len(cleaned.room) > 50
    assert cleaned.stages[-1].detail == f"{count} splats removed that were marked by hand"
    again = undo_cut(cleaned)
    assert np.array_equal(again.room.means, package.room.means)
    assert again.stages == package.stages


def test_the_room_itself_is_not_taken_by_one_mark_and_nothing_by_marks_of_different_things(package):
    with pytest.raises(ValueError, match="mark it in a second view, from a side"):
        remove_marked(
            package, [marked(package, 0, 8.0, shift=(50.0, 40.0))], renderer=NativeRenderer()
        )
    with pytest.raises(ValueError, match="mark the same thing in each view"):
        remove_marked(
            package,
            [marked(package, 0), marked(package, 1, 6.0, shift=(-60.0, -40.0))],
            renderer=NativeRenderer(),
        )
