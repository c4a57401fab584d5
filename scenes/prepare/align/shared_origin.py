# pyright: standard
"""The shared origin for augmented-reality devices: where the world is, as seen from each code.

A device that finds any of the codes lays its own frame on the studio's world:

    {"format": "gaussiannexus-shared-origin", "version": 1,
     "axes": "right-handed, Z up, metres; code: x right, y up, z out of the print",
     "codes": [{"payload": "...", "side_m": 0.2,
                "code_from_world": {"wxyz": [...], "translation": [...]},
                "sigma_m": 0.001}]}

`code_from_world` is the world's origin in the code's own frame. A device that finds several codes
should lay its frame on all of their corners: their distances hold the direction better than one
code's tilt. `sigma_m` is how far off that code is predicted to be.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import Any

from scenes.pose import Pose
from scenes.prepare.align.alignment import Alignment
from scenes.quad import QrCode

FORMAT = "gaussiannexus-shared-origin"
VERSION = 1


def shared_origin_to_json(alignment: Alignment) -> str:
    """The text of the file.

    Raises:
        ValueError: the alignment has no codes, so that no device could find the origin.
    """
    if not alignment.anchors:
        raise ValueError(
            "shared origin: the scene was aligned without codes, so a device has nothing to find; "
            "film a printed code too"
        )
    codes = []
    for anchor in alignment.anchors:
        code_from_world = anchor.world_from_code.inverse()
        sigma_m = alignment.predicted_error_m(anchor.world_from_code.translation)[0]
        codes.append(
            {
                "payload": anchor.payload,
                "side_m": anchor.side_m,
                "code_from_world": {
                    "wxyz": code_from_world.quaternion().tolist(),
                    "translation": code_from_world.translation.tolist(),
                },
                "sigma_m": round(float(sigma_m), 6),
            }
        )
    values = {
        "format": FORMAT,
        "version": VERSION,
        "axes": "right-handed, Z up, metres; code: x right, y up, z out of the print",
        "codes": codes,
    }
    return json.dumps(values, indent=1)


def shared_origin_from_json(text: str) -> tuple[QrCode, ...]:
    """The codes with their world poses, as written by `shared_origin_to_json`.

    Raises:
        ValueError: it is no such file, a field is missing or is no pose.
    """
    try:
        values: Mapping[str, Any] = json.loads(text)
        found = (values["format"], values["version"])
        codes = tuple(_code(code) for code in values["codes"])
    except (KeyError, TypeError, ValueError) as error:
        raise ValueError(f"shared origin: {error}") from None
    if found != (FORMAT, VERSION):
        raise ValueError(
            f"shared origin: {found[0]!r} version {found[1]!r}, wanted {FORMAT!r} {VERSION}"
        )
    return codes


def _code(values: Mapping[str, Any]) -> QrCode:
    pose = values["code_from_world"]
    code_from_world = Pose.from_quaternion(pose["wxyz"], pose["translation"])
    side_m = float(values["side_m"])
    if not (math.isfinite(side_m) and side_m > 0):
        raise ValueError(f"code {values['payload']!r}: side_m {side_m}, wanted > 0")
    return QrCode(str(values["payload"]), side_m, code_from_world.inverse())
