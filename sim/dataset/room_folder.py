"""A simulated session in the form of docs/datasets.md: fisheye sequences with exact truth."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

import av
import numpy as np

from devices.messages import EncodedFrame
from scenes.cameras import Fisheye
from scenes.mesh import PhysicalRoom
from sim.camera.camera360 import default_rig
from sim.dataset.json_stream import DECIMALS, JsonList, matrix, write_json
from sim.dataset.pictures import write_labels, write_lengths, write_rgb
from sim.dataset.truth.lens_truth import LensTruth, LensTruthPass
from sim.dataset.truth.surfaces import joined, meshes_of_object, meshes_of_room, write_obj
from sim.dataset.truth.symmetry import yaw_symmetry
from sim.dataset.truth.visibility import OUTSIDE, Seen, seen
from sim.rehearsal import SimulatedStep
from sim.scenarios.scenario import Scenario

LENS_SETS = ("sequence", "sequence_back")
"""Folders of the front and the back lens; only the first has a meaning for `nexus evaluate`."""

RANGE_UNIT_M = 0.0005
"""Step of a range picture, metres: half of it is below any error that is judged, 65,535 of them
reach through a hall."""

CODE_CORNERS = np.array([[-0.5, 0.5, 0.0], [0.5, 0.5, 0.0], [0.5, -0.5, 0.0], [-0.5, -0.5, 0.0]])
"""(4, 3) in sides of a code: top left, top right, bottom right, bottom left to its reader."""

PERSON = "person"
"""Label of every person."""

Pictures = Literal["png", "jpg", "video"]


@dataclass(frozen=True, slots=True)
class FolderOptions:
    """How a session is written.

    Attributes:
        every: of so many frames, one is written.
        pictures: lossless, JPEG, or the camera's own video for both lenses.
    """

    every: int = 1
    pictures: Pictures = "png"


def write_sequences(
    folder: Path,
    room: PhysicalRoom,
    scenario: Scenario,
    steps: Iterator[SimulatedStep],
    *,
    options: FolderOptions,
) -> Iterator[int]:
    """Write frame after frame into `folder/fisheye`; yields how many are written.

    Raises:
        OSError: the disk is full.
    """
    rig = default_rig(scenario.camera.lens_size_px)
    with ExitStack() as stack:
        truth_pass = stack.enter_context(closing(LensTruthPass(room, rig)))
        video = None
        if options.pictures == "video":
            (folder / "fisheye").mkdir(parents=True)
            video = stack.enter_context(PacketFile(folder / "fisheye" / "video.mp4"))
        lists: tuple[JsonList, ...] = ()
        written, moved = 0, frozenset[str]()
        for index, step in enumerate(steps):
            if video is not None:
                video.add(step.packet)
            if index % options.every:
                continue
            recorded = step.truth.recorded
            moved |= recorded.moved
            moving = [*sorted(moved), *([PERSON] if step.truth.people else [])]
            truths = truth_pass.frame(
                recorded.world_from_rig, recorded.world_from_object, step.truth.people
            )
            if not lists:
                lists = tuple(
                    stack.enter_context(_truth_list(folder / "fisheye" / name, room, step, lens))
                    for name, lens in zip(LENS_SETS, truths, strict=False)
                )
            for number, target in enumerate(lists):
                target.add(_frame(folder, room, step, truths[number], number, index, options))
                target.tail = {"moving": moving}
            written += 1
            yield written


def _truth_list(
    folder: Path, room: PhysicalRoom, step: SimulatedStep, truth: LensTruth
) -> JsonList:
    for name in ("images", "masks", "silhouettes", "range"):
        (folder / name).mkdir(parents=True)
    return JsonList(
        folder / "truth.json",
        head={
            "set": folder.name,
            "camera": lens_to_json(truth.lens),
            "world_from_camera": matrix(truth.world_from_lens),
            "camera_axes": "OpenCV: x right, y down, z forward",
            "labels": labels_of(room),
            "range_unit_m": RANGE_UNIT_M,
            "first_t_ns": step.frame.t_ns,
        },
        key="frames",
    )


def _frame(
    folder: Path,
    room: PhysicalRoom,
    step: SimulatedStep,
    truth: LensTruth,
    lens: int,
    index: int,
    options: FolderOptions,
) -> dict[str, Any]:
    """Write a frame's pictures; returns its entry in truth.json."""
    name, place = f"f{step.frame.seq:05d}", folder / "fisheye" / LENS_SETS[lens]
    if options.pictures == "video":
        file = "../video.mp4"
    else:
        file = f"images/{name}.{options.pictures}"
        write_rgb(place / file, step.frame.images[lens])
    write_labels(place / "masks" / f"{name}.png", truth.ids)
    write_lengths(place / "range" / f"{name}.png", truth.range_m, RANGE_UNIT_M)
    visible: dict[str, Any] = {}
    for number, item in enumerate(room.objects, start=1):
        found = visibility(truth, item.object_id, number)
        visible[item.object_id] = seen_to_json(found)
        alone = truth.silhouettes.get(item.object_id)
        if alone is not None and found.pixels_alone:
            whole = truth.ids * 0
            whole[alone.rect.rows_columns] = alone.mask
            write_labels(place / "silhouettes" / f"{name}_{item.object_id}.png", 255 * whole)
    recorded = step.truth.recorded
    return {
        "name": name,
        "file": file,
        **({"video_frame": index} if options.pictures == "video" else {}),
        "time_s": step.frame.t_ns / 1e9,
        "world_from_camera": matrix(truth.world_from_lens),
        "world_from_object": {n: matrix(p) for n, p in recorded.world_from_object.items()},
        "visible": visible,
    }


