from __future__ import annotations

import math
from dataclasses import replace

import cv2
import numpy as np
import pytest

from benchmarks.bake.bake import ScanImperfections, bake
from benchmarks.raster.reference.renderer import ReferenceRenderer
from scenes.cameras import Fisheye, Pinhole
from scenes.frames import look_at
from scenes.mesh import BoxPart, PhysicalObject, PhysicalRoom
from scenes.pose import Pose, rotation_from_quaternion
from scenes.rays import RayScene
from scenes.render.renderer import PosedSplats, Renderer, RenderOptions
from scenes.samples import sample_room
from scenes.samples.pictures.atlas import mesh_from_surfaces
from scenes.samples.pictures.textures import plain
from scenes.samples.shapes import box
from scenes.splats import SplatCloud, validate
from scenes.state import ObjectModel

ROOM_SPLATS = 90_000
PERFECT = ScanImperfections(
    along_normal_m=0.0,
    colour=0.0,
    exposure=0.0,
    spread=0.0,
    blur_m=0.0,
    scale_error=0.0,
    floaters=0,
)


@pytest.fixture(scope="module")
def lab() -> PhysicalRoom:
    return sample_room("lab")


@pytest.fixture(scope="module")
def scan(lab) -> tuple[SplatCloud, tuple[ObjectModel, ...]]:
    return bake(lab, rng=np.random.default_rng(3), room_splats=ROOM_SPLATS)


@pytest.fixture(scope="module")
def renderer() -> Renderer:
    try:
        from scenes.render.native import NativeRenderer

        return NativeRenderer()
    except ImportError:
        return ReferenceRenderer()


@pytest.fixture(scope="module")
def crate() -> PhysicalRoom:
    """A room of two crates, one of them movable; small enough to bake in no time."""
    fixed = mesh_from_surfaces(
        box((-0.5, -0.5, -0.1), (0.5, 0.5, 0.0), material=plain((200, 190, 180))), width_px=128
    )
    moving = mesh_from_surfaces(
        box((-0.1, -0.1, 0.0), (0.1, 0.1, 0.2), material=plain((90, 120, 160)), cell_m=0.03),
        width_px=128,
    )
    part = BoxPart(Pose.from_yaw(0.0, (0.0, 0.0, 0.1)), (0.1, 0.1, 0.1))
    thing = PhysicalObject(
        "crate-1", "crate", (moving,), (0.2, 0.2, 0.2), (part,), 1.0, 0.5,
        Pose.from_yaw(0.4, (0.1, 0.0, 0.0)),
    )  # fmt: skip
    return PhysicalRoom(
        name="crates",
        static=(fixed,),
        objects=(thing,),
        solids=(),
        light_direction=np.array([0.0, 0.6, 0.8]),
        world_from_rig=look_at(np.array([0.0, -1.0, 1.0]), np.zeros(3)),
        footprint_m=np.array([[-0.5, -0.5], [0.5, 0.5]]),
    )


def test_counts_values_and_poses(lab, scan):
    room, models = scan
    assert 0.9 * ROOM_SPLATS <= len(room) <= 1.01 * ROOM_SPLATS
    validate(room, "room")
    assert [m.object_id for m in models] == [o.object_id for o in lab.objects]
    for model, thing in zip(models, lab.objects, strict=True):
        validate(model.splats, model.object_id)
        assert 0.85 * 12_000 <= len(model.splats) <= 12_000
        assert model.kind == thing.kind
        offset = model.world_from_object.translation - thing.world_from_object.translation
        assert np.linalg.norm(offset) <= 0.0021 * np.linalg.norm(
            thing.world_from_object.translation
        )
        assert np.allclose(model.world_from_object.rotation, thing.world_from_object.rotation)
        assert np.allclose(model.box_m, thing.box_m, rtol=0.0021)
        assert model.support_z_m == pytest.approx(
            thing.world_from_object.translation[2], rel=0.0021
        )


def test_every_splat_lies_on_the_surface(lab, scan):
    """Position noise, scale error and nothing else separate a splat from the true surface."""
    room, models = scan
    static = np.concatenate([m.vertices[m.faces] for m in lab.static])
    distance = RayScene(static).distance(room.means[: len(room) - ScanImperfections().floaters])
    assert np.percentile(distance, 50) < 0.004
    assert np.percentile(distance, 99.9) < 0.012
    for model, thing in zip(models, lab.objects, strict=True):
        scene = RayScene(np.concatenate([m.vertices[m.faces] for m in thing.meshes]))
        distance = scene.distance(model.splats.means)
        assert np.percentile(distance, 99.9) < 0.008, model.object_id


