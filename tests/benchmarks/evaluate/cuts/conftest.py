"""A room of two cubes on a floor: meshes, splats all over them, photos drawn from the meshes."""

import math

import cv2
import numpy as np
import pytest

from benchmarks.evaluate.cuts.captures import Capture, TrueObject
from benchmarks.evaluate.cuts.truth import surface_points
from scenes.cameras import Pinhole, pixel_centres
from scenes.frames import look_at
from scenes.mesh import BoxPart, PhysicalObject, PhysicalRoom
from scenes.package import ScenePackage
from scenes.package.records import ViewPoint
from scenes.pose import Pose
from scenes.prepare.reconstruction import View
from scenes.rays import RayScene
from scenes.samples.pictures.atlas import mesh_from_surfaces
from scenes.samples.pictures.textures import plain
from scenes.samples.shapes import box, quad
from scenes.splats import SH_C0, SplatCloud, concatenate

CAMERA = Pinhole.from_fov(160, 120, math.radians(60))
COLOURS = np.array([[150, 140, 120], [200, 40, 30], [30, 60, 190]], np.uint8)
"""Of the floor, then of each cube."""
PER_M2 = 5000.0
SPREAD_M = 0.006


def triangles(*surfaces):
    mesh = mesh_from_surfaces(list(surfaces))
    return mesh.vertices[mesh.faces]


def cube(x, *, side=0.4):
    grey = plain((128, 128, 128))
    return triangles(
        *box((x, -side / 2, 0.0), (x + side, side / 2, side), material=grey, faces="+x-x+y-y+z")
    )


def discs(surface, rgb, seed):
    """Round, flat-lying splats on a surface (they are spheres here: every way is across)."""
    rng = np.random.default_rng(seed)
    count = max(1, round(PER_M2 * area(surface) / 6000))
    points = np.concatenate([surface_points(surface, rng) for _ in range(count)])
    n = len(points)
    sh = np.broadcast_to((rgb / 255.0 - 0.5) / SH_C0, (n, 1, 3))
    rotations = np.eye(4)[:1].repeat(n, axis=0)
    return SplatCloud(points, np.full((n, 3), SPREAD_M), rotations, np.full(n, 0.9), sh)


def area(surface):
    across = np.cross(surface[:, 1] - surface[:, 0], surface[:, 2] - surface[:, 0])
    return 0.5 * float(np.linalg.norm(across, axis=1).sum())


@pytest.fixture(scope="session")
def cubes(tmp_path_factory):
    """The capture, with twelve photos from all around."""
    folder = tmp_path_factory.mktemp("cubes")
    static = triangles(
        quad((-1.5, 1.5, 0.0), (3, 0, 0), (0, -3, 0), material=plain((128, 128, 128)))
    )
    parts = [static, cube(-0.8), cube(0.4)]
    cloud = concatenate(
        [discs(part, rgb, k) for k, (part, rgb) in enumerate(zip(parts, COLOURS, strict=True))]
    )
    scene = RayScene(np.concatenate(parts))
    owner = np.repeat(np.arange(3), [len(part) for part in parts])
    photos = []
    for number in range(12):
        turn = 2 * math.pi * number / 12
        eye = np.array([2.0 * math.cos(turn), 2.0 * math.sin(turn), 1.4])
        photos.append(_photo(folder, number, look_at(eye, np.array([0, 0, 0.1])), scene, owner))
    items = tuple(
        TrueObject(name, "cube", "", np.array([0.4, 0.4, 0.4]), part)
        for name, part in zip(("red", "blue"), parts[1:], strict=True)
    )
    footprint = np.array([[-1.5, -1.5], [1.5, 1.5]])
    views = tuple(ViewPoint(v.name, v.camera, v.world_from_camera) for v in photos)
    package = ScenePackage("cubes", cloud, (), (), Pose.identity(), footprint, None, views=views)
    return Capture(folder, package, tuple(photos), static, items, 0.0)


@pytest.fixture(scope="session")
def cube_meshes():
    """The same room as meshes."""
    floor = quad((-1.5, 1.5, 0.0), (3, 0, 0), (0, -3, 0), material=plain(tuple(COLOURS[0])))
    items = []
    for name, x, rgb in (("red", -0.6, COLOURS[1]), ("blue", 0.6, COLOURS[2])):
        surfaces = box((-0.2, -0.2, 0.0), (0.2, 0.2, 0.4), material=plain(tuple(rgb)))
        mesh = mesh_from_surfaces(list(surfaces))
        placed = Pose(np.eye(3), np.array([x, 0.0, 0.0]))
        solid = BoxPart(Pose(np.eye(3), np.array([0.0, 0.0, 0.2])), (0.2, 0.2, 0.2))
        items.append(PhysicalObject(name, "", (mesh,), (0.4, 0.4, 0.4), (solid,), 1.0, 0.5, placed))
    up = np.array([0.48, 0.36, 0.8])
    static = (mesh_from_surfaces([floor]),)
    return PhysicalRoom("cubes", static, tuple(items), (), up, Pose.identity())


def _photo(folder, number, world_from_camera, scene, owner):
    rays = CAMERA.unproject(pixel_centres(CAMERA)) @ world_from_camera.rotation.T
    eyes = np.broadcast_to(world_from_camera.translation, rays.shape)
    hits = scene.cast(eyes, rays)
    light = 0.6 + 0.4 * np.abs(hits.normals @ np.array([0.48, 0.36, 0.8]))
    rgb = np.where(
        (hits.triangle >= 0)[:, None],
        COLOURS[owner[np.maximum(hits.triangle, 0)]] * light[:, None],
        90,
    )
    picture = rgb.reshape(CAMERA.height_px, CAMERA.width_px, 3).astype(np.uint8)
    path = folder / f"{number:02d}.png"
    cv2.imwrite(str(path), np.ascontiguousarray(picture[..., ::-1]))
    return View(path.name, path, CAMERA, world_from_camera)
