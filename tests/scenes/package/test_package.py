import dataclasses
import json
import shutil
import subprocess
import sys

import numpy as np
import pytest

from scenes.cameras import Fisheye, Pinhole
from scenes.formats.ply import WORLD_COMMENT, write_ply
from scenes.formats.registry import write_splats
from scenes.formats.storage.atomic import WriteError
from scenes.formats.storage.error import FormatError
from scenes.frames import WORLD_FROM_FORWARD_CAMERA
from scenes.mesh import BoxPart, CollisionMesh
from scenes.opening import open_scene
from scenes.package import (
    FORMAT_VERSION,
    ScenePackage,
    Stage,
    is_package,
    load_package,
    save_package,
)
from scenes.package.files import PackageError, fingerprint
from scenes.package.records import ViewPoint, pose_from_json, pose_to_json
from scenes.pose import Pose
from scenes.quad import QrCode
from scenes.splats import SplatCloud
from scenes.state import ObjectModel


@pytest.fixture
def package(random_cloud) -> ScenePackage:
    def chair(number):
        return ObjectModel(
            object_id=f"chair-{number}",
            name=f"Chair № {number}",
            kind="chair",
            splats=random_cloud(30, 1, number),
            box_m=(0.4, 0.5, 0.9),
            support_z_m=0.01,
            world_from_object=Pose.from_yaw(0.3 * number, (1.0, -2.0, 0.1 * number)),
            parts=(BoxPart(Pose.from_yaw(0.1, (0.0, 0.1, 0.45)), (0.2, 0.25, 0.45 / number)),),
            guessed_mass_kg=4.5,
        )

    return ScenePackage(
        name="tëst",
        room=random_cloud(100, 2, 9),
        objects=(chair(1), chair(2)),
        codes=(QrCode("GNX-A", 0.16, Pose.from_yaw(1.0, (0, 3, 1.5))),),
        world_from_rig=Pose(WORLD_FROM_FORWARD_CAMERA.rotation, np.array([0.1, 0.2, 1.3])),
        footprint_m=np.array([[-3.0, -2.0], [3.0, 2.0]]),
        physical=None,
        stages=(Stage("bake", "a test", 1.5), Stage("cut")),
        views=(
            ViewPoint("a.jpg", Pinhole(64, 48, 50.5, 51.0, 32.0, 24.0), Pose.from_yaw(0.2)),
            ViewPoint("b.jpg", Fisheye.from_fov(64, 3.5), Pose.from_yaw(1.2, (1, 2, 3))),
        ),
        collision=CollisionMesh(
            np.array([[0, 0, 0.1], [1, 0, 0], [0, 1, 0], [1 / 3, 1, 2]], dtype=np.float32),
            np.array([[0, 1, 2], [1, 3, 2]], dtype=np.int32),
        ),
    )


@pytest.fixture
def saved(package, tmp_path):
    folder = tmp_path / "room.gnx"
    save_package(package, folder)
    return folder


def check_cloud(actual, expected, *, exact=False):
    for name in ("means", "rotations", "sh"):
        np.testing.assert_array_equal(getattr(actual, name), getattr(expected, name))
    for name in ("scales", "opacities"):
        rtol = 0 if exact else 1e-6
        np.testing.assert_allclose(getattr(actual, name), getattr(expected, name), rtol=rtol)


def check_pose(actual, expected):
    np.testing.assert_allclose(actual.matrix(), expected.matrix(), atol=1e-12)