def test_objects_have_no_halo(lab, scan):
    """Where a splat of an object is half as dense as at its centre it is still near the surface."""
    _, models = scan
    for model, thing in zip(models, lab.objects, strict=True):
        scene = RayScene(np.concatenate([m.vertices[m.faces] for m in thing.meshes]))
        axes = rotation_from_quaternion(model.splats.rotations)
        for k in (0, 1):
            for sign in (-1.18, 1.18):
                tip = model.splats.means + sign * model.splats.scales[:, k : k + 1] * axes[:, :, k]
                assert np.percentile(scene.distance(tip), 98) < 0.0055, model.object_id


def test_splats_are_flat_and_follow_the_surface(scan):
    room, _ = scan
    on_floor = room.select(np.abs(room.means[:, 2]) < 0.001)
    assert len(on_floor) > 0.06 * ROOM_SPLATS
    normals = rotation_from_quaternion(on_floor.rotations)[:, :, 2]
    assert np.percentile(np.abs(normals[:, 2]), 5) > 0.99
    assert on_floor.scales[:, 2].max() < 0.002
    assert np.median(on_floor.scales[:, 0]) > 0.004


def test_room_without_its_objects_is_covered_and_looks_like_the_mesh(lab, scan, renderer, raycast):
    room, _ = scan
    meshes = [(m, Pose.identity()) for m in lab.static]
    for camera, fine in (
        (Fisheye.from_fov(360, math.radians(180)), Fisheye.from_fov(1080, math.radians(180))),
        (
            Pinhole.from_fov(400, 300, math.radians(80)),
            Pinhole.from_fov(1200, 900, math.radians(80)),
        ),
    ):
        drawn = renderer.render(
            [PosedSplats(room, Pose.identity())], camera, lab.world_from_rig, RenderOptions()
        )
        truth, _, index = raycast(meshes, fine, lab.world_from_rig, shade=False)
        size = (camera.width_px, camera.height_px)
        truth = cv2.resize(truth, size, interpolation=cv2.INTER_AREA)
        hit = index[1::3, 1::3] >= 0
        alpha = drawn.alpha[hit]
        assert (alpha > 0.97).mean() > 0.98
        assert np.percentile(alpha, 0.1) > 0.85
        assert _psnr(drawn.rgb[hit], truth[hit] / 255.0) > 22.5


def test_objects_look_like_the_mesh_under_the_room_light(lab, scan, renderer, raycast):
    _, models = scan
    for model, thing in zip(models, lab.objects, strict=True):
        target = model.world_from_object @ np.array([0.0, 0.0, thing.box_m[2] / 2])
        eye = target + (1.5 if thing.kind != "book" else 0.6) * np.array([-0.6, -0.6, 0.53])
        view = look_at(eye, target)
        camera = Pinhole.from_fov(720, 720, math.radians(40))
        drawn = renderer.render(
            [PosedSplats(model.splats, model.world_from_object)], camera, view, RenderOptions()
        )
        truth, _, index = raycast(
            [(m, model.world_from_object) for m in thing.meshes],
            camera,
            view,
            shade=True,
            light_direction=lab.light_direction,
        )
        seen, true = drawn.alpha > 0.5, index >= 0
        overlap = (seen & true).sum() / (seen | true).sum()
        assert overlap > 0.9, (model.object_id, overlap)
        grown = (seen.sum() - true.sum()) / _outline_length(true)
        assert -0.5 < grown * _metres_per_pixel(camera, eye, target) * 1e3 < 3.0, model.object_id
        both = seen & true
        assert _psnr(drawn.rgb[both], truth[both] / 255.0) > 14.0, model.object_id
        assert np.corrcoef(drawn.rgb[both].mean(axis=1), truth[both].mean(axis=1))[0, 1] > 0.5


