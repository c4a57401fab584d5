"""`nexus gallery`: before and after, from a scene and the folder that it was prepared in.

Three pictures, small enough for a page: photo, splats and collision mesh from one place; and for a
scene with objects, the room with one, without it, and the object alone.
"""

from __future__ import annotations

import argparse
import io
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from scenes.cameras import Fisheye, Pinhole
    from scenes.mesh import CollisionMesh
    from scenes.package import ScenePackage
    from scenes.package.records import ViewPoint
    from scenes.pose import Pose
    from scenes.prepare.reconstruction import View
    from scenes.state import ObjectModel

Picture = NDArray[np.uint8]

PANEL_PX = 480
MAX_BYTES = 150_000
QUALITIES = (85, 75, 65, 50, 35)
GAP_PX = 6
GREY = (0.22, 0.23, 0.25)
POSES = ("poses/reconstruction", "poses/sfm/reconstruction")
"""Place of the photos with their poses in a work folder."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """The verb's flags."""
    parser.add_argument("scene", type=Path, metavar="SCENE", help="a prepared scene package")
    parser.add_argument(
        "--work", type=Path, metavar="DIR", help="where it was prepared (default: SCENE.prepare)"
    )
    parser.add_argument(
        "--photo",
        action="append",
        metavar="NAME",
        help="photos to show (default: two of those that were kept aside)",
    )
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="for the pictures")


def run(args: argparse.Namespace) -> int:
    """Draw the pictures; prints their names.

    Raises:
        ValueError: the scene, its work folder or a photo is missing or damaged.
        OSError: a picture cannot be written.
    """
    from scenes.formats.storage.atomic import write_file
    from scenes.package import load_package

    package = load_package(args.scene)
    work = args.work or args.scene.with_name(f"{args.scene.name}.prepare")
    views = _views(package, work)
    names = args.photo or _kept_aside(work)[:2]
    unknown = [name for name in names if name not in views]
    if unknown or not names:
        raise ValueError(
            f"{work}: no photo {unknown[0] if unknown else ''!r} with a pose; choose one of "
            f"{', '.join(list(views)[:5])} ... with --photo"
        )
    strips = {f"photo-{Path(name).stem}": _photo_strip(package, *views[name]) for name in names}
    strips |= {f"cut-{item.object_id}": _cut_strip(package, item) for item in package.objects}
    args.out.mkdir(parents=True, exist_ok=True)
    for name, panels in strips.items():
        path = args.out / f"{args.scene.stem}-{name}.jpg"
        write_file(path, [_jpeg(_side_by_side(panels))])
        print(path, file=sys.stdout)
    return 0


def _views(package: ScenePackage, work: Path) -> dict[str, tuple[View, ViewPoint]]:
    """Photos by name, and where in the world they were taken."""
    from scenes.prepare.reconstruction import load_reconstruction

    folder = next((work / place for place in POSES if (work / place).is_dir()), None)
    if folder is None:
        raise ValueError(f"{work}: no photos with poses; give the scene's work folder with --work")
    taken = {view.name: view for view in load_reconstruction(folder).views}
    return {v.name: (taken[v.name], v) for v in package.views if v.name in taken}


def _kept_aside(work: Path) -> list[str]:
    from scenes.prepare.train.trained_file import load_training

    scores = sorted(load_training(work / "training").held_out, key=lambda score: -score.psnr_db)
    return [score.view for score in scores]


def _photo_strip(package: ScenePackage, view: View, place: ViewPoint) -> list[Picture]:
    from scenes.prepare.train.training_photos import read_photo

    photo = read_photo(view, PANEL_PX)
    panels = [
        photo.picture,
        _drawn(package, photo.camera, place.world_from_camera, objects=package.objects),
    ]
    if package.collision is not None:
        panels.append(_shaded(package.collision, photo.camera, place.world_from_camera))
    return panels


def _cut_strip(package: ScenePackage, item: ObjectModel) -> list[Picture]:
    """With the object, without it, and it alone, from where it is seen largest and whole."""
    from scenes.prepare.train.training_photos import smaller

    middle = item.world_from_object.translation
    radius = 0.5 * float(np.linalg.norm(item.box_m))
    best = max(package.views, key=lambda view: _size_in(view, middle, radius))
    longest = max(best.camera.width_px, best.camera.height_px)
    camera = smaller(best.camera, longest / PANEL_PX)
    others = [other for other in package.objects if other is not item]
    pose = best.world_from_camera
    return [
        _drawn(package, camera, pose, objects=package.objects),
        _drawn(package, camera, pose, objects=others),
        _drawn(package, camera, pose, objects=[item], room=False),
    ]


def _size_in(view: ViewPoint, middle: NDArray[np.float64], radius: float) -> float:
    """How large a ball is in a view, pixels; negative where it is not whole."""
    from scenes.cameras import Pinhole

    in_camera = view.world_from_camera.inverse() @ middle[None]
    depth = float(in_camera[0, 2])
    if not isinstance(view.camera, Pinhole) or depth < 2 * radius:
        return -1.0
    pixels, valid = view.camera.project(in_camera)
    reach = view.camera.fx * radius / depth
    size = np.array([view.camera.width_px, view.camera.height_px])
    whole = (pixels[0] > 0.6 * reach).all() and (pixels[0] < size - 0.6 * reach).all()
    return float(reach) if valid[0] and whole else -1.0


def _drawn(
    package: ScenePackage,
    camera: Pinhole | Fisheye,
    world_from_camera: Pose,
    *,
    objects: Sequence[ObjectModel],
    room: bool = True,
) -> Picture:
    from scenes.pose import Pose
    from scenes.render.native import NativeRenderer
    from scenes.render.renderer import PosedSplats, RenderOptions

    posed = [PosedSplats(package.room, Pose.identity())] if room else []
    posed += [PosedSplats(item.splats, item.world_from_object) for item in objects]
    options = RenderOptions(background=(0.0, 0.0, 0.0) if room else GREY)
    drawn = NativeRenderer().render(posed, camera, world_from_camera, options)
    return np.round(255 * np.clip(drawn.rgb, 0, 1)).astype(np.uint8)


def _shaded(mesh: CollisionMesh, camera: Pinhole | Fisheye, world_from_camera: Pose) -> Picture:
    from scenes.cameras import pixel_centres
    from scenes.rays import RayScene

    rays = camera.unproject(pixel_centres(camera)) @ world_from_camera.rotation.T
    eyes = np.broadcast_to(world_from_camera.translation, rays.shape)
    hits = RayScene(mesh.vertices[mesh.faces]).cast(eyes, rays)
    light = np.abs(hits.normals @ np.array([0.35, 0.25, 0.9]))
    shade = np.where(hits.triangle >= 0, 50 + 190 * light, 20).clip(0, 255).astype(np.uint8)
    return shade.reshape(camera.height_px, camera.width_px, 1).repeat(3, axis=2)


def _side_by_side(panels: list[Picture]) -> Picture:
    height = min(panel.shape[0] for panel in panels)
    gap = np.full((height, GAP_PX, 3), 255, dtype=np.uint8)
    parts = [part for panel in panels for part in (gap, panel[:height])]
    return np.concatenate(parts[1:], axis=1)


def _jpeg(picture: Picture) -> bytes:
    """As good as it can be within `MAX_BYTES`."""
    from PIL import Image

    data = b""
    for quality in QUALITIES:
        buffer = io.BytesIO()
        Image.fromarray(picture).save(buffer, "JPEG", quality=quality, optimize=True)
        data = buffer.getvalue()
        if len(data) <= MAX_BYTES:
            break
    return data