def test_everything_reopens(package, saved):
    back = load_package(saved)
    assert (back.name, back.physical, back.stages) == ("tëst", None, package.stages)
    check_cloud(back.room, package.room)
    check_pose(back.world_from_rig, package.world_from_rig)
    np.testing.assert_array_equal(back.footprint_m, package.footprint_m)
    assert len(back.objects) == 2
    assert [view.name for view in back.views] == ["a.jpg", "b.jpg"]
    for view, wanted in zip(back.views, package.views, strict=True):
        assert view.camera == wanted.camera
        check_pose(view.world_from_camera, wanted.world_from_camera)
    np.testing.assert_array_equal(back.collision.vertices, package.collision.vertices)
    np.testing.assert_array_equal(back.collision.faces, package.collision.faces)
    for ours, theirs in zip(package.objects, back.objects, strict=True):
        assert (ours.object_id, ours.name, ours.kind) == (
            theirs.object_id,
            theirs.name,
            theirs.kind,
        )
        assert (ours.box_m, ours.support_z_m) == (theirs.box_m, theirs.support_z_m)
        check_cloud(theirs.splats, ours.splats)
        check_pose(theirs.world_from_object, ours.world_from_object)
        assert theirs.guessed_mass_kg == ours.guessed_mass_kg
        (part,), (wanted,) = theirs.parts, ours.parts
        assert part.half_size_m == wanted.half_size_m
        check_pose(part.object_from_box, wanted.object_from_box)
    assert [(c.payload, c.side_m) for c in back.codes] == [("GNX-A", 0.16)]
    check_pose(back.codes[0].world_from_code, package.codes[0].world_from_code)


def test_saving_what_was_loaded_changes_no_number(saved, tmp_path):
    once = load_package(saved)
    save_package(once, tmp_path / "again")
    again = load_package(tmp_path / "again")
    check_cloud(again.room, once.room, exact=True)
    check_cloud(again.objects[1].splats, once.objects[1].splats, exact=True)


def test_scene_file_names_units_creator_and_files(saved):
    scene = json.loads((saved / "scene.json").read_text())
    assert (scene["version"], scene["units"], scene["up"]) == (FORMAT_VERSION, "m", "z")
    assert scene["creator"].startswith("gaussiannexus-studio")
    listed = {*scene["files"], "scene.json"}
    assert listed == {p.relative_to(saved).as_posix() for p in saved.rglob("*") if p.is_file()}
    assert "splats/objects/chair-2.ply" in listed
    assert WORLD_COMMENT.encode() in (saved / "splats" / "room.ply").read_bytes()[:200]


def test_a_package_is_replaced_and_a_foreign_folder_is_not(package, saved, tmp_path):
    save_package(package, saved)
    assert is_package(saved)
    foreign = tmp_path / "thesis"
    foreign.mkdir()
    (foreign / "chapter.tex").write_text("years of work")
    with pytest.raises(PackageError, match=r"thesis.*not a scene package"):
        save_package(package, foreign)
    assert [p.name for p in foreign.iterdir()] == ["chapter.tex"]
    (tmp_path / "file").write_text("x")
    with pytest.raises(PackageError, match="not a scene package"):
        save_package(package, tmp_path / "file")
    (tmp_path / "empty").mkdir()
    save_package(package, tmp_path / "empty")
    assert load_package(tmp_path / "empty").name == "tëst"
    names = {p.name for p in tmp_path.iterdir()}
    assert names == {"room.gnx", "thesis", "file", "empty"}


def test_bad_splats_are_not_saved(package, tmp_path):
    room = package.room
    flat = SplatCloud(room.means, room.scales * 0, room.rotations, room.opacities, room.sh)
    bad = ScenePackage("bad", flat, (), (), package.world_from_rig, package.footprint_m, None)
    with pytest.raises(PackageError, match=r"'bad', room: scales.*nothing was saved"):
        save_package(bad, tmp_path / "bad")
    assert not (tmp_path / "bad").exists()


@pytest.mark.parametrize("object_id", ["", "../x", "a/b", "-a", ".", "a b", "x" * 65, "a\n"])
def test_object_ids_must_be_fit_for_file_names(package, random_cloud, object_id):
    item = ObjectModel(object_id, "", "", random_cloud(1), (1, 1, 1), 0.0, Pose.identity())
    with pytest.raises(ValueError, match="object id"):
        ScenePackage(
            "x", package.room, (item,), (), package.world_from_rig, package.footprint_m, None
        )


def test_object_ids_may_not_repeat_even_in_other_case(package, random_cloud):
    items = tuple(
        ObjectModel(i, "", "", random_cloud(1), (1, 1, 1), 0.0, Pose.identity()) for i in ("a", "A")
    )
    with pytest.raises(ValueError, match="twice"):
        ScenePackage(
            "x", package.room, items, (), package.world_from_rig, package.footprint_m, None
        )


