"""`viewer.html`: one file that shows the recorded session in any browser, without a network.

The page holds everything it needs as base64: the modules and the data as gzip, the splats as SPZ.
Its own start (`viewer/start.js`) unpacks them and lets the browser import them as modules.
"""

from __future__ import annotations

import base64
import gzip
import html
import json
import threading
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from devices.session_info import SessionInfo
from scenes.formats.storage.atomic import write_file
from scenes.frames import WORLD_FROM_GLTF
from scenes.package import ScenePackage
from scenes.pose import Pose
from studio.handover.keys import Keys
from studio.handover.moments import Moments
from studio.view.fonts import FACES, WEIGHTS
from studio.web.figure_file import figure_file
from studio.web.splat_parts import (
    SplatPart,
    shadow_part,
    write_shadow_parts,
    write_splat_parts,
)
from studio.web.views import first_places, views_of
from studio.web.web_files import STYLE, module_source, shared_sources

VIEWER = Path(__file__).parent / "viewer"
OWN_MODULES = ("main.js", "moments.js", "panel.js", "room.js")
FORMAT_VERSION = 1

DECIMALS = 4
"""Of lengths in metres, a tenth of a millimetre; of quaternions a hundredth of a degree."""

FINGER_DECIMALS = 2
"""Of fingers' angles in radians, half a degree."""

FIGURE = "figure"
"""Part with the figure of people, see `studio/web/figure_file.py`."""

STOOD_MS = 400
"""An object that has not moved for so long stands on something."""

BLOCK_BYTES = 3 << 18
"""Read at once; a multiple of three, so that base64 of the blocks is base64 of the whole."""


@dataclass(frozen=True, slots=True)
class ViewerPage:
    """A page that was written: how large it is, and how many splats of how many are in it."""

    size_bytes: int
    splats: int
    of_splats: int


def write_viewer(
    path: Path,
    *,
    scene: ScenePackage,
    info: SessionInfo,
    moments: Moments,
    modules: Mapping[str, Path],
    licences: str,
    most_bytes: int,
    cancelled: threading.Event,
) -> ViewerPage:
    """Write the page.

    Args:
        path: the page; the splats are put into its folder meanwhile.
        scene: the room and its objects.
        info: how the session was made.
        moments: what changed.
        modules: library modules by the name they are imported under.
        licences: theirs.
        most_bytes: of the page.
        cancelled: set it from another thread to stop.

    Raises:
        CancelledError: it was cancelled.
        ValueError: the page cannot be that small.
        OSError: the disk is full.
    """
    own = {f"viewer/{name}": VIEWER / name for name in OWN_MODULES}
    sources = {name: module_source(file) for name, file in {**modules, **own}.items()}
    sources |= shared_sources()
    data = _packed(json.dumps(_data(scene, info, moments), separators=(",", ":")).encode())
    scripts = [_part(name, _packed(source), module=True) for name, source in sources.items()]
    scripts.append(_part(FIGURE, _packed(figure_file())))
    scripts += [
        _part(f"font-{weight}", _packed((FACES / name).read_bytes()))
        for weight, name in WEIGHTS.items()
    ]
    before, after = _frame(scene, info, licences)
    fixed = len(before) + len(after) + sum(map(len, scripts)) + len(data) * 4 // 3 + 4096
    if fixed >= most_bytes:
        raise ValueError(
            f"viewer: {fixed / 1e6:.1f} MB are needed before any splat, {most_bytes / 1e6:.1f} MB "
            "are allowed; allow more with --viewer-mb"
        )
    shadows = write_shadow_parts(scene, path.parent)
    left = (most_bytes - fixed) * 3 // 4 - sum(part.path.stat().st_size for part in shadows)
    parts = shadows
    try:
        parts += write_splat_parts(scene, path.parent, allowed_bytes=left, cancelled=cancelled)
        size = write_file(path, _page(before, [*scripts, _part("data", data)], parts, after))
    finally:
        for part in parts:
            part.path.unlink(missing_ok=True)
    return ViewerPage(
        size, sum(part.splats for part in parts), sum(part.of_splats for part in parts)
    )


def _page(
    before: bytes, scripts: list[bytes], parts: tuple[SplatPart, ...], after: bytes
) -> Iterator[bytes]:
    yield before
    yield from scripts
    for part in parts:
        yield _opening(part.name)
        with part.path.open("rb") as file:
            while block := file.read(BLOCK_BYTES):
                yield base64.b64encode(block)
        yield b"</script>\n"
    yield after


def _opening(name: str, *, module: bool = False) -> bytes:
    as_module = f' data-module="{name}"' if module else ""
    return f'<script type="application/octet-stream" id="part:{name}"{as_module}>'.encode()


