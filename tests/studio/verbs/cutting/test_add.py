"""An object captured later joins a room on the command line, and leaves it again."""

import hashlib
import json
import math
from dataclasses import replace
from types import SimpleNamespace

import cv2
import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.mesh import PhysicalRoom
from scenes.package import ScenePackage, load_package, save_package
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.align.metric import stated_alignment
from scenes.prepare.reconstruction import Reconstruction, View
from scenes.quad import QrCode
from scenes.render.native import NativeRenderer
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.samples import decor
from scenes.samples.furniture import RoomSet
from scenes.samples.movables import mug
from scenes.samples.pictures import wall_art
from scenes.samples.pictures.atlas import mesh_from_surfaces
from scenes.samples.pictures.textures import parquet
from scenes.samples.shell import Shell, floor_with_rug, shell
from scenes.splats import SplatCloud, concatenate
from sim.phone.phone import PhoneOptions, film
from studio.cli import EXIT_INPUT, EXIT_USAGE, main
from studio.verbs.cutting import add

CAMERA = Pinhole(240, 180, 200.0, 200.0, 120.0, 90.0)
SIZE = np.array([0.3, 0.2, 0.25])


def splats_on(points, colour, spread=0.012):
    n = len(points)
    sh = np.full((n, 1, 3), (np.asarray(colour) - 0.5) / 0.2820948)
    scales = np.full((n, 3), spread)
    scales[:, 2] = 0.002
    return SplatCloud(points, scales, np.tile([1.0, 0, 0, 0], (n, 1)), np.full(n, 0.9), sh)


def floor(rng, reach=1.0):
    return rng.uniform((-reach, -reach, 0), (reach, reach, 0.001), (9000, 3))


def package(name, cloud, views=(), codes=()):
    footprint = np.array([[-1.0, -1], [1, 1]])
    return ScenePackage(name, cloud, (), codes, Pose.identity(), footprint, None, (), views)


@pytest.fixture
def room(tmp_path):
    """The folder of an empty room."""
    cloud = splats_on(floor(np.random.default_rng(2)), (0.6, 0.6, 0.6))
    save_package(package("room", cloud), tmp_path / "room.gnx")
    return tmp_path / "room.gnx"


@pytest.fixture
def photographed(tmp_path, monkeypatch):
    """What preparing photos of a crate gives, without preparing them."""
    rng = np.random.default_rng(1)
    crate = SIZE * rng.uniform((-0.5, -0.5, 0), (0.5, 0.5, 1), (6000, 3))
    side = rng.integers(0, 3, len(crate))
    low = np.array([-0.5, -0.5, 0]) * SIZE
    crate[np.arange(len(crate)), side] = (low + SIZE * rng.integers(0, 2, (len(crate), 3)))[
        np.arange(len(crate)), side
    ]
    ground = floor(rng)
    under = (np.abs(ground[:, :2]) < 0.5 * SIZE[:2]).all(axis=1)
    cloud = concatenate(
        [splats_on(ground[~under], (0.75, 0.7, 0.6)), splats_on(crate, (0.2, 0.3, 0.5), 0.006)]
    )
    views = []
    for k, angle in enumerate(np.linspace(0.2, 6.0, 8)):
        middle = np.array([0, 0, 0.5 * SIZE[2]])
        eye = middle + np.array([0.9 * math.cos(angle), 0.9 * math.sin(angle), 0.55])
        pose = look_at(eye, middle)
        drawn = NativeRenderer().render(
            [PosedSplats(cloud, Pose.identity())], CAMERA, pose, RenderOptions()
        )
        picture = np.round(255 * np.clip(drawn.rgb, 0, 1)).astype(np.uint8)
        cv2.imwrite(str(tmp_path / f"{k}.png"), picture[..., ::-1])
        views.append(View(f"{k}.png", tmp_path / f"{k}.png", CAMERA, pose))
    points = ground[:200].astype(np.float64)
    found = Reconstruction(
        tuple(views), points, np.zeros((200, 3), np.uint8), np.zeros(200, np.float32)
    )
    captured = SimpleNamespace(
        package=package(
            "captured",
            cloud,
            tuple(ViewPoint(v.name, v.camera, v.world_from_camera) for v in views),
        ),
        reconstruction=found,
        alignment=stated_alignment(found, rng=np.random.default_rng(0)),
        sfm=SimpleNamespace(placed=[view.name for view in views]),
        training=SimpleNamespace(psnr_db=31.4, held_out=["7.png"]),
        asked=None,
    )

    def prepare(source, target, *, work, options, renderer):
        captured.asked = options
        return captured

    monkeypatch.setattr(add, "prepare", prepare)
    return captured


