"""A grey crate on a floor, cut out and put back on the command line."""

import hashlib
import json
from dataclasses import replace

import cv2
import numpy as np
import pytest

from scenes.package import load_package, save_package
from studio.cli import main
from tests.crate_room import (
    CAMERA,
    HIGH,
    LOW,
    boxes_around_crate,
    joined,
    save_crate_room,
    splats_on,
)


@pytest.fixture
def scene(tmp_path):
    """The folder of a scene with one crate and three views of it."""
    return save_crate_room(tmp_path)


@pytest.fixture
def nexus(capsys):
    def call(*words):
        code = main(["cut", *map(str, words)])
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return call


def boxes(scene, pad_px=5.0):
    """--box of every view, around the crate's corners."""
    words = []
    for name, low, high in boxes_around_crate(scene, pad_px):
        words += ["--box", name, *(f"{edge:.1f}" for edge in (*low, *high))]
    return words


def fingerprint(scene):
    return hashlib.sha256((scene / "splats" / "room.ply").read_bytes()).hexdigest()


def test_cut_preview_and_undo(nexus, scene, tmp_path):
    before = fingerprint(scene)
    marks = boxes(scene)
    code, out, err = nexus(
        scene,
        "--name",
        "Blue crate",
        "--kind",
        "crate",
        *marks,
        "--preview",
        tmp_path / "p",
        "--json",
    )
    assert (code, err) == (0, "")
    report = json.loads(out)
    assert report["object"] == "blue-crate"
    assert all(view["used"] for view in report["views"])
    package = load_package(scene)
    item = package.object_by_id("blue-crate")
    assert (item.name, item.kind) == ("Blue crate", "crate")
    assert 0.95 * 1800 < len(item.splats) < 1.05 * 1800
    np.testing.assert_allclose(sorted(item.box_m), [0.2, 0.25, 0.3], atol=0.02)
    solid = sum(8 * np.prod(part.half_size_m) for part in item.parts)
    assert solid == pytest.approx(np.prod(item.box_m), rel=0.1)
    assert item.coverage is not None
    assert report["seen"]["sides_percent"]["top"] == 100.0
    assert report["seen_words"].startswith("seen from ")
    assert item.guessed_mass_kg is not None
    assert 1 < item.guessed_mass_kg < 15
    picture = cv2.imread(str(tmp_path / "p" / "0.png"))
    assert picture.shape == (180, 240, 3)
    assert len(list((tmp_path / "p").iterdir())) == 3

    code, out, _ = nexus(scene, "--undo")
    assert (code, fingerprint(scene)) == (0, before)
    assert "blue-crate put back" in out
    assert load_package(scene).objects == ()


def test_photos_are_looked_at_if_given(nexus, scene, tmp_path):
    photos = tmp_path / "photos"
    photos.mkdir()
    code, _, err = nexus(scene, "--name", "crate", *boxes(scene), "--photos", photos)
    assert code == 3
    assert "0.png: not a picture that can be read" in err
    for view in range(3):
        cv2.imwrite(str(photos / f"{view}.png"), np.zeros((50, 60, 3), np.uint8))
    code, _, err = nexus(scene, "--name", "crate", *boxes(scene), "--photos", photos)
    assert (code, "60×50 px, but its camera has 240×180" in err) == (3, True)


def photographed(scene, folder, size):
    """The folder of the views' photos as a person has them: of another size, not of the splats."""
    folder.mkdir()
    for view in load_package(scene).views:
        corners = np.array(np.meshgrid(*np.stack([LOW, HIGH], axis=1))).reshape(3, -1).T
        pixels, _ = view.camera.project(view.world_from_camera.inverse() @ corners)
        pixels *= np.array(size) / (CAMERA.width_px, CAMERA.height_px)
        photo = np.full((size[1], size[0], 3), (140, 170, 190), np.uint8)
        hull = cv2.convexHull(pixels.astype(np.float32)).round().astype(np.int32)
        cv2.fillConvexPoly(photo, hull, (130, 70, 40))
        cv2.imwrite(str(folder / view.name), photo)
    return folder


