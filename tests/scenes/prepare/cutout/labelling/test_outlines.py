"""Outlines in drawn views decide whose a splat is: what it paints, not what it is near to."""

from dataclasses import replace

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.package.records import ViewPoint
from scenes.prepare.cutout.labelling.outlines import outlined, separated
from scenes.prepare.cutout.labelling.surface_cells import surface_cells
from scenes.render.native import NativeRenderer
from scenes.splats import concatenate

CAMERA = Pinhole(240, 180, 200.0, 200.0, 120.0, 90.0)
SIZE_M = np.array([0.3, 0.2, 0.25])
STEP_M = 0.012
WALL_Y_M = 0.6
FLOOR, BOX, HALO, SHADOW = range(4)
GREY, SHADE = (0.55, 0.6, 0.75), (0.25, 0.22, 0.2)


@pytest.fixture(scope="module")
def renderer():
    return NativeRenderer()


@pytest.fixture(scope="module")
def room(box_on_floor, flat_splats):
    """A box before a wall, with a shred of the wall beside it and a dark shadow at its foot."""
    floor, box = box_on_floor(SIZE_M, floor_m=2.4, step_m=STEP_M)
    x, z = (grid.ravel() for grid in np.meshgrid(*[np.arange(-1.2, 1.2, STEP_M)] * 2))
    wall = flat_splats(np.stack([x, np.full_like(x, WALL_Y_M), z + 1.2], axis=1), 1, GREY,
                       step_m=STEP_M)  # fmt: skip
    high = np.arange(0.03, SIZE_M[2], STEP_M)
    beyond = SIZE_M[:2] / 2 + 0.015
    beside = np.stack([np.full_like(high, beyond[0]), np.full_like(high, beyond[1]), high])
    halo = flat_splats(beside.T, 1, GREY, step_m=STEP_M, opacity=0.3)
    shade = np.arange(-0.1, 0.1, STEP_M)
    u, v = (grid.ravel() for grid in np.meshgrid(shade, shade / 2))
    dark = np.stack([u, v - SIZE_M[1] / 2 - 0.06, np.full_like(u, 0.001)], axis=1)
    shadow = flat_splats(dark, 2, SHADE, step_m=STEP_M)
    parts = [concatenate([floor, wall]), box, halo, shadow]
    kind = np.concatenate([np.full(len(part), number) for number, part in enumerate(parts)])
    return concatenate(parts), kind


@pytest.fixture(scope="module")
def walk():
    """Photos from before the wall, high and low."""
    middle = np.array([0.0, 0.0, 0.12])
    return tuple(
        ViewPoint(
            f"{turn:.1f}-{height}", CAMERA,
            look_at(middle + np.array([1.1 * np.sin(turn), -1.1 * np.cos(turn), height]), middle),
        )
        for turn in np.linspace(-1.2, 1.2, 9)
        for height in (0.35, 0.8)
    )  # fmt: skip


@pytest.fixture(scope="module")
def cells(room, walk, renderer):
    own = room[0].means[room[1] == BOX].astype(np.float64)
    return surface_cells(
        room[0], walk, around=own, corners=(own.min(axis=0) - 0.35, own.max(axis=0) + 0.35),
        side_m=STEP_M, renderer=renderer,
    )  # fmt: skip


def in_box(points, margin_m):
    beyond = np.abs(points - (0, 0, SIZE_M[2] / 2)) - SIZE_M / 2
    return beyond.max(axis=1) < margin_m


def found_of(room, cells, renderer, *, labels):
    cloud, _ = room
    sure = np.zeros(len(cells), dtype=bool)
    inside = in_box(cells.places, 0.15)
    within = in_box(cloud.means.astype(np.float64), 0.15)
    return separated(
        cloud, cells, labels=labels & inside, inside=inside, sure=sure, within=within,
        renderer=renderer,
    )  # fmt: skip


def test_what_hangs_beside_and_paints_the_wall_is_the_walls(room, cells, renderer):
    _, kind = room
    # Cells that reach two sides beyond the object, as rough depth makes them.
    found = found_of(room, cells, renderer, labels=in_box(cells.places, 0.024))
    seen = (kind == BOX) & (room[0].means[:, 2] > STEP_M)
    assert found.labels[seen].mean() > 0.95
    assert found.labels[kind == HALO].mean() < 0.1
    assert found.labels[kind == FLOOR].sum() < 0.03 * seen.sum()


