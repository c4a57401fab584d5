"""Films what an evaluation stages: bodies at given places, drawn from the physical meshes."""

from __future__ import annotations

import hashlib
import zipfile
from collections.abc import Callable, Iterable, Mapping, Sequence, Set
from dataclasses import astuple, dataclass, replace
from pathlib import Path

import cv2
import numpy as np

from benchmarks.evaluate.filmed.conditions import Conditions
from benchmarks.evaluate.filmed.takes import (
    BODY_NUMBERS,
    RECORDING,
    Take,
    TakeCache,
    picture_name,
    source_digest,
)
from devices.recording import Recorder
from devices.recording_codec import FrameStamp, RecordedTruth
from devices.session_info import SessionInfo
from devices.video import H264Encoder
from scenes.cameras import Rig
from scenes.mesh import PhysicalRoom
from scenes.pose import Pose
from sim.bodies import Body, Placement, body_of_object
from sim.camera.camera360 import Camera360, default_rig
from sim.camera.sensor import Sensor
from sim.rehearsal import STREAM_ID
from studio.session.records.provenance import library_versions

ENCODER_FPS = 10.0
"""Pictures a second for which the encoder plans its bits, unless `fps` says otherwise. Chosen equal
for every pace, so that each picture gets the same bits."""

Advance = Callable[[float], None]
"""Takes the share of a take that is filmed, 0..1."""


@dataclass(frozen=True, slots=True, eq=False)
class Shot:
    """Arrangement of a room in which a picture is taken.

    Attributes:
        t_ns: capture time; grows from shot to shot.
        placements: by body id; a body that is not named is not in the room.
    """

    t_ns: int
    placements: Mapping[str, Placement]


def standing(world_from_object: Mapping[str, Pose]) -> Mapping[str, Placement]:
    """Placements of objects that stand where their origin is, by id."""
    return {
        name: Placement((pose,), float(pose.translation[2]))
        for name, pose in world_from_object.items()
    }