@pytest.mark.parametrize("size", [(241, 181), (239, 180), (480, 360), (601, 450)])
def test_own_photos_may_be_of_the_size_they_were_taken_in(nexus, scene, tmp_path, size):
    """The preparation shrinks photos and crops what the lens bends; marks are in the photos."""
    photos = photographed(scene, tmp_path / "photos", size)
    ratio = np.array([*size, *size]) / (240, 180, 240, 180)
    words = boxes(scene)
    for start in range(2, len(words), 6):
        edges = np.array(words[start : start + 4], dtype=float) * ratio
        words[start : start + 4] = [f"{edge:.1f}" for edge in edges]
    code, out, err = nexus(scene, "--name", "crate", *words, "--photos", photos, "--json")
    assert (code, err) == (0, "")
    assert all(view["used"] for view in json.loads(out)["views"])
    item = load_package(scene).object_by_id("crate")
    assert 0.95 * 1800 < len(item.splats) < 1.05 * 1800
    np.testing.assert_allclose(sorted(item.box_m), [0.2, 0.25, 0.3], atol=0.02)


def test_a_photo_on_its_side_is_refused(nexus, scene, tmp_path):
    photos = photographed(scene, tmp_path / "photos", (180, 240))
    code, _, err = nexus(scene, "--name", "crate", *boxes(scene), "--photos", photos)
    assert code == 3
    assert "180×240 px, but its camera has 240×180" in err
    assert "whole and upright" in err


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--name", "a"], "nothing is marked"),
        (["--box", "0.png", "1", "2", "30", "40"], "give --name"),
        (
            ["--name", "a", "--box", "9.png", "1", "2", "30", "40"],
            "no view '9.png'; it has 3: 0.png",
        ),
        (["--name", "a", "--box", "0.png", "1", "2", "x", "40"], "are not pixels"),
        (["--name", "a", "--box", "0.png", "30", "2", "1", "40"], "left < right"),
        (["--name", "a", "--click", "0.png", "30"], "wanted X Y of each point"),
        (["--name", "a", "--box", "0.png", "1", "1", "12", "12"], "there is no object"),
        (
            ["--name", "a", "--box", "0.png", "1", "2", "30", "40", "--masks-model", "no.onnx"],
            "no.onnx: which file is its decoder?",
        ),
        (
            ["--name", "a", "--box", "0.png", "1", "2", "3", "4", "--masks-model", "encoder.onnx"],
            "encoder.onnx: no such file",
        ),
        (["--name", "a", "--propose", "--accept", "7"], "--accept 7: there are 1 proposals"),
        (["--undo"], "there is no cut to undo"),
    ],
)
def test_what_does_not_fit_is_refused_and_nothing_changes(nexus, scene, words, message):
    before = fingerprint(scene)
    code, out, err = nexus(scene, *words)
    assert (code, out, message in err) == (3, "", True), err
    assert fingerprint(scene) == before


def test_views_are_listed(nexus, scene):
    assert nexus(scene, "--views") == (0, "0.png\n1.png\n2.png\n", "")


def test_a_proposal_is_accepted_with_one_word(nexus, scene):
    before = fingerprint(scene)
    code, out, _ = nexus(scene, "--propose", "--json")
    (proposal,) = json.loads(out)["proposals"]
    np.testing.assert_allclose(sorted(proposal["box_cm"]), [20, 25, 30], atol=2)
    np.testing.assert_allclose(proposal["place_m"], [0, 0, 0], atol=0.02)
    assert (code, fingerprint(scene)) == (0, before)
    code, _, _ = nexus(scene, "--propose", "--accept", 1, "--name", "crate")
    assert code == 0
    assert len(load_package(scene).object_by_id("crate").splats) > 0.95 * 1800
    nexus(scene, "--undo")
    assert fingerprint(scene) == before


def test_floaters_go_and_come_back(nexus, scene):
    package = load_package(scene)
    strays = splats_on(np.array([[0.5, 0.5, 0.9], [-0.5, 0.4, 1.2]]), (0.5, 0.5, 0.5))
    save_package(replace(package, room=joined(package.room, strays)), scene)
    before = fingerprint(scene)
    code, out, _ = nexus(scene, "--floaters")
    assert (code, "2 stray splats removed" in out) == (0, True)
    assert len(load_package(scene).room) == len(package.room)
    assert nexus(scene, "--undo")[0] == 0
    assert fingerprint(scene) == before