def visibility(truth: LensTruth, object_id: str, number: int) -> Seen:
    """Counts and boxes of one object through one lens."""
    alone = truth.silhouettes.get(object_id)
    if alone is None:
        return OUTSIDE
    visible = truth.ids[alone.rect.rows_columns] == number
    return seen(alone.mask, visible & alone.mask, (alone.rect.x0, alone.rect.y0))


def seen_to_json(found: Seen) -> dict[str, Any]:
    """An object's entry under `visible`."""
    return {
        "fraction": round(found.fraction, 6),
        "pixels_unoccluded": found.pixels_alone,
        "pixels_visible": found.pixels_visible,
        "box_unoccluded": found.box_alone,
        "box_visible": found.box_visible,
    }


def labels_of(room: PhysicalRoom) -> dict[str, int]:
    """Label of every object, and of people."""
    names = [item.object_id for item in room.objects]
    return {name: 1 + k for k, name in enumerate([*names, PERSON])}


def lens_to_json(lens: Fisheye) -> dict[str, Any]:
    """`camera` of a truth.json."""
    return {
        "model": "equidistant",
        "formula": "r = f * theta (pixels from the principal point, radians from the axis)",
        "width": lens.width_px,
        "height": lens.height_px,
        "f_px": lens.f_px,
        "cx": lens.cx,
        "cy": lens.cy,
        "fov_deg": math.degrees(2 * lens.max_angle),
        "pixel_centre_of_top_left": [0.5, 0.5],
    }


def write_room(folder: Path, room: PhysicalRoom) -> None:
    """`objects.json`, `objects/`, `room.obj` and `qr.json`.

    Raises:
        WriteError: the disk is full.
    """
    (folder / "objects").mkdir(parents=True, exist_ok=True)
    entries: dict[str, Any] = {}
    for item in room.objects:
        meshes = meshes_of_object(item)
        surface, file = joined(meshes), f"objects/{item.object_id}.obj"
        write_obj(folder / file, surface)
        low, high = surface.vertices.min(axis=0), surface.vertices.max(axis=0)
        entries[item.object_id] = {
            "type": item.kind,
            "mesh": file,
            "box_min": low.round(6).tolist(),
            "box_max": high.round(6).tolist(),
            "dimensions": (high - low).round(6).tolist(),
            "world_from_object": matrix(item.world_from_object),
            "symmetry": yaw_symmetry(meshes),
            "mass_kg": item.mass_kg,
        }
    frame = "object frame: origin on the support plane, z up"
    write_json(folder / "objects.json", {"frame": frame, "objects": entries})
    write_obj(folder / "room.obj", joined(meshes_of_room(room)))
    write_json(folder / "qr.json", codes_to_json(room))


def codes_to_json(room: PhysicalRoom) -> dict[str, Any]:
    """`qr.json`: every code's corners; the last of several is kept aside to check with."""
    codes: dict[str, Any] = {}
    for number, code in enumerate(room.codes):
        corners = (code.world_from_code @ (code.side_m * CODE_CORNERS)).round(DECIMALS).tolist()
        is_check = 1 < len(room.codes) == number + 1
        codes[code.payload] = {
            "role": "check" if is_check else "alignment",
            "corners_world": corners,
        }
    sides = sorted({code.side_m for code in room.codes})
    return {"side_m": sides[0] if sides else 0.0, "codes": codes}


NANOSECONDS = 1_000_000_000


class PacketFile:
    """Keeps packets in a raw stream beside the video and puts them into it at the end.

    Use it in a `with`. Packets go to the disk at once; only their times are held.

    Args:
        path: the video, `.mp4`; its folder is there.
    """

    def __init__(self, path: Path) -> None:
        self._path, self._raw = path, path.with_suffix(".h264")
        self._file = self._raw.open("wb")
        self._times: list[int] = []

    def add(self, packet: EncodedFrame) -> None:
        """Append a packet of H.264 in Annex B."""
        self._file.write(packet.data)
        self._times.append(packet.t_ns)

    def __enter__(self) -> PacketFile:
        """The writer itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> Literal[False]:
        """Write the video if nothing went wrong; the raw stream goes in any case."""
        self._file.close()
        try:
            if kind is None and self._times:
                self._mux()
        finally:
            self._raw.unlink(missing_ok=True)
        return False

    def _mux(self) -> None:
        containers: Any = av
        with (
            containers.open(str(self._raw), "r", format="h264") as source,
            containers.open(str(self._path), "w") as target,
        ):
            track = target.add_stream_from_template(source.streams.video[0])
            packets = (packet for packet in source.demux(video=0) if packet.size)
            for packet, t_ns in zip(packets, self._times, strict=True):
                packet.stream = track
                packet.time_base = Fraction(1, NANOSECONDS)
                packet.pts = packet.dts = t_ns - self._times[0]
                target.mux(packet)