def test_scan_of_an_object_keeps_the_light_of_its_place(crate):
    """The side away from the window is darker, and a roof over the crate darkens its top."""
    _, (model,) = bake(
        crate, rng=np.random.default_rng(0), room_splats=2_000, object_splats=3_000,
        imperfections=PERFECT,
    )  # fmt: skip
    normals = model.world_from_object.rotation @ rotation_from_quaternion(model.splats.rotations)
    colour = model.splats.colours().mean(axis=1)
    facing = normals[:, :, 2] @ crate.light_direction
    assert colour[facing > 0.5].mean() > 1.25 * colour[facing < -0.3].mean()

    roof = mesh_from_surfaces(
        box((-0.5, -0.5, 0.3), (0.5, 0.5, 0.35), material=plain((255, 255, 255))), width_px=128
    )
    _, (shaded,) = bake(
        replace(crate, static=(*crate.static, roof)), rng=np.random.default_rng(0),
        room_splats=2_000, object_splats=3_000, imperfections=PERFECT,
    )  # fmt: skip
    top = model.splats.means[:, 2] > 0.195
    shaded_top = shaded.splats.means[:, 2] > 0.195
    assert shaded.splats.colours()[shaded_top].mean() < 0.75 * model.splats.colours()[top].mean()


def test_what_nobody_can_see_is_not_scanned(crate):
    """A sheet 1 cm above the floor hides what is below it, as a poster hides its wall."""
    sheet = mesh_from_surfaces(
        box((-0.4, -0.4, 0.01), (0.4, 0.4, 0.012), material=plain((250, 250, 250))), width_px=128
    )
    room, _ = bake(
        replace(crate, static=(*crate.static, sheet)), rng=np.random.default_rng(0),
        room_splats=4_000, object_splats=500, imperfections=PERFECT,
    )  # fmt: skip
    inner = np.abs(room.means[:, :2]).max(axis=1) < 0.3
    heights = room.means[inner, 2]
    assert (np.abs(heights - 0.012) < 1e-4).sum() > 300
    assert (np.abs(heights) < 1e-4).sum() == 0


def test_imperfections_do_what_they_say(crate):
    def scanned(flaws: ScanImperfections) -> SplatCloud:
        return bake(
            crate, rng=np.random.default_rng(1), room_splats=3_000, object_splats=500,
            imperfections=flaws,
        )[0]  # fmt: skip

    perfect = scanned(PERFECT)
    assert np.abs(_top(perfect)).max() < 1e-6
    noisy = scanned(replace(PERFECT, along_normal_m=0.003))
    assert _top(noisy).std() == pytest.approx(0.003, rel=0.1)
    large = scanned(replace(PERFECT, scale_error=0.05))
    ratio = np.ptp(large.means[:, 0]) / np.ptp(perfect.means[:, 0])
    assert min(abs(ratio - 1.05), abs(ratio - 0.95)) < 0.003
    assert len(scanned(replace(PERFECT, floaters=7))) == len(perfect) + 7


def test_same_generator_same_scan(crate):
    one, other = (
        bake(crate, rng=np.random.default_rng(9), room_splats=2_000, object_splats=800)
        for _ in range(2)
    )
    for name in ("means", "scales", "rotations", "opacities", "sh"):
        assert np.array_equal(getattr(one[0], name), getattr(other[0], name))
        assert np.array_equal(getattr(one[1][0].splats, name), getattr(other[1][0].splats, name))


def test_refuses_no_splats(crate):
    with pytest.raises(ValueError, match="room_splats = 0, wanted at least 1"):
        bake(crate, rng=np.random.default_rng(0), room_splats=0)
    with pytest.raises(ValueError, match="object_splats = -3, wanted at least 1"):
        bake(crate, rng=np.random.default_rng(0), object_splats=-3)


def _outline_length(mask: np.ndarray) -> int:
    outlines, _ = cv2.findContours(mask.astype(np.uint8), cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    return sum(len(outline) for outline in outlines)


def _metres_per_pixel(camera: Pinhole, eye: np.ndarray, target: np.ndarray) -> float:
    return float(np.linalg.norm(eye - target)) / camera.fx


def _top(cloud: SplatCloud) -> np.ndarray:
    """Heights of the splats on the upper side of the crates' floor, away from its rim."""
    inner = (np.abs(cloud.means[:, :2]).max(axis=1) < 0.45) & (cloud.means[:, 2] > -0.05)
    return cloud.means[inner, 2]


def _psnr(a: np.ndarray, b: np.ndarray) -> float:
    return float(10 * np.log10(1.0 / np.mean((np.clip(a, 0, 1) - b) ** 2)))