class FilmSet:
    """A room with a 360° camera in it. Use as a context manager; opens the camera when needed.

    Args:
        room: the physical room with the objects that may be in it.
        extras: further bodies, such as a screen to hide behind.
        cache: where takes are kept.
    """

    def __init__(
        self, room: PhysicalRoom, extras: Sequence[Body] = (), *, cache: TakeCache
    ) -> None:
        self.room = room
        self._bodies = (*(body_of_object(item) for item in room.objects), *extras)
        self._cache = cache
        self._camera: Camera360 | None = None
        self._contents = _digest_of_bodies(room.name, self._bodies)

    def film(
        self,
        shots: Sequence[Shot],
        conditions: Conditions,
        *,
        seed: int,
        advance: Advance,
        fps: float = ENCODER_FPS,
    ) -> Take:
        """The take of these shots, from the cache where it was filmed before.

        Args:
            shots: in order of time.
            conditions: of the sensor and the video; the pose error is not used here.
            seed: decides noise and drift.
            advance: called with the share that is filmed after every shot, 0..1.
            fps: pictures a second for which the encoder plans: it shares its bits among so many,
                and begins anew every two seconds.

        Raises:
            OSError: the cache cannot be written.
        """
        body_ids = tuple(body.body_id for body in self._bodies)
        key = self._key(shots, conditions, seed, fps)
        take = self._cache.find(key, body_ids)
        if take is None:
            with self._cache.filming(key) as folder:
                self._film(folder, shots, conditions, seed=seed, fps=fps, advance=advance)
            take = self._cache.find(key, body_ids)
        if take is None:
            raise OSError(f"the take {key} vanished from the cache while it was made")
        return take

    def close(self) -> None:
        """Free the camera's window."""
        if self._camera is not None:
            self._camera.close()
        self._camera = None

    def __enter__(self) -> FilmSet:
        return self

    def __exit__(self, *_rest: object) -> None:
        self.close()

    def _key(self, shots: Sequence[Shot], conditions: Conditions, seed: int, fps: float) -> str:
        digest = hashlib.sha256(source_digest() + self._contents)
        pictures_only = replace(conditions, pose_error_deg=0.0, pose_error_cm=0.0)
        digest.update(repr((astuple(pictures_only), seed, fps)).encode())
        for shot in shots:
            digest.update(str(shot.t_ns).encode())
            for name, placement in shot.placements.items():
                digest.update(f"{name}{placement.support_z_m}".encode())
                for pose in placement.world_from_part:
                    digest.update(pose.matrix().tobytes())
        return digest.hexdigest()[:24]

    def _film(
        self,
        folder: Path,
        shots: Sequence[Shot],
        conditions: Conditions,
        *,
        seed: int,
        fps: float,
        advance: Advance,
    ) -> None:
        camera = self._opened(conditions)
        camera.view({})  # an empty room: what was filmed before leaves no trace in this take
        size = conditions.lens_size_px
        sensor = Sensor(camera.rig, np.random.default_rng(seed), options=conditions.sensor())
        encoder = H264Encoder(
            len(camera.rig.lenses) * size,
            size,
            fps,
            round(conditions.bitrate_mbps * 1e6),
            stream_id=STREAM_ID,
        )
        info = _session_info(self.room.name, seed, camera.rig, fps)
        object_ids = {item.object_id for item in self.room.objects}
        first = _poses(shots[0], object_ids)
        before_ns = shots[0].t_ns
        with (
            zipfile.ZipFile(folder / BODY_NUMBERS, "w", zipfile.ZIP_STORED) as numbers,
            Recorder(folder / RECORDING, info) as recorder,
        ):
            for seq, shot in enumerate(shots):
                view = camera.view(shot.placements)
                dt_s = (shot.t_ns - before_ns) / 1e9
                images = sensor.expose([lens.rgb for lens in view.lenses], dt_s)
                even_ns = round(seq * 1e9 / fps)
                packet = encoder.encode(np.hstack(images), seq, even_ns)[0]
                stamp = FrameStamp(STREAM_ID, seq, shot.t_ns, shot.t_ns, camera.world_from_rig)
                recorder.write(stamp)
                recorder.write(replace(packet, t_ns=shot.t_ns))
                poses = _poses(shot, object_ids)
                moved = frozenset(name for name in poses if _is_elsewhere(name, poses, first))
                visible = {name: view.visible_fraction[name] for name in poses}
                recorder.write(
                    RecordedTruth(seq, shot.t_ns, poses, visible, moved, camera.world_from_rig)
                )
                for lens, seen in enumerate(view.lenses):
                    png = cv2.imencode(".png", seen.ids)[1].tobytes()
                    numbers.writestr(picture_name(seq, lens), png)
                before_ns = shot.t_ns
                advance((seq + 1) / len(shots))

    def _opened(self, conditions: Conditions) -> Camera360:
        """The camera with lenses of this size; opening it draws the empty room: seconds."""
        camera = self._camera
        if camera is None or camera.rig.lenses[0].width_px != conditions.lens_size_px:
            self.close()
            rig = default_rig(conditions.lens_size_px)
            camera = Camera360(self.room, rig, self.room.world_from_rig, self._bodies)
            self._camera = camera
        return camera


def _poses(shot: Shot, object_ids: Set[str]) -> dict[str, Pose]:
    return {
        name: placement.world_from_part[0]
        for name, placement in shot.placements.items()
        if name in object_ids
    }


def _is_elsewhere(name: str, poses: Mapping[str, Pose], first: Mapping[str, Pose]) -> bool:
    return name not in first or not np.allclose(
        poses[name].matrix(), first[name].matrix(), atol=1e-6
    )


def _session_info(room: str, seed: int, rig: Rig, fps: float) -> SessionInfo:
    return SessionInfo(
        scene=room,
        scene_hash="",
        seed=seed,
        scenario="",
        scenario_name="evaluation",
        mode="exact",
        methods=(),
        versions=library_versions(),
        rig=rig,
        fps=fps,
    )


def _digest_of_bodies(room: str, bodies: Iterable[Body]) -> bytes:
    digest = hashlib.sha256(room.encode())
    for body in bodies:
        digest.update(body.body_id.encode())
        for part in body.parts:
            for mesh in part.meshes:
                digest.update(mesh.vertices.tobytes() + mesh.faces.tobytes())
                digest.update(mesh.texture.tobytes())
    return digest.digest()