def test_a_shadow_that_was_taken_along_stays_on_the_floor(room, cells, renderer):
    _, kind = room
    dark = (cells.places[:, 2] < 0.01) & (cells.colours.max(axis=1) < 0.4)
    assert dark.sum() > 20
    found = found_of(room, cells, renderer, labels=in_box(cells.places, 0.01) | dark)
    assert found.labels[kind == SHADOW].mean() < 0.1
    assert found.labels[(kind == BOX) & (room[0].means[:, 2] > STEP_M)].mean() > 0.95


def test_half_of_the_cells_give_the_whole_outline(room, cells, renderer):
    _, kind = room
    half = in_box(cells.places, 0.01) & (cells.places[:, 0] < 0.0)
    found = found_of(room, cells, renderer, labels=half)
    # Nobody walked behind it.
    before = (room[0].means[:, 1] < 0.45 * SIZE_M[1]) & (room[0].means[:, 2] > STEP_M)
    assert found.labels[(kind == BOX) & before].mean() > 0.95
    own = in_box(found.own, 0.02)
    assert own.mean() > 0.97


@pytest.mark.parametrize("struck", [False, True])
def test_a_twin_that_touches_is_parted_by_a_stroke(box_on_floor, renderer, struck):
    floor, box = box_on_floor(SIZE_M, floor_m=1.5, step_m=STEP_M)
    twin = replace(box, means=box.means + np.array([SIZE_M[0], 0, 0], box.means.dtype))
    cloud = concatenate([floor, box, twin])
    kind = np.repeat([0, 1, 2], [len(floor), len(box), len(twin)])
    middle = np.array([SIZE_M[0] / 2, 0.0, 0.12])
    around = tuple(
        ViewPoint(f"{t:.1f}", CAMERA, look_at(middle + 1.3 * np.array([np.sin(t), -np.cos(t), 0.5]),
                                              middle))
        for t in np.linspace(-3.0, 3.0, 14)
    )  # fmt: skip
    own = cloud.means[kind == 1].astype(np.float64)
    cells = surface_cells(
        cloud, around, around=own, corners=(own.min(axis=0) - 0.2, own.max(axis=0) + 0.2),
        side_m=STEP_M, renderer=renderer,
    )  # fmt: skip
    labels = in_box(cells.places, 0.01) & (cells.places[:, 0] < SIZE_M[0] / 2)
    on_twin = np.linalg.norm(cells.places - (0.2, 0.0, SIZE_M[2]), axis=1) < 0.04
    assert on_twin.any()
    found = separated(
        cloud, cells, labels=labels, inside=in_box(cells.places, 0.1), sure=on_twin & struck,
        within=in_box(cloud.means.astype(np.float64), 0.1), renderer=renderer,
    )  # fmt: skip
    seen = cloud.means[:, 2] > STEP_M
    free = seen & (cloud.means[:, 0] < 0.45 * SIZE_M[0])
    assert found.labels[(kind == 1) & free].mean() > 0.95
    beyond = (kind == 2) & seen & (cloud.means[:, 0] > SIZE_M[0] / 2 + 2 * STEP_M)
    assert (found.labels[beyond].sum() < 0.05 * beyond.sum()) == struck


def test_splats_that_are_roughly_known_are_brought_into_the_outlines(room, walk, renderer):
    cloud, kind = room
    rough = in_box(cloud.means.astype(np.float64), 0.03)
    assert rough[kind == HALO].all()
    found = outlined(cloud, rough, viewpoints=walk, renderer=renderer)
    seen = (kind == BOX) & (cloud.means[:, 2] > STEP_M)
    assert found.labels[seen].mean() > 0.95
    assert found.labels[kind == HALO].mean() < 0.1


def test_nothing_labelled_finds_nothing(room, cells, renderer):
    found = found_of(room, cells, renderer, labels=np.zeros(len(cells), dtype=bool))
    assert not found.labels.any()
    assert not len(found.own)


def test_an_object_that_no_photo_shows_stays_as_it_is(room, renderer):
    cloud, kind = room
    away = ViewPoint(
        "away", CAMERA, look_at(np.array([0.0, -1.0, 5.0]), np.array([0.0, -2.0, 9.0]))
    )
    found = outlined(cloud, kind == BOX, viewpoints=[away] * 4, renderer=renderer)
    np.testing.assert_array_equal(found.labels, kind == BOX)


def test_where_nothing_may_be_the_objects_nothing_is_found(room, cells, renderer):
    cloud, _ = room
    none = np.zeros(len(cells), dtype=bool)
    found = separated(
        cloud, cells, labels=in_box(cells.places, 0.01), inside=~none, sure=none,
        within=np.zeros(len(cloud), dtype=bool), renderer=renderer,
    )  # fmt: skip
    assert not found.labels.any()
