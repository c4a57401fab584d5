"""Reads a folder in the BOP form back, as a user of BOP's toolkit would."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from scenes.cameras import Pinhole
from scenes.pose import Pose
from scenes.rays import RayScene
from sim.dataset.check import Checked, sampled, summed_up
from sim.dataset.pictures import read_picture
from sim.dataset.truth.agreement import RIGID, Agreement, Looked, agreement, rigid_error
from sim.dataset.truth.surfaces import MILLIMETRES, read_model_ply


def check_bop(folder: Path) -> Checked:
    """Hold every scene's ground truth against the models.

    Raises:
        ValueError: a file or a field is missing or damaged; names it.
    """
    infos = _read(folder / "models" / "models_info.json")
    meshes = {
        int(n): RayScene(read_model_ply(folder / "models" / f"obj_{int(n):06d}.ply") / MILLIMETRES)
        for n in infos
    }
    size = _read(folder / "camera.json")
    found: list[Agreement] = []
    rigid, fraction_off, images = 0.0, 0.0, 0
    for scene in sorted(folder.glob("test/*")):
        cameras, poses = _read(scene / "scene_camera.json"), _read(scene / "scene_gt.json")
        gt_infos = _read(scene / "scene_gt_info.json")
        if not cameras.keys() == poses.keys() == gt_infos.keys():
            raise ValueError(f"{scene}: scene_camera, scene_gt and scene_gt_info differ in images")
        images += len(cameras)
        try:
            for image, camera in cameras.items():
                for values in (camera["cam_R_w2c"], *(item["cam_R_m2c"] for item in poses[image])):
                    rigid = max(rigid, rigid_error(np.array(values).reshape(3, 3)))
            for image in sampled(list(cameras)) if rigid <= RIGID else ():
                _require_rgb(scene, int(image))
                looked = _looked(scene, int(image), cameras[image], size)
                instances = zip(poses[image], gt_infos[image], strict=True)
                for index, (item, info) in enumerate(instances):
                    file = f"{int(image):06d}_{index:06d}.png"
                    alone = read_picture(scene / "mask" / file).astype(np.bool_)
                    visible = read_picture(scene / "mask_visib" / file).astype(np.bool_)
                    fraction = np.count_nonzero(visible) / max(1, np.count_nonzero(alone))
                    fraction_off = max(fraction_off, abs(fraction - info["visib_fract"]))
                    pose, mesh = _pose(item), meshes[item["obj_id"]]
                    found.append(agreement(looked, mesh, pose, alone=alone, visible=visible))
        except (KeyError, IndexError, TypeError) as error:
            raise ValueError(f"{scene}: field {error} is missing or of another kind") from None
    if not images:
        raise ValueError(f"{folder / 'test'}: no scene with an image")
    return summed_up("bop", images, found, rigid_off=rigid, fraction_off=fraction_off)


def _looked(scene: Path, image: int, camera: dict[str, Any], size: dict[str, Any]) -> Looked:
    steps = read_picture(scene / "depth" / f"{image:06d}.png").astype(np.float64)
    if steps.shape != (size["height"], size["width"]):
        raise ValueError(
            f"{scene}: depth of image {image} is {steps.shape}, camera.json says "
            f"{size['height']} × {size['width']}"
        )
    k = camera["cam_K"]
    # The first pixel's centre is (0, 0) there and (0.5, 0.5) here.
    pinhole = Pinhole(size["width"], size["height"], k[0], k[4], k[2] + 0.5, k[5] + 0.5)
    lengths_m = steps * camera["depth_scale"] / MILLIMETRES
    return Looked(pinhole, Pose.identity(), lengths_m, True)


def _pose(item: dict[str, Any]) -> Pose:
    """`camera_from_object` in metres."""
    rotation = np.array(item["cam_R_m2c"], np.float64).reshape(3, 3)
    return Pose(rotation, np.array(item["cam_t_m2c"], np.float64) / MILLIMETRES)


def _require_rgb(scene: Path, image: int) -> None:
    if not any((scene / "rgb" / f"{image:06d}.{end}").is_file() for end in ("png", "jpg")):
        raise ValueError(f"{scene / 'rgb'}: picture {image:06d} is missing; write it again")


def _read(path: Path) -> dict[str, Any]:
    try:
        return json.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, json.JSONDecodeError) as error:
        raise ValueError(f"{path}: cannot be read ({error})") from None
