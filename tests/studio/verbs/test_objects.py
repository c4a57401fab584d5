"""Objects of a scene, and what photos saw of them, on the command line."""

import json

import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.package import ScenePackage, load_package, save_package
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.splats import SplatCloud
from scenes.state import ObjectModel
from studio.cli import main

SIZE_M = (0.3, 0.2, 0.4)
LENS = Pinhole(240, 180, 200.0, 200.0, 120.0, 90.0)


def splats_at(points, thin):
    scales = np.full((len(points), 3), 0.016)
    scales[np.arange(len(points)), thin] = 0.002
    turns = np.tile([1.0, 0, 0, 0], (len(points), 1))
    return SplatCloud(
        points, scales, turns, np.full(len(points), 0.95), np.zeros((len(points), 1, 3))
    )


@pytest.fixture
def scene(tmp_path):
    """The folder of a scene with a box, seen from +x alone, whose record nobody has measured."""
    rng = np.random.default_rng(1)
    floor = rng.uniform((-2, -2, 0), (2, 2, 0.001), (30000, 3))
    box = rng.uniform((-0.15, -0.1, 0), (0.15, 0.1, 0.4), (3000, 3))
    side = rng.integers(0, 3, len(box))
    ends = np.array([[-0.15, -0.1, 0.0], [0.15, 0.1, 0.4]])
    box[np.arange(len(box)), side] = ends[rng.integers(0, 2, len(box)), side]
    item = ObjectModel("box-1", "Box", "", splats_at(box, side), SIZE_M, 0.0, Pose.identity())
    views = tuple(
        ViewPoint(f"{k}.jpg", LENS, look_at(np.array([1.3, y, 0.8]), np.array([0, 0, 0.2])))
        for k, y in enumerate((-0.2, 0.0, 0.2))
    )
    package = ScenePackage(
        "r", splats_at(floor, np.full(len(floor), 2)), (item,), (), Pose.identity(),
        np.array([[-2.0, -2], [2, 2]]), None, (), views,
    )  # fmt: skip
    save_package(package, tmp_path / "r.gnx")
    return tmp_path / "r.gnx"


@pytest.fixture
def nexus(capsys):
    def call(*words):
        code = main(["objects", *map(str, words)])
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return call


def test_unseen_sides_and_the_photos_that_would_help_are_listed(nexus, scene):
    code, out, err = nexus(scene)
    assert (code, err) == (0, "")
    first, box, sides, photo, *rest = out.splitlines()
    assert first == f"{scene}: 1 objects, 3 photos"
    assert box.startswith("box-1: Box, 30 × 20 × 40 cm, seen from ")
    assert "not from behind" in box
    assert "front 100 %, back 0 %" in sides
    assert photo.startswith("  1. stand ")
    assert "where the floor is free" in photo
    assert len(rest) <= 3
    assert load_package(scene).objects[0].coverage is None


def test_json_says_the_same_and_what_is_kept_is_not_measured_again(nexus, scene, monkeypatch):
    code, out, _ = nexus(scene, "--json", "--keep")
    report = json.loads(out)
    assert (code, report["kept"], report["views"]) == (0, 1, 3)
    (box,) = report["objects"]
    assert box["seen"]["sides_percent"]["back"] == 0.0
    assert box["photos"][0]["eye_m"][0] < 0.5
    monkeypatch.setattr(
        "scenes.prepare.cutout.coverage.in_photos.coverage_of",
        lambda *_, **__: pytest.fail("measured again"),
    )
    _, again, _ = nexus(scene, "--json", "--id", "box-1")
    assert json.loads(again)["objects"] == report["objects"]


def test_a_scene_without_views_says_that_nothing_was_measured(nexus, scene):
    from dataclasses import replace

    save_package(replace(load_package(scene), views=()), scene)
    code, out, _ = nexus(scene)
    assert code == 0
    assert "not measured" in out
    _, out, _ = nexus(scene, "--json")
    assert json.loads(out)["objects"] == [{"object": "box-1", "seen": None}]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--id", "chair"], "no object 'chair'; it has: box-1"),
        (["--keep"], "is no scene package's folder"),
    ],
)
def test_wrong_words_are_one_line(nexus, scene, words, said):
    code, out, err = nexus("desk" if "--keep" in words else scene, *words)
    assert (code, out) == (3, "")
    assert said in err
    assert len(err.splitlines()) == 1
