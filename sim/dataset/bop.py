"""A simulated session in the BOP form (bop.felk.cvut.cz), the pose-estimation field's own.

BOP knows pinhole cameras that see one scene each. Every pinhole view of every lens is a scene of
its own here; an image's number is the frame's. In BOP the centre of the top left pixel is (0, 0),
so `cam_K` has its principal point half a pixel less than this program's cameras.
"""

from __future__ import annotations

import hashlib
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import ExitStack, closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import ConvexHull, QhullError  # pyright: ignore[reportMissingTypeStubs]

from scenes.cameras import Pinhole, Rig
from scenes.mesh import PhysicalObject, PhysicalRoom
from scenes.pose import Pose
from sim.camera.camera360 import default_rig
from sim.dataset.json_stream import JsonList, write_json
from sim.dataset.pictures import PictureFormat, write_labels, write_lengths, write_rgb
from sim.dataset.truth.lens_truth import LensTruthPass
from sim.dataset.truth.pinhole_views import PinholeView, ViewSampler, ViewTruth, views_in
from sim.dataset.truth.surfaces import MILLIMETRES, joined, meshes_of_object, write_model_ply
from sim.dataset.truth.symmetry import ROUND, yaw_symmetry
from sim.dataset.truth.visibility import Seen, seen
from sim.rehearsal import SimulatedStep
from sim.scenarios.scenario import Scenario

SPLIT = "test"
"""Folder of the scenes."""

DEPTH_SCALE = 0.5
"""Millimetres per step of a depth picture: 65,535 of them are 32 m."""

FINER = 2
"""Pixels of the truth per pixel of the lens, each way: views are resampled from it."""

TARGET_FRACTION = 0.1
"""An object has to be so visible to be asked for, as in BOP's own targets."""

FOLDERS = ("rgb", "depth", "mask", "mask_visib")


@dataclass(frozen=True, slots=True)
class BopOptions:
    """How a session is written.

    Attributes:
        every: of so many frames, one is written.
        pictures: lossless or JPEG.
        view_px: side of the square views; None for as fine as the lens.
    """

    every: int = 1
    pictures: PictureFormat = "png"
    view_px: int | None = None


@dataclass(frozen=True, slots=True, eq=False)
class _Scene:
    """One view of one lens: where its files go, and what resamples pictures and truth."""

    number: int
    lens: int
    folder: Path
    view: PinholeView
    pictures: ViewSampler
    truth: ViewSampler
    cameras: JsonList
    poses: JsonList
    infos: JsonList
    targets: list[dict[str, int]] = field(default_factory=list[dict[str, int]])


def write_bop(
    folder: Path,
    room: PhysicalRoom,
    scenario: Scenario,
    steps: Iterator[SimulatedStep],
    *,
    options: BopOptions,
) -> Iterator[int]:
    """Write models, then frame after frame into `folder/test`; yields how many are written.

    Raises:
        OSError: the disk is full.
    """
    model_of = model_numbers(room.objects)
    write_models(folder / "models", room.objects, model_of)
    rig = default_rig(scenario.camera.lens_size_px)
    fine = Rig(
        tuple(lens.resized(FINER * lens.width_px, FINER * lens.height_px) for lens in rig.lenses),
        rig.rig_from_lens,
    )
    with ExitStack() as stack:
        truth_pass = stack.enter_context(closing(LensTruthPass(room, fine)))
        scenes = _scenes(folder, rig, fine, options, stack)
        write_json(folder / "camera.json", _camera_json(scenes[0].view.camera))
        written = 0
        for index, step in enumerate(steps):
            if index % options.every:
                continue
            recorded = step.truth.recorded
            truths = truth_pass.frame(
                recorded.world_from_rig, recorded.world_from_object, step.truth.people
            )
            for scene in scenes:
                rgb = scene.pictures.picture(step.frame.images[scene.lens])
                truth = scene.truth.truth(truths[scene.lens])
                _write_image(scene, step, rgb, truth, _Named(room.objects, model_of), options)
            written += 1
            yield written
    targets = [target for scene in scenes for target in scene.targets]
    write_json(folder / "test_targets_bop19.json", targets)


@dataclass(frozen=True, slots=True, eq=False)
class _Named:
    objects: Sequence[PhysicalObject]
    model_of: Mapping[str, int]


def _scenes(
    folder: Path, rig: Rig, fine: Rig, options: BopOptions, stack: ExitStack
) -> list[_Scene]:
    scenes: list[_Scene] = []
    for lens, camera in enumerate(rig.lenses):
        for view in views_in(camera, options.view_px):
            number = len(scenes)
            place = folder / SPLIT / f"{number:06d}"
            for name in FOLDERS:
                (place / name).mkdir(parents=True)
            cameras, poses, infos = (
                stack.enter_context(JsonList(place / f"{name}.json", keyed=True))
                for name in ("scene_camera", "scene_gt", "scene_gt_info")
            )
            scenes.append(
                _Scene(
                    number, lens, place, view,
                    ViewSampler(camera, view), ViewSampler(fine.lenses[lens], view),
                    cameras, poses, infos,
                )
            )  # fmt: skip
    return scenes