def test_footprint_is_checked(package):
    with pytest.raises(ValueError, match="footprint_m"):
        ScenePackage("x", package.room, (), (), package.world_from_rig, np.zeros(4), None)


def test_object_by_id_lists_what_there_is(package):
    assert package.object_by_id("chair-2") is package.objects[1]
    with pytest.raises(KeyError, match="chair-1, chair-2"):
        package.object_by_id("sofa")


def edit(saved, change):
    scene = json.loads((saved / "scene.json").read_text())
    change(scene)
    (saved / "scene.json").write_text(json.dumps(scene))


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda s: s.update(version=FORMAT_VERSION + 1), "newer program.*update"),
        (lambda s: s.update(version="1"), "version '1'"),
        (lambda s: s.update(version=True), "version True"),
        (lambda s: s.update(format="other"), "not a scene package"),
        (lambda s: s.pop("files"), "no list of files"),
        (lambda s: s["files"].pop("splats/room.ply"), "does not list splats/room.ply"),
        (lambda s: s["files"].update({"../evil.ply": {}}), "leads out"),
        (lambda s: s["files"].update({"/etc/passwd": {}}), "leads out"),
        (lambda s: s["files"].update({"a\\b": {}}), "leads out"),
        (lambda s: s["files"].update({"gone.ply": {}}), "gone.ply: missing"),
        (lambda s: s["files"].update({"anchors.json": 3}), "anchors.json"),
        (lambda s: s.pop("name"), "'name' is missing"),
        (lambda s: s.update(footprint_m=[1, 2]), "footprint_m"),
        (lambda s: s.update(footprint_m=[[0, 0], [0, 10**400]]), "footprint_m"),
        (lambda s: s.update(footprint_m=7), "not iterable"),
        (lambda s: s.update(up="y"), "up 'y'"),
        (lambda s: s.update(name=None), "name None"),
        (lambda s: s.update(physical=3), "physical 3"),
        (lambda s: s.update(stages=[{"colour": 1}]), "'seconds' is missing"),
        (lambda s: s["stages"][0].update(seconds=True), "stage seconds"),
        (lambda s: s["files"].pop("splats/objects/chair-1.ply"), "does not list.*chair-1"),
    ],
)
def test_a_bad_scene_file_is_refused_in_one_line(saved, change, said):
    edit(saved, change)
    with pytest.raises(PackageError, match=said) as caught:
        load_package(saved)
    assert "\n" not in str(caught.value)
    assert "room.gnx" in str(caught.value)


def reseal(saved, name, values):
    """Change a JSON file and its size and checksum with it."""
    (saved / name).write_text(json.dumps(values))
    edit(saved, lambda s: s["files"].update({name: fingerprint(saved / name)}))


@pytest.mark.parametrize(
    ("field", "value", "said"),
    [
        ("id", "../x", "object id"),
        ("id", "sofa", "does not list splats/objects/sofa.ply"),
        ("id", 3, "object id"),
        ("id", "chair-2", "twice"),
        ("kind", None, "kind None"),
        ("box_m", [1, 2], "box_m"),
        ("box_m", [1, 2, -1], "box_m"),
        ("box_m", [1, 2, "3"], "box_m"),
        ("support_z_m", 1e300, "support_z_m"),
        ("world_from_object", {"wxyz": [2, 0, 0, 0], "translation_m": [0, 0, 0]}, "norm 2"),
        ("world_from_object", {"wxyz": [1, 0, 0, 0]}, "'translation_m' is missing"),
        ("world_from_object", [1], "indices"),
        ("guessed_mass_kg", 0, "guessed_mass_kg"),
        ("guessed_mass_kg", "4 kg", "guessed_mass_kg"),
        ("parts", {}, "parts"),
        ("parts", [1], "parts"),
        ("parts", [{}], "'half_size_m' is missing"),
        ("parts", [{"half_size_m": [1, 1, 0]}], "half_size_m"),
        ("parts", [{"half_size_m": [1, 1, 1], "object_from_box": 7}], "not subscriptable"),
        ("parts", [{}] * 1001, "at most 1000"),
    ],
)
def test_bad_objects_are_refused_in_one_line(saved, field, value, said):
    values = json.loads((saved / "objects.json").read_text())
    values["items"][0][field] = value
    reseal(saved, "objects.json", values)
    with pytest.raises(PackageError, match=said) as caught:
        load_package(saved)
    assert "\n" not in str(caught.value)
    assert "room.gnx" in str(caught.value)


