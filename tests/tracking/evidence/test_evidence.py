"""Evidence of a window of a filmed table for one object."""

import numpy as np
import pytest

from scenes.pose import Pose
from tracking.evidence.evidence import OUTSIDE_M, gather, layers_in, view_of


def inside(evidence, model, pose):
    """(H, W) pixels within a third of the object's height about its middle."""
    centre = evidence.world_from_camera.inverse() @ model.centre_at(pose)
    (x, y), _ = (part[0] for part in evidence.camera.project(centre[None]))
    rows, columns = np.mgrid[0 : evidence.camera.height_px, 0 : evidence.camera.width_px] + 0.5
    reach = evidence.camera.f_px * 0.3 * min(model.source.box_m) / np.linalg.norm(centre)
    return np.hypot(columns - x, rows - y) < max(reach, 2.0)


@pytest.mark.parametrize("name", ["book-1", "mug-1", "box-1"])
def test_an_object_is_foreground_and_has_its_own_colours(table, as_scanned, name):
    pose = table.poses[name]
    evidence = table.evidence(as_scanned, name, pose)
    here = inside(evidence, table.models[name], pose)
    assert np.median(evidence.foreground[here]) > 0.7
    assert np.median(evidence.own[here]) > 0.3
    assert (evidence.own <= evidence.foreground + 1e-6).all()
    assert evidence.hidden[here].max() == 0.0


def test_where_an_object_was_taken_away_the_empty_room_shows(table, no_mug):
    pose = table.poses["mug-1"]
    evidence = table.evidence(no_mug, "mug-1", pose)
    here = inside(evidence, table.models["mug-1"], pose)
    assert np.median(evidence.foreground[here]) < 0.2
    assert np.median(evidence.own[here]) < 0.1


def test_the_window_shows_the_picture_as_it_is(table, as_scanned):
    evidence = table.evidence(as_scanned, "book-1", table.poses["book-1"])
    view = evidence.view
    assert view.shrink == 1
    image = as_scanned.frame.images[view.lens][view.part] / 255.0
    np.testing.assert_allclose(evidence.live, image, atol=1e-6)
    assert evidence.camera is view.camera
    assert evidence.world_from_camera is view.world_from_camera


def test_a_nearer_neighbour_hides_and_a_farther_one_does_not(table, as_scanned):
    model, pose = table.models["mug-1"], table.poses["mug-1"]
    eye = as_scanned.world_from_rig.translation
    sight = pose.translation - eye
    view = view_of(as_scanned, model, pose)
    hidden = {}
    for name, share in (("nearer", 0.7), ("farther", 1.4)):
        beside = Pose.from_yaw(0.0, eye + share * sight)
        seen = gather(as_scanned, model, view, ((table.models["box-1"], beside),))
        hidden[name] = float(seen.hidden[inside(seen, model, pose)].mean())
        assert len(seen.layers) == 1
    assert hidden["nearer"] > 0.8
    assert hidden["farther"] < 0.05


def test_neighbours_come_farthest_first_and_only_those_in_the_window(table, as_scanned):
    model, pose = table.models["mug-1"], table.poses["mug-1"]
    eye, box = as_scanned.world_from_rig.translation, table.models["box-1"]
    sight = pose.translation - eye

    def at(share, aside=0.0):
        return box, Pose.from_yaw(0.0, eye + share * sight + np.array([aside, 0.0, 0.0]))

    view = view_of(as_scanned, model, pose)
    layers = layers_in(as_scanned, view, (at(0.8), at(1.3), at(1.0, aside=-1.5), at(1.1)))
    ranges = [float(np.median(layer.range_m[layer.alpha > 0.5])) for layer in layers]
    assert len(ranges) == 3
    assert ranges == sorted(ranges, reverse=True)
    assert layers_in(as_scanned, view, ()) == []


def test_the_room_holds_what_is_within_its_walls(as_scanned):
    low, high = as_scanned.bounds_m
    middle, slack = 0.5 * (low + high), np.array([0.9 * OUTSIDE_M, 0.0, 0.0])
    at_wall = np.array([high[0], middle[1], middle[2]])
    assert as_scanned.contains(Pose(np.eye(3), middle))
    assert as_scanned.contains(Pose(np.eye(3), at_wall + slack))
    assert not as_scanned.contains(Pose(np.eye(3), at_wall + 2 * slack))