def _write_image(
    scene: _Scene,
    step: SimulatedStep,
    rgb: NDArray[np.uint8],
    truth: ViewTruth,
    named: _Named,
    options: BopOptions,
) -> None:
    image = step.frame.seq
    write_rgb(scene.folder / "rgb" / f"{image:06d}.{options.pictures}", rgb)
    write_lengths(
        scene.folder / "depth" / f"{image:06d}.png", truth.depth_m, DEPTH_SCALE / MILLIMETRES
    )
    poses: list[dict[str, Any]] = []
    infos: list[dict[str, Any]] = []
    view_from_world = truth.world_from_view.inverse()
    counts: dict[int, int] = {}
    for number, item in enumerate(named.objects, start=1):
        alone = truth.silhouettes.get(item.object_id)
        if alone is None:
            continue
        visible = alone & (truth.ids == number)
        file = f"{image:06d}_{len(poses):06d}.png"
        write_labels(scene.folder / "mask" / file, 255 * alone.astype(np.uint8))
        write_labels(scene.folder / "mask_visib" / file, 255 * visible.astype(np.uint8))
        found, model = seen(alone, visible, (0, 0)), named.model_of[item.object_id]
        pose = view_from_world @ step.truth.recorded.world_from_object[item.object_id]
        poses.append({**_pose_json(pose, "m2c"), "obj_id": model})
        infos.append(_info_json(found, int(np.count_nonzero(alone & (truth.depth_m > 0)))))
        if found.fraction >= TARGET_FRACTION:
            counts[model] = counts.get(model, 0) + 1
    camera = {"cam_K": _k(scene.view.camera), "depth_scale": DEPTH_SCALE}
    scene.cameras.add({**camera, **_pose_json(view_from_world, "w2c")}, name=str(image))
    scene.poses.add(poses, name=str(image))
    scene.infos.add(infos, name=str(image))
    scene.targets.extend(
        {"scene_id": scene.number, "im_id": image, "obj_id": model, "inst_count": count}
        for model, count in sorted(counts.items())
    )


def _pose_json(pose: Pose, name: str) -> dict[str, list[float]]:
    """Row-major rotation, and translation in millimetres."""
    return {
        f"cam_R_{name}": [round(float(v), 12) for v in pose.rotation.ravel()],
        f"cam_t_{name}": [round(float(v), 6) for v in MILLIMETRES * pose.translation],
    }


def _info_json(found: Seen, valid: int) -> dict[str, Any]:
    return {
        "bbox_obj": _corner_and_size(found.box_alone),
        "bbox_visib": _corner_and_size(found.box_visible),
        "px_count_all": found.pixels_alone,
        "px_count_valid": valid,
        "px_count_visib": found.pixels_visible,
        "visib_fract": round(found.fraction, 6),
    }


def _corner_and_size(box: tuple[int, int, int, int] | None) -> list[int]:
    """x, y, width, height; -1 four times where there is nothing, as BOP's toolkit writes it."""
    return [-1] * 4 if box is None else [box[0], box[1], box[2] - box[0], box[3] - box[1]]


def _k(camera: Pinhole) -> list[float]:
    return [camera.fx, 0.0, camera.cx - 0.5, 0.0, camera.fy, camera.cy - 0.5, 0.0, 0.0, 1.0]


def _camera_json(camera: Pinhole) -> dict[str, Any]:
    return {
        "cx": camera.cx - 0.5,
        "cy": camera.cy - 0.5,
        "depth_scale": DEPTH_SCALE,
        "fx": camera.fx,
        "fy": camera.fy,
        "height": camera.height_px,
        "width": camera.width_px,
    }


def model_numbers(objects: Sequence[PhysicalObject]) -> dict[str, int]:
    """Model of each object, from 1; twins, whose meshes and textures are the same, share one."""
    numbers: dict[str, int] = {}
    found: dict[str, int] = {}
    for item in objects:
        digest = hashlib.sha256(item.kind.encode())
        for mesh in meshes_of_object(item):
            for part in (mesh.vertices, mesh.faces, mesh.uv, mesh.texture):
                digest.update(part.tobytes())
        numbers[item.object_id] = found.setdefault(digest.hexdigest(), len(found) + 1)
    return numbers


def write_models(
    folder: Path, objects: Sequence[PhysicalObject], model_of: Mapping[str, int]
) -> None:
    """`obj_NNNNNN.ply`, `models_info.json`, and `names.json` (which object is which model).

    Raises:
        WriteError: the disk is full.
    """
    folder.mkdir(parents=True)
    infos: dict[str, Any] = {}
    for item in objects:
        number = model_of[item.object_id]
        if str(number) in infos:
            continue
        meshes = meshes_of_object(item)
        surface = joined(meshes)
        write_model_ply(folder / f"obj_{number:06d}.ply", surface)
        infos[str(number)] = _info(MILLIMETRES * surface.vertices, yaw_symmetry(meshes))
    write_json(folder / "models_info.json", infos)
    names = [
        {"object": i.object_id, "kind": i.kind, "obj_id": model_of[i.object_id]} for i in objects
    ]
    write_json(folder / "names.json", names)


def _info(vertices_mm: NDArray[np.float64], symmetry: int) -> dict[str, Any]:
    low, high = vertices_mm.min(axis=0), vertices_mm.max(axis=0)
    info: dict[str, Any] = {"diameter": round(_diameter(vertices_mm), 4)}
    info |= {f"min_{a}": round(float(v), 4) for a, v in zip("xyz", low, strict=True)}
    info |= {f"size_{a}": round(float(v), 4) for a, v in zip("xyz", high - low, strict=True)}
    if symmetry == ROUND:
        info["symmetries_continuous"] = [{"axis": [0, 0, 1], "offset": [0, 0, 0]}]
    elif symmetry > 1:
        info["symmetries_discrete"] = [
            Pose.from_yaw(2 * math.pi * k / symmetry).matrix().round(12).ravel().tolist()
            for k in range(1, symmetry)
        ]
    return info


def _diameter(points: NDArray[np.float64]) -> float:
    """Largest distance between two points, in their unit."""
    try:
        hull: Any = ConvexHull(points)
        points = points[hull.vertices]
    except QhullError:  # a flat object has no hull
        points = np.unique(points, axis=0)
    return max(float(np.linalg.norm(points - point, axis=1).max()) for point in points)
