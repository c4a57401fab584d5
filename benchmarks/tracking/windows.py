"""Labelled pictures of random rooms, as the tracker sees them, with every object's true pose.

The camera is located and the empty room learned as in a session, but beside objects at their true
poses: what is measured here of a part does not depend on what the rest of the tracker makes of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from benchmarks.evaluate.answers import Visibility
from benchmarks.evaluate.filmed.takes import TakeCache
from benchmarks.evaluate.random_rooms.filming import Picture, RoomFilm
from benchmarks.evaluate.random_rooms.scanning import scan_of
from benchmarks.evaluate.random_rooms.staging import staged
from benchmarks.random_rooms.room import random_room
from scenes.mesh import PhysicalObject
from scenes.package import ScenePackage
from scenes.pose import Pose
from scenes.render.native import NativeRenderer
from sim.rehearsal import off_by
from studio.evaluate.metrics import PoseError, pose_error
from tracking.background.images import LensExposures
from tracking.background.layers import LayerCache
from tracking.background.learning import Care, band_of, whole_lens
from tracking.camera.rig_state import RigState
from tracking.camera.rig_tracker import RigTracker, StandingObjects
from tracking.evidence.evidence import Neighbour, Scene
from tracking.model.object_model import TrackModel, make_model
from tracking.model.support_planes import FLOOR_M, support_planes_in

CAMERA_ERROR = (0.5, 1.0)
"""How far the camera's known pose is off, degrees and centimetres: as in random rooms."""

LEARN_PERIOD = 8
"""Pictures between two bands of the background that are learned, about as in a session."""


@dataclass(frozen=True, slots=True, eq=False)
class LabelledPicture:
    """A picture with what is true of it.

    Attributes:
        seed: of the room.
        session: name of the session it belongs to.
        seq: number in the session.
        t_ns: capture time.
        scene: as the tracker sees it.
        models: of all objects.
        poses: by object id, true `world_from_object` in the scan's world.
        visible: by object id.
        people: (N, 3) middles of the people in it, by person.
        moving: ids of the objects that people move in this session.
    """

    seed: int
    session: str
    seq: int
    t_ns: int
    scene: Scene
    models: tuple[TrackModel, ...]
    poses: Mapping[str, Pose]
    visible: Mapping[str, Visibility]
    people: tuple[NDArray[np.float64], ...]
    moving: tuple[str, ...]

    def neighbours(self, object_id: str) -> tuple[Neighbour, ...]:
        """All other objects where they truly are."""
        return tuple(
            (model, self.poses[model.object_id])
            for model in self.models
            if model.object_id != object_id
        )


class LabelledRoom:
    """A random room, scanned and filmed, of which labelled pictures are made.

    Args:
        seed: of the room.
        cache: where films are kept.
    """

    def __init__(self, seed: int, *, cache: TakeCache) -> None:
        self.room = random_room(seed)
        self._staged = staged(self.room)
        scan = scan_of(self.room)
        self._film = RoomFilm(self.room, self._staged, cache=cache, advance=lambda share: None)
        self._renderer = NativeRenderer()
        self._rig_tracker = RigTracker(scan.room, self._renderer)
        self._scan = scan
        self.models = tuple(make_model(item, self._renderer) for item in scan.objects)
        self._bounds_m = np.percentile(scan.room.means.astype(np.float64), [0.2, 99.8], axis=0)
        self._planes = support_planes_in(scan.room, scan.objects)
        self.support_heights_m = tuple(
            sorted({FLOOR_M, *(item.support_z_m for item in scan.objects)})
        )
        self._known = off_by(
            self.room.live.world_from_rig, np.random.default_rng([seed, 360]), *CAMERA_ERROR
        )
        self._true_from_scan = _true_from_scan(self.room.scanned.objects, scan)

    def error_of(
        self, object_id: str, *, world_from_found: Pose, world_from_true: Pose
    ) -> PoseError:
        """How far a pose in the scan's world is from the true one, the object's symmetry aside."""
        tie = self._true_from_scan[object_id]
        symmetry = self.room.movables[object_id].symmetry
        return pose_error(world_from_found @ tie, world_from_true @ tie, symmetry=symmetry)

    def stills(self) -> Iterator[LabelledPicture]:
        """The stills, each a session of its own: nothing of the live room is learned there."""
        for number in range(len(self._staged.stills)):
            yield next(self._session(f"still-{number}", iter([self._film.still(number)])))

    def sequence(self) -> Iterator[LabelledPicture]:
        """The pictures in which people move objects, in order."""
        return self._session("sequence", self._film.sequence())

    def _session(self, name: str, pictures: Iterator[Picture]) -> Iterator[LabelledPicture]:
        rig: RigState | None = None
        layers = LayerCache(MappingProxyType({}))
        for seq, picture in enumerate(pictures):
            frame = replace(picture.frame, world_from_rig=self._known)
            poses = {
                name: pose @ self._true_from_scan[name].inverse()
                for name, pose in picture.moment.objects.items()
            }
            layers = LayerCache(layers.kept())
            sources = tuple(model.source for model in self.models)
            care = Care.CAUTIOUS if seq == 0 else Care.LITTLE
            standing = StandingObjects(sources, poses, layers, care)
            rig = self._rig_tracker.locate(
                rig,
                frame,
                marker_world_from_rig=self._known,
                standing=standing,
                is_refined=True,
            )
            scene = Scene(
                frame,
                rig.calibration.world_from_rig,
                rig.calibration.sigma,
                rig.background,
                LensExposures(frame.images, rig.background),
                self._renderer,
                self._bounds_m,
                self._planes,
                layers,
                seq == 0,
            )
            yield LabelledPicture(
                self.room.seed,
                name,
                seq,
                picture.moment.t_ns,
                scene,
                self.models,
                poses,
                picture.visible,
                tuple(
                    np.mean([part.translation for part in person.world_from_part], axis=0)
                    for person in picture.moment.people.values()
                ),
                self._staged.moving,
            )
            rig = self._learned(rig, scene, standing=standing, seq=seq)

    def _learned(
        self, rig: RigState, scene: Scene, *, standing: StandingObjects, seq: int
    ) -> RigState:
        heights = [lens.height_px for lens in scene.frame.rig.lenses]
        if seq == 0:
            bands = [whole_lens(index, height) for index, height in enumerate(heights)]
        else:
            bands = [band_of(seq // LEARN_PERIOD, heights)] if seq % LEARN_PERIOD == 0 else []
        for band in bands:
            background = self._rig_tracker.learn(
                rig.background,
                scene.frame,
                standing,
                exposure=scene.exposures[band.lens],
                band=band,
            )
            rig = replace(rig, background=background)
        return rig


def _true_from_scan(
    true_objects: Sequence[PhysicalObject], scan: ScenePackage
) -> Mapping[str, Pose]:
    """By object, what ties its pose in the scan to its true one: a scan's world is off."""
    start = {item.object_id: item.world_from_object for item in true_objects}
    return {
        item.object_id: item.world_from_object.inverse() @ start[item.object_id]
        for item in scan.objects
    }
