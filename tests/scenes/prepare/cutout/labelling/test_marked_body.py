"""Boxes and strokes in a few photos of a room that was filmed from all around."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.package.records import ViewPoint
from scenes.prepare.cutout.labelling.marked_body import marked_body
from scenes.prepare.cutout.marks.masked_view import MaskedView
from scenes.prepare.cutout.votes.lifting import share
from scenes.render.native import NativeRenderer
from scenes.splats import concatenate

CAMERA = Pinhole(240, 180, 200.0, 200.0, 120.0, 90.0)
SIZES_M = {"low": (0.3, 0.2, 0.06), "box": (0.3, 0.2, 0.4), "tall": (0.12, 0.12, 0.8)}
STEP_M = 0.012
APART_M = 0.6
FLOOR, FIRST, SECOND = 0, 1, 2
BESIDE_EACH_OTHER = (6, 11)
"""Photos in which neither box hides the other."""


@pytest.fixture(scope="module")
def renderer():
    return NativeRenderer()


@pytest.fixture(scope="module", params=SIZES_M.values(), ids=SIZES_M)
def room(request, box_on_floor):
    """Splats of a floor and two boxes alike, whose each is, and their height."""
    floor, box = box_on_floor(np.array(request.param), floor_m=2.4, step_m=STEP_M)
    parts = [floor, box, moved(box, APART_M)]
    kind = np.concatenate([np.full(len(part), number) for number, part in enumerate(parts)])
    return concatenate(parts), kind, request.param[2]


def moved(cloud, along_x_m):
    return replace(cloud, means=cloud.means + np.array([along_x_m, 0, 0], cloud.means.dtype))


@pytest.fixture(scope="module")
def walk():
    """Photos from all around both, high and low."""
    middle = np.array([APART_M / 2, 0.0, 0.2])
    return tuple(
        ViewPoint(
            f"{turn:.1f}-{height}", CAMERA,
            look_at(middle + np.array([1.5 * np.cos(turn), 1.5 * np.sin(turn), height]), middle),
        )
        for turn in np.arange(0.0, 2 * np.pi, np.pi / 7)
        for height in (0.4, 1.0)
    )  # fmt: skip


def boxed(room, view, renderer, numbers, *, pad_px=3.0, **strokes):
    """A box that somebody drew around some of the boxes, with the mask inside it."""
    cloud, kind, _ = room
    own = np.isin(kind, numbers)
    mask = share(cloud, own, view.camera, view.world_from_camera, renderer=renderer) > 0.5
    rows, columns = np.nonzero(mask)
    low = columns.min() - pad_px, rows.min() - pad_px
    box = (*low, columns.max() + 1 + pad_px, rows.max() + 1 + pad_px)
    return MaskedView(view.name, view.camera, view.world_from_camera, mask, box, **strokes)


def overlap(labels, kind, room, number):
    """IoU among splats that photos show: not those that a box stands on."""
    own, seen = kind == number, room[0].means[:, 2] > 0.5 * STEP_M
    return (labels & own & seen).sum() / ((labels | own) & seen).sum()


@pytest.mark.parametrize("number", [FIRST, SECOND])
@pytest.mark.parametrize("pad_px", [1.0, 6.0])
def test_two_boxes_find_the_whole_object(room, walk, renderer, number, pad_px):
    cloud, kind, _ = room
    views = [boxed(room, walk[k], renderer, [number], pad_px=pad_px) for k in BESIDE_EACH_OTHER]
    found = marked_body(cloud, views, viewpoints=walk, renderer=renderer)
    assert overlap(found.labels, kind, room, number) > 0.97
    assert [verdict.used for verdict in found.views] == [True, True]
    assert all(verdict.overlap > 0.5 for verdict in found.views)
    assert found.own[:, 2].max() == pytest.approx(room[2], abs=0.02)


def test_a_mask_that_lost_the_lower_half_does_not_cut_it_off(room, walk, renderer):
    cloud, kind, height = room
    views = []
    for k in BESIDE_EACH_OTHER:
        view = boxed(room, walk[k], renderer, [FIRST])
        upper = cloud.means[:, 2] > 0.5 * height
        lit = share(
            cloud, (kind == FIRST) & upper, view.camera, view.world_from_camera, renderer=renderer
        )
        views.append(
            MaskedView(view.name, view.camera, view.world_from_camera, lit > 0.5, view.box_px)
        )
    found = marked_body(cloud, views, viewpoints=walk, renderer=renderer)
    assert overlap(found.labels, kind, room, FIRST) > 0.95


def test_a_view_without_a_mask_is_said_to_be_left_out(room, walk, renderer):
    cloud, _, _ = room
    pose = walk[0].world_from_camera
    empty = MaskedView("empty", CAMERA, pose, np.zeros((180, 240), dtype=bool))
    views = [empty, *(boxed(room, walk[k], renderer, [FIRST]) for k in BESIDE_EACH_OTHER)]
    found = marked_body(cloud, views, viewpoints=walk, renderer=renderer)
    assert [verdict.used for verdict in found.views] == [False, True, True]


def test_a_stroke_says_which_of_two_in_a_box_is_meant(room, walk, renderer):
    cloud, kind, height = room
    ends = np.array([[0.0, 0.0, height], [APART_M, 0.0, height]])
    for number, (inside, outside) in ((FIRST, ends), (SECOND, ends[::-1])):
        views = []
        for k in BESIDE_EACH_OTHER:
            pose = walk[k].world_from_camera
            pixels, _ = CAMERA.project(pose.inverse() @ np.stack([inside, outside]))
            strokes = {"inside_px": pixels[:1], "outside_px": pixels[1:]}
            views.append(boxed(room, walk[k], renderer, [FIRST, SECOND], **strokes))
        found = marked_body(cloud, views, viewpoints=walk, renderer=renderer)
        assert overlap(found.labels, kind, room, number) > 0.95


def test_boxes_that_mean_nothing_are_refused(room, walk, renderer):
    cloud, _, _ = room
    pose = walk[0].world_from_camera
    empty = MaskedView("v", CAMERA, pose, np.zeros((180, 240), dtype=bool))
    with pytest.raises(ValueError, match="no view with a mask"):
        marked_body(cloud, [], viewpoints=walk, renderer=renderer)
    with pytest.raises(ValueError, match="the mask is empty in v"):
        marked_body(cloud, [empty], viewpoints=walk, renderer=renderer)
    different = [
        boxed(room, walk[k], renderer, [number], pad_px=0.0)
        for k, number in ((6, FIRST), (7, SECOND))
    ]
    with pytest.raises(ValueError, match="around different places"):
        marked_body(cloud, different, viewpoints=walk, renderer=renderer)