def _part(name: str, packed: bytes, *, module: bool = False) -> bytes:
    return _opening(name, module=module) + base64.b64encode(packed) + b"</script>\n"


def _packed(data: bytes) -> bytes:
    return gzip.compress(data, mtime=0)


def _frame(scene: ScenePackage, info: SessionInfo, licences: str) -> tuple[bytes, bytes]:
    """The page before and after its parts."""
    names = [info.scenario_name, *(change.scenario_name for change in info.changes)]
    story = " → ".join(name for name in names if name) or "a session"
    seed = "" if info.seed is None else f" · seed {info.seed}"
    page = (VIEWER / "page.html").read_text(encoding="utf-8")
    filled = {
        "TITLE": html.escape(f"{scene.name} · {story}"),
        "SUBTITLE": html.escape(f"tracker: {info.methods[0]}{seed}"),
        "STYLE": STYLE.read_text(encoding="utf-8"),
        "START": (VIEWER / "start.js").read_text(encoding="utf-8"),
    }
    before, after = page.split("@@PARTS@@")
    notice = f"<!--\nThis page holds\n\n{licences.replace('--', '- -')}\n-->\n"
    for name, text in filled.items():
        before = before.replace(f"@@{name}@@", text)
        after = after.replace(f"@@{name}@@", text)
    return (before + notice).encode(), after.encode()


def _data(scene: ScenePackage, info: SessionInfo, moments: Moments) -> dict[str, Any]:
    """Return the data that the page's own modules read, see `viewer/main.js`."""
    ends = {
        object_id: _last_pose(found.poses)
        for object_id, found in moments.objects.items()
        if found.poses.values
    }
    return {
        "format": "gaussiannexus viewer",
        "version": FORMAT_VERSION,
        "end_ms": moments.end_ms,
        "frame_ms": 1000.0 / info.fps,
        "world_from_file": WORLD_FROM_GLTF.quaternion().tolist(),
        "views": views_of(scene, first_places(scene, moments.moved, ends)),
        "room_part": "room",
        "objects": [
            {
                "id": item.object_id,
                "name": item.name,
                "part": f"object-{index}",
                "shadow_part": shadow_part(index),
                **_object_data(item.world_from_object, moments, item.object_id),
            }
            for index, item in enumerate(scene.objects)
        ],
        "people": [
            {
                "id": user_id,
                "role": person.role,
                "heads": _keys(person.heads),
                "rays": _keys(person.rays),
                "hands": [
                    {
                        "places": _keys(hand.places),
                        "palms": _keys(hand.palms),
                        "fingers": _keys(hand.fingers, decimals=FINGER_DECIMALS),
                    }
                    for hand in person.hands
                ],
            }
            for user_id, person in moments.people.items()
        ],
        "lines": [
            {
                "id": line_id,
                "colour": list(line.colour),
                "versions": [
                    [t_ms, np.round(points, DECIMALS).ravel().tolist()]
                    for t_ms, points in line.versions
                ],
            }
            for line_id, line in moments.lines.items()
        ],
        "events": [list(event) for event in moments.events],
    }


def _object_data(scanned: Pose, moments: Moments, object_id: str) -> dict[str, Any]:
    """Of an object that was never tracked: where the scan saw it."""
    found = moments.objects.get(object_id)
    if found is None or not found.poses.values:
        values = [*scanned.translation.tolist(), *scanned.quaternion().tolist()]
        return {"poses": {"t_ms": [0], "values": [values]}, "states": [], "stands_m": [values[2]]}
    return {
        "poses": _keys(found.poses),
        "states": [list(state) for state in found.states],
        "stands_m": _stands_m(found.poses, float(scanned.translation[2])),
    }


def _stands_m(keys: Keys, scanned_m: float) -> list[float]:
    """Heights at which an object has stood for a while: only there it casts a shadow."""
    ends_ms = [*keys.t_ms[1:], float("inf")]
    heights = [
        values[2]
        for values, from_ms, to_ms in zip(keys.values, keys.t_ms, ends_ms, strict=True)
        if values is not None and to_ms - from_ms > STOOD_MS
    ]
    return sorted({round(height, 2) for height in (scanned_m, *heights)})


def _keys(keys: Keys, *, decimals: int = DECIMALS) -> dict[str, Any]:
    rounded = [
        None if values is None else [round(value, decimals) for value in values]
        for values in keys.values
    ]
    return {"t_ms": keys.t_ms, "values": rounded}


def _last_pose(keys: Keys) -> Pose:
    values = keys.values[-1]
    assert values is not None
    return Pose.from_quaternion(values[3:], values[:3])