@pytest.fixture
def nexus(capsys):
    def call(*words):
        code = main(["cut", *map(str, words)])
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return call


def fingerprint(scene):
    return hashlib.sha256((scene / "splats" / "room.ply").read_bytes()).hexdigest()


def test_it_stands_free_on_the_floor_and_undo_takes_it_away(nexus, room, photographed, tmp_path):
    before = fingerprint(room)
    words = ("--add", tmp_path, "--name", "Blue crate", "--qr-size", 0.1, "--json")
    code, out, _ = nexus(room, *words)
    report = json.loads(out)
    assert (code, report["object"], report["photos"]) == (0, "blue-crate", 8)
    assert report["psnr_db"] == 31.4
    assert report["where"] == "at a free place on the floor"
    item = load_package(room).object_by_id("blue-crate")
    np.testing.assert_allclose(sorted(item.box_m), sorted(SIZE), atol=0.03)
    assert item.world_from_object.translation == pytest.approx([0, 0, 0], abs=0.1)
    assert item.guessed_mass_kg
    assert item.parts
    # Its splats are in its own frame: on the plane it stood on, around the origin.
    assert np.quantile(item.splats.means, 0.01, axis=0)[2] > -0.01
    assert np.abs(np.median(item.splats.means[:, :2], axis=0)).max() < 0.03
    assert fingerprint(room) == before
    code, out, _ = nexus(room, "--undo")
    assert (code, "blue-crate taken away again" in out) == (0, True)
    assert load_package(room).objects == ()
    assert fingerprint(room) == before


def test_it_stands_where_and_how_it_is_told(nexus, room, photographed, tmp_path):
    words = ("--add", tmp_path, "--name", "c", "--qr-size", 0.1)
    assert nexus(room, *words, "--at=-0.4,0.3,0.74", "--yaw", 30)[0] == 0
    there = load_package(room).object_by_id("c").world_from_object
    assert there.translation == pytest.approx([-0.4, 0.3, 0.74])
    assert math.degrees(there.yaw()) == pytest.approx(30)


def test_codes_of_the_room_tell_size_and_place(nexus, room, photographed, tmp_path):
    code = QrCode("wall", 0.2, Pose.identity())
    save_package(replace(load_package(room), codes=(code,)), room)
    photographed.alignment = replace(photographed.alignment, gravity=None)
    done, out, _ = nexus(room, "--add", tmp_path, "--name", "c", "--qr-size", "mine=0.05")
    assert (done, "where it was photographed" in out) == (0, True)
    assert photographed.asked.sides_m == {"wall": 0.2, "mine": 0.05}
    assert [known.payload for known in photographed.asked.known_codes] == ["wall"]


def test_a_mark_goes_before_the_middle(nexus, room, photographed, tmp_path):
    words = ("--add", tmp_path, "--name", "c", "--qr-size", 0.1)
    code, _, err = nexus(room, *words, "--box", "nine.png", 1, 2, 30, 40)
    assert (code, "no photo of that name found its place" in err) == (EXIT_INPUT, True)
    code, _, err = nexus(room, *words, "--box", "3.png", 1, 1, 9, 9)
    assert code == EXIT_INPUT
    assert load_package(room).objects == ()