def test_objects_saved_without_parts_and_mass_still_open(saved):
    values = json.loads((saved / "objects.json").read_text())
    for item in values["items"]:
        del item["parts"], item["guessed_mass_kg"]
    reseal(saved, "objects.json", values)
    for item in load_package(saved).objects:
        assert (item.parts, item.guessed_mass_kg) == ((), None)


def test_every_file_is_protected_by_size_and_checksum(saved):
    originals = [p for p in saved.rglob("*") if p.is_file() and p.name != "scene.json"]
    assert len(originals) == 7
    for path in originals:
        good = path.read_bytes()
        path.write_bytes(good[:-1])
        with pytest.raises(PackageError, match=rf"{path.name}: .*truncated"):
            load_package(saved)
        path.write_bytes(good[:-2] + bytes([good[-2] ^ 1]) + good[-1:])
        with pytest.raises(PackageError, match=rf"{path.name}: checksum"):
            load_package(saved)
        path.unlink()
        with pytest.raises(PackageError, match=rf"{path.name}: missing"):
            load_package(saved)
        path.write_bytes(good)
    assert load_package(saved).name == "tëst"


def test_every_truncation_of_the_scene_file_is_refused(saved):
    good = (saved / "scene.json").read_bytes().rstrip()
    for length in range(0, len(good), 11):
        (saved / "scene.json").write_bytes(good[:length])
        with pytest.raises(PackageError):
            load_package(saved)


@pytest.mark.skipif(sys.platform == "win32", reason="links need rights on Windows")
def test_a_link_out_of_the_folder_is_refused(saved, tmp_path):
    secret = tmp_path / "secret.ply"
    shutil.move(saved / "splats" / "room.ply", secret)
    (saved / "splats" / "room.ply").symlink_to(secret)
    with pytest.raises(PackageError, match="leads out"):
        load_package(saved)


def test_missing_and_foreign_folders_are_named(tmp_path):
    with pytest.raises(PackageError, match="gone: no such"):
        load_package(tmp_path / "gone")
    with pytest.raises(PackageError, match="not a scene package"):
        load_package(tmp_path)
    (tmp_path / "scene.json").write_text("[1]")
    with pytest.raises(PackageError, match="JSON object"):
        load_package(tmp_path)
    assert not is_package(tmp_path)


FULL = """
import resource, sys
from scenes.package import load_package, save_package
package = load_package(sys.argv[1])
resource.setrlimit(resource.RLIMIT_FSIZE, (5_000, 5_000))
try:
    save_package(package, sys.argv[2])
except OSError as error:
    print(error)
"""


@pytest.mark.skipif(sys.platform == "win32", reason="file size limits are a POSIX feature")
def test_a_full_disk_leaves_no_half_package(saved, tmp_path):
    target = tmp_path / "full.gnx"
    done = subprocess.run(
        [sys.executable, "-c", FULL, str(saved), str(target)],
        capture_output=True,
        text=True,
        check=True,
    )
    assert "full.gnx" in done.stdout
    assert "nothing was left behind" in done.stdout
    assert [p.name for p in tmp_path.iterdir()] == ["room.gnx"]


