"""An object from elsewhere joins a room and leaves it again without a trace."""

from dataclasses import fields, replace

import numpy as np
import pytest

from scenes.mesh import BoxPart
from scenes.package import ScenePackage, load_package, save_package
from scenes.package.records import Stage
from scenes.pose import Pose
from scenes.prepare.cutout.cutout import undo_cut
from scenes.prepare.cutout.object.added import add_object
from scenes.splats import SplatCloud
from scenes.state import ObjectModel


def splats(n, seed=0):
    rng = np.random.default_rng(seed)
    rotations = rng.normal(size=(n, 4)).astype(np.float32)
    rotations /= np.linalg.norm(rotations, axis=1, keepdims=True)
    return SplatCloud(
        rng.normal(size=(n, 3)).astype(np.float32),
        rng.uniform(0.01, 0.05, (n, 3)).astype(np.float32),
        rotations,
        rng.uniform(0.1, 0.9, n).astype(np.float32),
        rng.normal(size=(n, 4, 3)).astype(np.float32),
    )


@pytest.fixture
def room(tmp_path):
    """As it is opened: values that a file holds come back to the bit."""
    package = ScenePackage(
        "room", splats(40), (), (), Pose.identity(), np.array([[-2.0, -2], [2, 2]]), None,
        (Stage("training", "", 1.0),),
    )  # fmt: skip
    save_package(package, tmp_path / "made.gnx")
    return load_package(tmp_path / "made.gnx")


@pytest.fixture
def vase():
    part = BoxPart(Pose.from_yaw(0.0, (0.0, 0.0, 0.1)), (0.05, 0.05, 0.1))
    return ObjectModel(
        "vase-1", "Vase", "", splats(12, 1), (0.1, 0.1, 0.2), 0.3, Pose.identity(), (part,), 0.7
    )


def same(a, b):
    return all(np.array_equal(getattr(a, f.name), getattr(b, f.name)) for f in fields(SplatCloud))


def test_it_stands_where_it_is_put_and_the_room_is_as_it_was(room, vase, tmp_path):
    there = Pose.from_yaw(0.4, (0.5, -0.3, 0.74))
    save_package(add_object(room, vase, there, detail="12 photos"), tmp_path / "r.gnx")
    after = load_package(tmp_path / "r.gnx")
    item = after.object_by_id("vase-1")
    assert np.allclose(item.world_from_object.matrix(), there.matrix(), atol=1e-12)
    assert item.support_z_m == pytest.approx(0.74)
    assert same(after.room, room.room)
    assert (item.guessed_mass_kg, len(item.parts)) == (0.7, 1)
    assert after.stages[-1] == Stage("add vase-1", "12 photos")


def test_undo_takes_it_away_after_saving_too(room, vase, tmp_path):
    save_package(add_object(room, vase, Pose.identity(), detail=""), tmp_path / "r.gnx")
    before = undo_cut(load_package(tmp_path / "r.gnx"))
    assert before.objects == ()
    assert before.cuts == ()
    assert before.stages == room.stages
    assert same(before.room, room.room)


def test_of_two_the_last_goes_first(room, vase):
    one = add_object(room, vase, Pose.identity(), detail="")
    two = add_object(one, replace(vase, object_id="vase-2"), Pose.identity(), detail="")
    assert [item.object_id for item in undo_cut(two).objects] == ["vase-1"]


def test_an_id_that_is_taken_is_refused(room, vase):
    one = add_object(room, vase, Pose.identity(), detail="")
    with pytest.raises(ValueError, match="already has an object 'vase-1'"):
        add_object(one, vase, Pose.identity(), detail="")
