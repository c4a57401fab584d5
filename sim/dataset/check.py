"""Reads a written data set back and says whether poses, masks, lengths and meshes agree."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from scenes.cameras import Fisheye, Pinhole
from scenes.pose import Pose
from scenes.rays import RayScene
from sim.dataset.pictures import read_picture
from sim.dataset.truth.agreement import RIGID, Agreement, Looked, agreement, rigid_error
from sim.dataset.truth.surfaces import MILLIMETRES, read_model_ply, read_obj

Item = TypeVar("Item")

MIN_PX = 200
"""Pixels of a silhouette from which on its overlap says something: a border of half a pixel is a
tenth of a smaller one."""

MIN_IOU = 0.95
"""Median overlap of silhouettes and meshes."""

WORST_IOU = 0.80
"""Overlap of any of them."""

MAX_MM = 5.0
"""Median difference of lengths, mm: ten steps of what is written."""

MAX_FRACTION_OFF = 2e-6
"""Of the visible fraction that is written from that of the masks: six digits are written."""

SAMPLED = 12
"""Images of each camera whose pixels are compared, evenly over the sequence; poses are all read."""


@dataclass(frozen=True, slots=True)
class Checked:
    """Figures of a data set that was read back.

    Attributes:
        form: "room-c" or "bop".
        images: that are described.
        rigid_off: worst rotation's distance from one.
        iou_median: of silhouettes and meshes over `compared`.
        iou_worst: likewise.
        length_mm: median difference of range or depth, mm; nan if no object is seen.
        fraction_off: worst difference of a visible fraction from its masks'.
        outside_px: visible pixels outside of silhouettes.
        compared: silhouettes of at least `MIN_PX` that were held against their meshes.
    """

    form: str
    images: int
    rigid_off: float
    iou_median: float
    iou_worst: float
    length_mm: float
    fraction_off: float
    outside_px: int
    compared: int

    def require(self, folder: Path) -> None:
        """Refuse what cannot be right.

        Raises:
            ValueError: a figure is beyond its limit; names it, its value and the limit.
        """
        limits = (
            ("rotations are off by", self.rigid_off, self.rigid_off <= RIGID, RIGID),
            ("median overlap of masks and meshes is", self.iou_median,
             self.iou_median >= MIN_IOU, MIN_IOU),
            ("least overlap of masks and meshes is", self.iou_worst,
             self.iou_worst >= WORST_IOU, WORST_IOU),
            ("lengths are off by mm", self.length_mm, not self.length_mm > MAX_MM, MAX_MM),
            ("visible fractions are off by", self.fraction_off,
             self.fraction_off <= MAX_FRACTION_OFF, MAX_FRACTION_OFF),
            ("visible pixels outside of silhouettes:", self.outside_px, self.outside_px == 0, 0),
        )  # fmt: skip
        for what, value, is_right, limit in limits:
            if not is_right:
                raise ValueError(f"{folder}: {what} {value:.4g}, limit {limit:g}; do not use it")

    def line(self) -> str:
        """The figures in one line."""
        return (
            f"checked {self.images} images: overlap of masks and meshes {self.iou_median:.3f} "
            f"(worst {self.iou_worst:.3f}, {self.compared} silhouettes), "
            f"lengths within {self.length_mm:.1f} mm (median)"
        )


def check_dataset(folder: Path) -> Checked:
    """Read a data set of either form.

    Raises:
        ValueError: it is none, or a file is missing or damaged; names it.
    """
    if (folder / "models" / "models_info.json").is_file():
        return check_bop(folder)
    if (folder / "objects.json").is_file():
        return check_room_folder(folder)
    raise ValueError(
        f"{folder}: no data set: neither objects.json nor models/models_info.json is there"
    )


def _sample(items: Sequence[Item]) -> list[Item]:
    """Return at most `SAMPLED` items of a sequence, evenly."""
    chosen = np.unique(np.linspace(0, len(items) - 1, min(len(items), SAMPLED)).round())
    return [items[int(index)] for index in chosen]


def _sum_up(
    form: str,
    images: int,
    found: Sequence[Agreement],
    *,
    rigid_off: float,
    fraction_off: float,
) -> Checked:
    """Return the figures over all that was compared."""
    large = [a for a in found if a.pixels >= MIN_PX]
    ious: list[float] = [a.iou for a in large]
    lengths: Any = [a.length_mm for a in large if np.isfinite(a.length_mm)]
    return Checked(
        form,
        images,
        rigid_off,
        float(np.median(ious)) if ious else 1.0,
        min(ious, default=1.0),
        float(np.median(lengths)) if lengths else float("nan"),
        fraction_off,
        sum(a.visible_outside_px for a in found),
        len(large),
    )


def check_room_folder(folder: Path) -> Checked:
    """Hold every sequence of a folder of docs/datasets.md against its meshes; no photos.

    Raises:
        ValueError: a file or a field is missing or damaged; names it.
    """
    objects = _read(folder / "objects.json")["objects"]
    meshes = {name: RayScene(read_obj(folder / item["mesh"])) for name, item in objects.items()}
    found: list[Agreement] = []
    rigid, fraction_off, images = 0.0, 0.0, 0
    for path in sorted(folder.glob("fisheye/*/truth.json")):
        truth = _read(path)
        try:
            for frame in truth["frames"]:
                for values in (frame["world_from_camera"], *frame["world_from_object"].values()):
                    rigid = max(rigid, rigid_error(np.array(values, np.float64)[:3, :3]))
                _require_picture(path.parent / frame["file"])
                images += 1
            for frame in _sample(truth["frames"]) if rigid <= RIGID else ():
                for seen, off in _compare(path.parent, truth, frame, meshes):
                    found.append(seen)
                    fraction_off = max(fraction_off, off)
        except (KeyError, IndexError, TypeError) as error:
            raise ValueError(f"{path}: field {error} is missing or of another kind") from None
    if not images:
        raise ValueError(f"{folder / 'fisheye'}: no sequence with a frame in its truth.json")
    return _sum_up("room-c", images, found, rigid_off=rigid, fraction_off=fraction_off)


def _compare(
    place: Path, truth: dict[str, Any], frame: dict[str, Any], meshes: dict[str, RayScene]
) -> list[tuple[Agreement, float]]:
    name, unit_m = frame["name"], truth["range_unit_m"]
    ids = read_picture(place / "masks" / f"{name}.png")
    lengths = unit_m * read_picture(place / "range" / f"{name}.png").astype(np.float64)
    lens = _lens(truth["camera"])
    if ids.shape != lengths.shape or ids.shape != (lens.height_px, lens.width_px):
        raise ValueError(
            f"{place}: frame {name}: masks {ids.shape} and range {lengths.shape}, wanted "
            f"{lens.height_px} × {lens.width_px}"
        )
    looked = Looked(lens, Pose.from_matrix(np.array(frame["world_from_camera"])), lengths, False)
    results: list[tuple[Agreement, float]] = []
    for object_id, values in frame["visible"].items():
        if not values["pixels_unoccluded"]:
            continue
        file = place / "silhouettes" / f"{name}_{object_id}.png"
        alone = read_picture(file).astype(np.bool_)
        visible = np.asarray(ids == truth["labels"][object_id], np.bool_)
        fraction = np.count_nonzero(visible) / max(1, np.count_nonzero(alone))
        world_from_object = Pose.from_matrix(np.array(frame["world_from_object"][object_id]))
        seen = agreement(looked, meshes[object_id], world_from_object, alone=alone, visible=visible)
        results.append((seen, abs(fraction - values["fraction"])))
    return results


def _lens(camera: dict[str, Any]) -> Fisheye:
    return Fisheye(
        camera["width"],
        camera["height"],
        camera["f_px"],
        camera["cx"],
        camera["cy"],
        math.radians(camera["fov_deg"]) / 2,
    )


def _require_picture(path: Path) -> None:
    if not path.is_file() or not path.stat().st_size:
        raise ValueError(f"{path}: the picture is missing or empty; write the data set again")


def check_bop(folder: Path) -> Checked:
    """Hold the ground truth of every scene in the BOP form against its models.

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
            for image in _sample(list(cameras)) if rigid <= RIGID else ():
                _require_rgb(scene, int(image))
                looked = _read_look(scene, int(image), cameras[image], size)
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
    return _sum_up("bop", images, found, rigid_off=rigid, fraction_off=fraction_off)


def _read_look(scene: Path, image: int, camera: dict[str, Any], size: dict[str, Any]) -> Looked:
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