def test_an_unwritable_place_is_one_line(package, tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(WriteError, match="cannot write"):
        save_package(package, tmp_path / "file" / "room")


def test_a_compact_package_is_small_and_opens_nearly_the_same(package, random_cloud, tmp_path):
    # Within what the file can say: colours of real scans stay well inside ±1.
    plain = dataclasses.replace(package, room=random_cloud(4000, 1, 5))
    save_package(plain, tmp_path / "whole.gnx")
    save_package(plain, tmp_path / "small.gnx", compact=True)
    whole, small = (load_package(tmp_path / f"{name}.gnx") for name in ("whole", "small"))
    for a, b in [
        (whole.room, small.room),
        *((x.splats, y.splats) for x, y in zip(whole.objects, small.objects, strict=True)),
    ]:
        np.testing.assert_allclose(b.means, a.means, atol=2.0**-12)
        np.testing.assert_allclose(b.scales, a.scales, rtol=0.04)
        np.testing.assert_allclose(b.opacities, a.opacities, atol=1 / 255)
        same = np.abs((a.rotations * b.rotations).sum(axis=1))
        assert (2 * np.arccos(np.clip(same, 0, 1))).max() < 0.01
    for name in ("anchors.json", "cameras.json", "objects.json", "collision/room.glb"):
        files = [tmp_path / f"{package}.gnx" / name for package in ("whole", "small")]
        assert files[0].read_bytes() == files[1].read_bytes()
    rooms = [tmp_path / "whole.gnx/splats/room.ply", tmp_path / "small.gnx/splats/room.spz"]
    assert rooms[1].stat().st_size < 0.4 * rooms[0].stat().st_size


def test_a_compact_room_is_upright_in_other_programs(package, tmp_path):
    save_package(package, tmp_path / "small.gnx", compact=True)
    opened = open_scene(tmp_path / "small.gnx" / "splats" / "room.spz")
    np.testing.assert_allclose(opened.room.means, package.room.means, atol=2.0**-12)


def test_open_scene_takes_packages_and_splat_files(saved, random_cloud, tmp_path):
    assert open_scene(saved).name == "tëst"
    assert open_scene(str(saved)).name == "tëst"
    cloud = random_cloud(50)
    for suffix in (".ply", ".spz", ".splat"):
        write_splats(tmp_path / f"room{suffix}", cloud)
        opened = open_scene(tmp_path / f"room{suffix}")
        assert (opened.name, opened.objects, opened.codes) == (f"room{suffix}", (), ())
        # Down in the file is down in the world: y of the file is -z of the world.
        np.testing.assert_allclose(opened.room.means[:, 2], -cloud.means[:, 1], atol=2e-4)
        np.testing.assert_allclose(opened.room.means[:, 1], cloud.means[:, 2], atol=2e-4)
        assert (opened.footprint_m[0] < opened.footprint_m[1]).all()


def test_open_scene_leaves_files_in_the_world_frame_as_they_are(random_cloud, tmp_path):
    cloud = random_cloud(50, 2)
    write_ply(tmp_path / "room.ply", cloud, comments=[WORLD_COMMENT])
    opened = open_scene(tmp_path / "room.ply")
    np.testing.assert_array_equal(opened.room.means, cloud.means)
    np.testing.assert_array_equal(opened.room.sh, cloud.sh)


def test_open_scene_says_what_there_is(tmp_path):
    with pytest.raises(PackageError, match=r"kitchen.*built-in are: lab, desk"):
        open_scene("kitchen")
    (tmp_path / "a.ply").write_bytes(b"ply\n")
    with pytest.raises(FormatError, match=r"a\.ply"):
        open_scene(tmp_path / "a.ply")
    with pytest.raises(PackageError, match="not a scene package"):
        open_scene(tmp_path)


def test_poses_read_and_written_again_are_the_same_to_the_byte():
    rng = np.random.default_rng(3)
    turns = [*rng.normal(size=(500, 4)), *np.eye(4), [0, 1, 1, 0], [1, 1, 1, 1], [1e-13, 1, 0, 0]]
    for turn in turns:
        pose = Pose.from_quaternion(np.array(turn) / np.linalg.norm(turn), rng.normal(size=3))
        written = pose_to_json(pose)
        read = pose_from_json(written)
        assert pose_to_json(read) == written
        assert np.allclose(read.matrix(), pose.matrix(), atol=1e-11)
