"""`nexus refine`: an object of a prepared room sharpened and put back on the command line."""

import json
import shutil

import cv2
import numpy as np
import pytest

from scenes.cameras import Pinhole
from scenes.frames import look_at
from scenes.package import ScenePackage, load_package, save_package
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.pipeline import POINTS_FOLDER
from scenes.prepare.reconstruction import Reconstruction, View, save_reconstruction
from scenes.render.native import NativeRenderer
from scenes.render.reduction import merged
from scenes.render.renderer import PosedSplats, RenderOptions
from scenes.splats import SplatCloud
from studio.cli import main

CAMERA = Pinhole.from_fov(96, 72, 0.9)


@pytest.fixture(scope="module")
def prepared(tmp_path_factory):
    """A striped floor that was photographed and prepared, coarsely, and nothing cut out of it."""
    folder = tmp_path_factory.mktemp("floor")
    rng = np.random.default_rng(5)
    means = rng.uniform((-1, -1, 0), (1, 1, 0.002), (3000, 3))
    sh = 1.2 * np.sin(9 * means[:, :1, None] + np.array([0.0, 1.0, 2.0]))
    fine = SplatCloud(
        means,
        np.tile([0.04, 0.04, 0.002], (3000, 1)),
        np.tile([1.0, 0, 0, 0], (3000, 1)),
        np.full(3000, 0.95),
        sh.astype(np.float32),
    )
    views = []
    for k in range(6):
        turn = k * np.pi / 3
        pose = look_at(np.array([1.5 * np.cos(turn), 1.5 * np.sin(turn), 1.4]), np.zeros(3))
        posed = [PosedSplats(fine, Pose.identity())]
        drawn = NativeRenderer().render(posed, CAMERA, pose, RenderOptions())
        path = folder / f"{k}.png"
        cv2.imwrite(str(path), np.round(255 * np.clip(drawn.rgb, 0, 1))[..., ::-1])
        views.append(View(path.name, path, CAMERA, pose))
    scene, work = folder / "floor.gnx", folder / "floor.gnx.prepare"
    (work / "training").mkdir(parents=True)
    (work / "outdoor points").mkdir()
    nothing = np.zeros((0, 3))
    kept = Reconstruction(
        tuple(views), nothing, nothing.astype(np.uint8), np.zeros(0, dtype=np.float32)
    )
    save_reconstruction(kept, work / "outdoor points" / POINTS_FOLDER)
    points = tuple(ViewPoint(v.name, v.camera, v.world_from_camera) for v in views)
    corners = np.array([[-1.0, -1.0], [1.0, 1.0]])
    room = merged(fine, 0.15)
    save_package(
        ScenePackage("floor", room, (), (), Pose.identity(), corners, None, views=points), scene
    )
    return scene


@pytest.fixture
def scene(prepared, tmp_path):
    copied = tmp_path / "floor.gnx"
    shutil.copytree(prepared, copied)
    return copied


@pytest.fixture
def nexus(capsys, prepared):
    def call(*words, photos=True):
        work = ["--work", str(prepared) + ".prepare"] if photos else []
        code = main(["refine", *map(str, words), *work])
        printed = capsys.readouterr()
        return code, printed.out, printed.err

    return call


def bytes_of(scene):
    return {p.name: p.read_bytes() for p in (scene / "splats").rglob("*.ply")}


def test_a_region_is_sharpened_and_put_back_to_the_byte(scene, nexus):
    save_package(load_package(scene), scene)
    before = bytes_of(scene)
    asked = ("--at", "0,0,0", "--radius", "0.4", "--steps", "60", "--json")
    code, out, _ = nexus(scene, *asked)
    assert code == 0
    (row,) = json.loads(out)["refined"]
    assert (row["name"], row["photos"], row["after_db"]) == ("region", 6, None)
    assert row["splats"] > 50
    assert bytes_of(scene) != before
    assert [stage.name for stage in load_package(scene).stages] == ["refine region"]
    code, out, _ = nexus(scene, "--undo")
    assert (code, "region is as it was" in out) == (0, True)
    assert bytes_of(scene) == before


def test_what_cannot_be_refined_is_said_in_a_line(scene, nexus):
    refused = {
        (): "no object was cut out of it",
        ("mug",): "has no object 'mug'",
        ("mug", "--at", "0,0,0"): "objects and --at; give one of them",
        ("--at", "9,9,9"): "no splat within 0.3 m of (9, 9, 9) m",
        ("--undo",): "what was done last is no refinement",
    }
    for words, why in refused.items():
        code, _, err = nexus(scene, *words)
        assert code == 3
        assert why in err
        assert err.strip().count("\n") <= 1


def test_without_photos_it_says_so(scene, nexus):
    code, _, err = nexus(scene, "--at", "0,0,0", photos=False)
    assert code == 3
    assert "no finished preparation of 'floor'; to refine it, prepare it again" in err


@pytest.mark.parametrize(
    "words",
    [("--at", "1,2"), ("--at", "nan,0,0"), ("--radius", "0"), ("--radius", "x"), ("--steps", "3")],
)
def test_numbers_that_are_none_are_usage_errors(scene, nexus, words):
    assert nexus(scene, *words)[0] == 2
