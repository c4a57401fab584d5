"""Reads a folder of docs/datasets.md back, sequences only: photos have their own readers."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from scenes.cameras import Fisheye
from scenes.pose import Pose
from scenes.rays import RayScene
from sim.dataset.check import Checked, sampled, summed_up
from sim.dataset.pictures import read_picture
from sim.dataset.truth.agreement import RIGID, Agreement, Looked, agreement, rigid_error
from sim.dataset.truth.surfaces import read_obj


def check_room_folder(folder: Path) -> Checked:
    """Hold every sequence's truth against the meshes.

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
            for frame in sampled(truth["frames"]) if rigid <= RIGID else ():
                for seen, off in _compared(path.parent, truth, frame, meshes):
                    found.append(seen)
                    fraction_off = max(fraction_off, off)
        except (KeyError, IndexError, TypeError) as error:
            raise ValueError(f"{path}: field {error} is missing or of another kind") from None
    if not images:
        raise ValueError(f"{folder / 'fisheye'}: no sequence with a frame in its truth.json")
    return summed_up("room-c", images, found, rigid_off=rigid, fraction_off=fraction_off)


def _compared(
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


def _read(path: Path) -> dict[str, Any]:
    try:
        return json.loads(path.read_text(encoding="utf-8-sig"))
    except (OSError, json.JSONDecodeError) as error:
        raise ValueError(f"{path}: cannot be read ({error})") from None
