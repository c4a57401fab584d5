"""`nexus cut` with marks that hold nothing, half, two or a moved object, on a small prepared room.

Each gives one line that says what is wrong and where, and undoing restores every file to the byte.
"""

import hashlib
import json
from dataclasses import replace

import numpy as np
import pytest

from scenes.frames import look_at
from scenes.package import save_package
from scenes.package.records import ViewPoint
from studio.cli import main
from tests.small_captures import small_capture

FIRST, SECOND = 5, 22
"""Photos from the left and the right."""


@pytest.fixture(scope="module")
def desk(tmp_path_factory):
    """The capture of a book and a mug on a desk."""
    return small_capture("desk", tmp_path_factory.mktemp("photos"))


@pytest.fixture
def scene(desk, tmp_path):
    folder = tmp_path / "desk.gnx"
    save_package(desk.package, folder)
    return folder


@pytest.fixture
def cut(desk, scene, capsys):
    """Cuts, and gives the exit code, what JSON says, and the error."""

    def call(*marks):
        words = [str(word) for mark in marks for word in mark]
        code = main(
            ["cut", str(scene), "--name", "cup", "--photos", str(desk.folder), "--json", *words]
        )
        printed = capsys.readouterr()
        return code, json.loads(printed.out) if printed.out else {}, printed.err

    return call


def fingerprint(scene):
    files = sorted(path for path in scene.rglob("*") if path.is_file())
    return {str(path): hashlib.sha256(path.read_bytes()).hexdigest() for path in files}


def around(view, points, *, keep=(0.0, 0.0, 1.0, 1.0)):
    """A box around points in a view, or that share of it: left, top, right, bottom."""
    pixels, _ = view.camera.project(view.world_from_camera.inverse() @ points)
    low = np.clip(pixels.min(axis=0) - 5, 0, None)
    size = pixels.max(axis=0) + 5 - low
    box = [*(low + size * keep[:2]), *(low + size * keep[2:])]
    return ["--box", view.name, *(f"{edge:.1f}" for edge in box)]


def points_of(desk, *names):
    return np.concatenate(
        [o.triangles.reshape(-1, 3) for o in desk.objects if o.object_id in names]
    )


def test_a_box_with_no_object(cut, scene, desk):
    before = fingerprint(scene)
    names = [desk.photos[number].name for number in (FIRST, 20)]
    code, _, error = cut(*(["--box", name, 60, 150, 110, 190] for name in names))
    assert (code, "there is no object" in error, error.count("\n")) == (3, True, 1), error
    assert names[0] in error
    assert fingerprint(scene) == before


def test_a_box_with_two_objects(cut, scene, desk):
    before = fingerprint(scene)
    both = points_of(desk, "book", "mug")
    code, report, _ = cut(around(desk.photos[FIRST], both))
    assert code == 0
    (note,) = (note for note in report["notes"] if "something else" in note)
    x, y = (float(word) for word in note.split("around ")[1].split(" px")[0].split(", "))
    pixels, _ = desk.photos[FIRST].camera.project(
        desk.photos[FIRST].world_from_camera.inverse() @ points_of(desk, "mug")
    )
    assert (pixels.min(axis=0) - 5 < (x, y)).all()
    assert (pixels.max(axis=0) + 5 > (x, y)).all()
    assert main(["cut", str(scene), "--undo"]) == 0
    assert fingerprint(scene) == before


def test_a_box_with_half_of_an_object(cut, scene, desk):
    before = fingerprint(scene)
    book = points_of(desk, "book")
    half = [around(desk.photos[k], book, keep=(0, 0, 0.5, 1)) for k in (FIRST, SECOND)]
    code, report, error = cut(*half)
    said = error or " ".join(report["notes"])
    assert f"goes on beyond the right edge of the box in {desk.photos[FIRST].name}" in said
    if not code:
        assert main(["cut", str(scene), "--undo"]) == 0
    assert fingerprint(scene) == before


def test_an_object_that_moved_between_photos(cut, scene, desk):
    before = fingerprint(scene)
    mug = points_of(desk, "mug")
    moved = mug + np.array([0.0, -0.3, 0.0])
    code, _, error = cut(around(desk.photos[FIRST], mug), around(desk.photos[SECOND], moved))
    assert (code, error.count("\n")) == (3, 1)
    assert "are around different places, 0.3" in error
    assert "if it was moved between these photos" in error
    assert fingerprint(scene) == before


def test_an_object_that_one_photo_shows(cut, scene, desk):
    view = desk.photos[FIRST]
    eye = view.world_from_camera.translation
    away = [
        ViewPoint(f"away-{k}.jpg", view.camera, look_at(eye, eye + np.array([1.0, 0.3 * k, 0.2])))
        for k in range(4)
    ]
    seeing = ViewPoint(view.name, view.camera, view.world_from_camera)
    save_package(replace(desk.package, views=(seeing, *away)), scene)
    before = fingerprint(scene)
    code, report, _ = cut(around(view, points_of(desk, "mug")))
    assert code == 0
    assert any(note.startswith("only one photo shows it") for note in report["notes"])
    assert main(["cut", str(scene), "--undo"]) == 0
    assert fingerprint(scene) == before


def test_an_object_that_no_photo_shows(cut, scene, desk):
    before = fingerprint(scene)
    code, _, error = cut(["--box", desk.photos[FIRST].name, 900, 900, 950, 950])
    assert (code, "leaves nothing of the 400×300 px picture" in error) == (3, True), error
    code, _, error = cut(["--box", "elsewhere.jpg", 10, 10, 60, 60])
    assert (code, "no view 'elsewhere.jpg'" in error) == (3, True), error
    assert fingerprint(scene) == before


def test_a_well_marked_object_gives_no_note(cut, scene, desk):
    before = fingerprint(scene)
    mug = points_of(desk, "mug")
    code, report, _ = cut(around(desk.photos[FIRST], mug), around(desk.photos[SECOND], mug))
    assert (code, report["notes"]) == (0, [])
    assert main(["cut", str(scene), "--undo"]) == 0
    assert fingerprint(scene) == before