@pytest.mark.parametrize(
    ("words", "said", "code"),
    [
        (["--name", "c"], "nothing gives the size of the object", EXIT_USAGE),
        (["--name", "c", "--qr-size", "0.1", "--at", "1"], "wanted metres such as", EXIT_USAGE),
        (["--name", "c", "--length", "1"], "belong together", EXIT_USAGE),
        (["--qr-size", "0.1"], "give --name", EXIT_INPUT),
    ],
)
def test_what_is_missing_is_told_before_any_work(
    nexus, room, photographed, tmp_path, words, said, code
):
    got, _, err = nexus(room, "--add", tmp_path, *words)
    assert (got, said in err) == (code, True), err
    assert photographed.asked is None


def test_an_id_that_is_taken_is_told_before_any_work(nexus, room, photographed, tmp_path):
    words = ("--add", tmp_path, "--name", "c", "--qr-size", 0.1)
    assert nexus(room, *words)[0] == 0
    photographed.asked = None
    code, _, err = nexus(room, *words)
    assert (code, "already has an object 'c'" in err) == (EXIT_INPUT, True)
    assert photographed.asked is None


@pytest.mark.slow
@pytest.mark.timeout(1200)
def test_a_mug_filmed_with_a_phone_joins_a_room(nexus, room, tmp_path):
    """From photos to the room with nothing stubbed: a code on the floor tells the size."""
    corner = _corner_with_mug()
    options = PhoneOptions(
        frames=36, width_px=640, height_px=480, path="objects", samples=2, duration_s=40.0
    )
    film(corner, tmp_path / "film", rng=np.random.default_rng(1), options=options)
    words = ("--qr-size", corner.codes[0].side_m, "--quality", "preview", "--steps", 400, "--json")
    code, out, err = nexus(room, "--add", tmp_path / "film" / "images", "--name", "Mug", *words)
    assert code == 0, err
    box_cm = json.loads(out)["box_cm"]
    true_cm = 100 * np.array(corner.objects[0].box_m)
    assert box_cm[2] == pytest.approx(true_cm[2], abs=2.0)
    assert sorted(box_cm[:2]) == pytest.approx(sorted(true_cm[:2]), abs=3.0)


def _corner_with_mug():
    """A rug in a corner room, a mug on it, and a printed code beside the mug."""
    rng = np.random.default_rng(3)
    inside = Shell(np.array([-1.6, -1.6, 0.0]), np.array([1.6, 1.6, 2.4]))
    parts = RoomSet()
    boards = parquet(rng, (196, 158, 114), mm_per_px=2.0)
    laid = floor_with_rug(inside, boards, (-0.9, -0.7), (0.9, 0.7), wall_art.rug, rng)
    shell(parts, inside, rng, floor=laid, walls={"+y": (150, 170, 200)})
    for side in ("+x", "-x", "+y", "-y"):
        art = wall_art.shapes_poster(rng, 334, 334)
        parts.add(*decor.board(inside.wall(side, 0.1, 0.7), (0.9, 0.9), art, edge=(50, 50, 50)))
    card, code = decor.code(Pose.from_yaw(0.4, (0.22, 0.06, 0.0)), "nexus:object", 0.12)
    parts.add(*card)
    light = np.array([-0.5, 0.3, 0.8])
    return PhysicalRoom(
        name="corner",
        static=(mesh_from_surfaces(parts.surfaces, width_px=4096),),
        objects=(mug("mug-1", Pose.from_yaw(math.radians(25), (0.0, 0.0, 0.0))),),
        solids=tuple(parts.solids),
        light_direction=light / np.linalg.norm(light),
        world_from_rig=look_at(np.array([0.0, -1.0, 1.2]), np.array([0.0, 0.0, 1.2])),
        codes=(code,),
        footprint_m=np.array([[-1.6, -1.6], [1.6, 1.6]]),
    )
