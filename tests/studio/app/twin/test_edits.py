"""Every edit keeps ids unique, leaves the document it was made of, and goes through a file."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from scenes.pose import Pose, wrap_angle
from studio.app.model.documents.document import Document
from studio.app.model.documents.document_file import document_from_text, document_to_text
from studio.app.twin import additions, edits
from studio.app.twin.edits import EditError, ItemKind

SCANNED = {
    "chair-1": Pose.from_yaw(0.3, (1.0, 0.5, 0.0)),
    "book-1": Pose.from_yaw(-1.0, (0.0, 0.2, 0.72)),
}
BOARD = np.array([[0.0, 2.0, 1.8], [1.0, 2.0, 1.8], [1.0, 2.0, 1.1], [0.0, 2.0, 1.1]])
EMPTY = Document("desk")
numbers = st.floats(-5.0, 5.0)
places = st.tuples(numbers, numbers, numbers)
sides = st.floats(0.02, 3.0)


def ids(document):
    """All ids with repetition across kinds, objects of the scan included."""
    twin = document.twin
    tables = (twin.primitives, twin.avatars, twin.cameras, twin.surfaces, twin.annotations)
    return [*SCANNED, *(key for table in tables for key in table)]


def an_edit(draw, document):
    """Any edit with any good numbers, applied."""
    place = draw(places)
    kind = draw(st.integers(0, 9))
    someone = draw(st.sampled_from(sorted(ids(document))))
    if kind == 0:
        shape, size = draw(st.sampled_from(additions.SHAPES)), draw(st.tuples(sides, sides, sides))
        return additions.primitive_added(document, SCANNED, shape=shape, place=place, size_m=size)[
            0
        ]
    if kind == 1:
        role, facing = draw(st.sampled_from(additions.ROLES)), draw(st.floats(-4, 4))
        return additions.avatar_added(document, SCANNED, place=place, facing_rad=facing, role=role)[
            0
        ]
    if kind == 2:
        return additions.camera_added(document, SCANNED, place=place, looks_at=(9.0, 9.0, 1.0))[0]
    if kind == 3:
        return additions.surface_added(document, SCANNED, BOARD + np.array(place))[0]
    if kind == 4:
        line = np.array([place, np.array(place) + 0.5])
        return additions.annotated(document, SCANNED, line)[0]
    if kind == 5:
        return edits.renamed(document, SCANNED, someone, draw(st.text(max_size=9)))
    if kind == 6:
        return edits.moved(document, SCANNED, someone, place)
    is_object = someone in SCANNED
    if kind == 7 and is_object:
        return edits.reset(document, SCANNED, someone)
    if kind == 8 and not is_object:
        return edits.removed(document, SCANNED, someone)
    if edits.kind_of(document, SCANNED, someone) in edits.TURNABLE:
        return edits.turned(document, SCANNED, someone, draw(st.floats(-4, 4)))
    return document


@settings(max_examples=60, deadline=None)
@given(st.data())
def test_any_edits_keep_ids_unique_and_go_through_a_file(data):
    document = EMPTY
    for _ in range(data.draw(st.integers(1, 12))):
        text = document_to_text(document)
        after = an_edit(data.draw, document)
        assert document_to_text(document) == text  # undo shows the value before, which is unchanged
        assert len(set(ids(after))) == len(ids(after))
        again = document_from_text(document_to_text(after), source="test")
        assert document_to_text(again) == document_to_text(after)
        document = after


@given(places, st.floats(-10, 10))
def test_moved_and_turned_is_where_it_was_put(place, angle):
    document = edits.moved(EMPTY, SCANNED, "chair-1", place)
    document = edits.turned(document, SCANNED, "chair-1", angle)
    pose = edits.pose_of(document, SCANNED, "chair-1")
    assert np.abs(pose.translation - place).max() < 1e-9
    assert abs(wrap_angle(pose.yaw() - angle)) < 1e-9
    assert (
        edits.pose_of(edits.reset(document, SCANNED, "chair-1"), SCANNED, "chair-1")
        is (SCANNED["chair-1"])
    )


@given(
    places,
    st.sampled_from(sorted(edits.TILTABLE, key=str)),
    st.tuples(st.floats(-180, 180), st.floats(-180, 180), st.sampled_from([-90, -40, 0, 7, 90])),
)
def test_an_item_stands_as_its_numbers_say_and_they_say_how_it_stands(place, kind, angles):
    pose = edits.Stance(place, *angles).pose(kind)
    again = edits.Stance.of(kind, pose)
    assert again.pose(kind).matrix() == pytest.approx(pose.matrix(), abs=4e-4)
    assert edits.Stance.of(kind, again.pose(kind)).pose(kind).matrix() == pytest.approx(
        again.pose(kind).matrix(), abs=1e-9
    ), "numbers that were read put it there again exactly"


def test_a_camera_that_is_put_by_numbers_looks_where_its_heading_says():
    document, camera = additions.camera_added(EMPTY, SCANNED, place=(0, 0, 1), looks_at=(1, 0, 1))
    stance = edits.Stance((1.0, 2.0, 1.5), yaw_deg=90.0, tilt_y_deg=-30.0)
    document = edits.placed(document, SCANNED, camera, stance)
    ahead = document.twin.cameras[camera].rotation[:, 2]
    assert ahead == pytest.approx((0.0, math.cos(math.pi / 6), 0.5)), "a negative y looks up"
    pose = document.twin.cameras[camera]
    assert edits.Stance.of(ItemKind.CAMERA, pose) == stance
    assert edits.Stance.of(
        ItemKind.CAMERA, edits.turned(document, SCANNED, camera, 0.0).twin.cameras[camera]
    ) == replace(stance, yaw_deg=0.0)


def test_a_persons_hands_go_along():
    document, ann = additions.avatar_added(EMPTY, SCANNED, place=(0, 0, 0), facing_rad=0.0)
    person = document.twin.avatars[ann]
    assert person.world_from_head.translation == pytest.approx((0, 0, additions.EYE_HEIGHT_M))
    assert person.hands[0][0] == pytest.approx((0.25, 0.22, additions.EYE_HEIGHT_M - 0.55))
    document = edits.turned(document, SCANNED, ann, math.pi / 2)
    document = edits.moved(document, SCANNED, ann, (1.0, 0.0, 1.6))
    person = document.twin.avatars[ann]
    assert edits.heading_rad(ItemKind.AVATAR, person.world_from_head) == pytest.approx(math.pi / 2)
    assert person.hands[0][0] == pytest.approx((1.0 - 0.22, 0.25, 1.05))


def test_a_camera_that_looks_down_can_still_be_turned():
    document, camera = additions.camera_added(EMPTY, SCANNED, place=(0, 0, 2), looks_at=(0, 0, 0))
    for angle in (0.4, -2.0):
        document = edits.turned(document, SCANNED, camera, angle)
        pose = document.twin.cameras[camera]
        assert edits.heading_rad(ItemKind.CAMERA, pose) == pytest.approx(angle)
        assert pose.rotation[:, 2] == pytest.approx((0, 0, -1))


def test_a_resized_primitive_stands_where_it_stood():
    document, ball = additions.primitive_added(EMPTY, SCANNED, shape="ball", place=(1, 2, 0))
    document = additions.primitive_resized(document, ball, (0.5, 0.1, 0.2))
    item = document.twin.primitives[ball]
    assert item.size_m == (0.5, 0.5, 0.5)
    assert item.world_from_primitive.translation == pytest.approx((1, 2, 0))


def test_numbers_of_removed_items_are_used_again_only_when_free():
    document, first = additions.primitive_added(EMPTY, SCANNED, shape="box", place=(0, 0, 0))
    document, second = additions.primitive_added(document, SCANNED, shape="box", place=(1, 0, 0))
    document = edits.removed(document, SCANNED, first)
    document, third = additions.primitive_added(document, SCANNED, shape="box", place=(2, 0, 0))
    assert (first, second, third) == ("box-1", "box-2", "box-1")


@given(st.permutations(range(4)), st.floats(0.5, 3.0), st.floats(-1.0, 2.0))
def test_picks_in_any_order_make_an_upright_surface(order, distance, aside):
    eye = np.array([aside, 2.0 - distance, 1.5])
    document, surface = additions.surface_added(EMPTY, SCANNED, BOARD[list(order)], eye=eye)
    assert np.array_equal(document.twin.surfaces[surface].corners_in_world, BOARD)
    assert document.twin.surfaces[surface].size_px == (640, 448)


def test_a_dragged_corner_keeps_the_others():
    document, board = additions.surface_added(EMPTY, SCANNED, BOARD)
    document = additions.corner_dragged(document, board, 1, (1.2, 2.0, 1.9))
    corners = document.twin.surfaces[board].corners_in_world
    assert corners[1] == pytest.approx((1.2, 2.0, 1.9))
    assert np.array_equal(corners[[0, 2, 3]], BOARD[[0, 2, 3]])
    with pytest.raises(EditError, match="surface-1"):
        additions.corner_dragged(document, board, 1, (0.1, 2.0, 1.2))  # no longer convex
    with pytest.raises(EditError, match="corner 4"):
        additions.corner_dragged(document, board, 4, (0, 0, 0))


def test_a_line_drawn_in_the_view_lies_on_what_it_meets():
    eye = np.array([0.0, 0.0, 1.0])

    def wall(origin, ray):
        """A wall at y = 2 that ends at x = 1."""
        point = origin + ray * 2.0 / ray[1]
        return point if point[0] < 1.0 else None

    directions = np.array([[x, 2.0, 0.0] for x in (0.0, 0.5, 0.9, 1.4)])
    points = additions.projected(eye, directions, wall)
    assert points[:3, 1] == pytest.approx(2.0)
    assert np.linalg.norm(points[3] - eye) == pytest.approx(np.linalg.norm(points[2] - eye))
    document, note = additions.annotated(EMPTY, SCANNED, points)
    assert len(document.twin.annotations[note].points_in_world) == 4
    with pytest.raises(EditError, match="meets nothing"):
        additions.projected(eye, directions, lambda _eye, _ray: None)


def _with_person():
    document, ann = additions.avatar_added(EMPTY, SCANNED, place=(0, 0, 0))
    return document, SCANNED, ann


BAD = {
    "unknown id": lambda: edits.moved(EMPTY, SCANNED, "piano", (0, 0, 0)),
    "unknown to rename": lambda: edits.renamed(EMPTY, SCANNED, "piano", "Piano"),
    "no number": lambda: edits.moved(EMPTY, SCANNED, "chair-1", (0, math.nan, 0)),
    "no place": lambda: edits.moved(EMPTY, SCANNED, "chair-1", "there"),
    "too far": lambda: edits.moved(EMPTY, SCANNED, "chair-1", (0, 0, 1e6)),
    "no angle": lambda: edits.turned(EMPTY, SCANNED, "chair-1", math.inf),
    "tilt that is none": lambda: edits.tilted(EMPTY, SCANNED, "chair-1", math.nan, 0.0),
    "tilted person": lambda: edits.tilted(*_with_person(), x_deg=0.0, y_deg=10.0),
    "object removed": lambda: edits.removed(EMPTY, SCANNED, "chair-1"),
    "shape": lambda: additions.primitive_added(EMPTY, SCANNED, shape="cone", place=(0, 0, 0)),
    "flat": lambda: additions.primitive_added(
        EMPTY, SCANNED, shape="box", place=(0, 0, 0), size_m=(1, 1, 0)
    ),
    "two sides": lambda: additions.primitive_added(
        EMPTY, SCANNED, shape="box", place=(0, 0, 0), size_m=(1, 1)
    ),
    "not there": lambda: additions.primitive_resized(EMPTY, "box-1", (1, 1, 1)),
    "role": lambda: additions.avatar_added(EMPTY, SCANNED, place=(0, 0, 0), role="ghost"),
    "looks at itself": lambda: additions.camera_added(
        EMPTY, SCANNED, place=(1, 1, 1), looks_at=(1, 1, 1)
    ),
    "three picks": lambda: additions.surface_added(EMPTY, SCANNED, BOARD[:3]),
    "no area": lambda: additions.surface_added(EMPTY, SCANNED, np.zeros((4, 3))),
    "no points": lambda: additions.annotated(EMPTY, SCANNED, []),
    "no line": lambda: additions.annotated(EMPTY, SCANNED, [(0, 0, 0), (0, 0, 0.001)]),
    "too long": lambda: additions.annotated(
        EMPTY, SCANNED, np.arange(9000.0).reshape(-1, 3) / 9000 * [[100, 1, 1]]
    ),
}


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_done_is_refused_in_words(name):
    with pytest.raises(EditError, match=r"wanted|there|limit|drag|draw|scan|stands"):
        BAD[name]()


def test_points_have_no_heading_to_turn():
    document, board = additions.surface_added(EMPTY, SCANNED, BOARD)
    with pytest.raises(EditError, match="made of points"):
        edits.turned(document, SCANNED, board, 1.0)
    with pytest.raises(EditError, match="made of points"):
        edits.placed(document, SCANNED, board, edits.Stance((0, 0, 0), yaw_deg=20.0))
    with pytest.raises(EditError, match="not in the scan"):
        edits.reset(document, SCANNED, board)
    moved = edits.moved(document, SCANNED, board, BOARD.mean(axis=0) + np.array([0, 0, 0.1]))
    corners = moved.twin.surfaces[board].corners_in_world
    assert np.abs(corners - BOARD - np.array([0, 0, 0.1])).max() < 1e-12


def test_names_are_shown_and_given_back():
    document = edits.renamed(EMPTY, SCANNED, "book-1", "  The red\n book ")
    assert edits.name_of(document, "book-1") == "The red book"
    assert (
        edits.name_of(edits.renamed(document, SCANNED, "book-1", " "), "book-1", "Book") == "Book"
    )
