# pyright: standard
"""An `Alignment` on disk, to the same bits."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from scenes.formats.storage.atomic import write_file
from scenes.pose import Pose
from scenes.prepare.align.alignment import Alignment, Anchor
from scenes.prepare.align.gravity import Gravity
from scenes.prepare.align.similarity import Similarity

FILE = "alignment.json"


def save_alignment(alignment: Alignment, folder: Path) -> None:
    """Write it into a folder.

    Raises:
        WriteError: the disk is full or the folder not writable.
    """
    gravity = alignment.gravity
    values: dict[str, Any] = {
        "world_from_reconstruction": _similarity_to_json(alignment.world_from_reconstruction),
        "covariance": alignment.covariance.tolist(),
        "anchors": [_anchor_to_json(anchor) for anchor in alignment.anchors],
        "gravity": None
        if gravity is None
        else {
            "up": gravity.up.tolist(),
            "floor": gravity.floor,
            "tilt_sigma_deg": gravity.tilt_sigma_deg,
            "floor_sigma": gravity.floor_sigma,
            "floor_points": gravity.floor_points,
        },
        "groups": alignment.groups,
        "references_m": alignment.references_m.tolist(),
        "bend_per_metre": alignment.bend_per_metre,
        "warnings": list(alignment.warnings),
        "is_guess": alignment.is_guess,
    }
    write_file(folder / FILE, [json.dumps(values, indent=1).encode()])


def load_alignment(folder: Path) -> Alignment:
    """Read the alignment that `save_alignment` wrote.

    Raises:
        ValueError: the file is missing or damaged.
    """
    path = folder / FILE
    try:
        values = json.loads(path.read_text(encoding="utf-8"))
        gravity = values["gravity"]
        return Alignment(
            _similarity_from_json(values["world_from_reconstruction"]),
            np.array(values["covariance"]).reshape(7, 7),
            tuple(_anchor_from_json(anchor) for anchor in values["anchors"]),
            None if gravity is None else Gravity(**gravity | {"up": np.array(gravity["up"])}),
            int(values["groups"]),
            np.array(values["references_m"]).reshape(-1, 3),
            float(values["bend_per_metre"]),
            tuple(values["warnings"]),
            bool(values.get("is_guess", False)),
        )
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise ValueError(
            f"{path}: no saved alignment ({error}); delete its folder and prepare again"
        ) from error


def _similarity_to_json(a_from_b: Similarity) -> dict[str, Any]:
    return {
        "scale": a_from_b.scale,
        "rotation": a_from_b.rotation.tolist(),
        "translation": a_from_b.translation.tolist(),
    }


def _similarity_from_json(values: dict[str, Any]) -> Similarity:
    return Similarity(
        float(values["scale"]), np.array(values["rotation"]), np.array(values["translation"])
    )


def _anchor_to_json(anchor: Anchor) -> dict[str, Any]:
    return {
        "payload": anchor.payload,
        "side_m": anchor.side_m,
        "world_from_code": anchor.world_from_code.matrix().tolist(),
        "corners_m": anchor.corners_m.tolist(),
        "residual_px": anchor.residual_px,
        "residual_mm": anchor.residual_mm,
        "corner_mm": anchor.corner_mm,
        "views": list(anchor.views),
    }


def _anchor_from_json(values: dict[str, Any]) -> Anchor:
    return Anchor(
        **values
        | {
            "world_from_code": Pose.from_matrix(np.array(values["world_from_code"])),
            "corners_m": np.array(values["corners_m"]).reshape(4, 3),
            "views": tuple(values["views"]),
        }
    )
