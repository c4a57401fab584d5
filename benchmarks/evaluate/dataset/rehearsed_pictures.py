"""A dataset's pictures as a rehearsal would show them: its courses, played in the scanned room."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from benchmarks.evaluate.dataset.layout import Dataset, Still, StillSet
from benchmarks.evaluate.dataset.preparing import PreparedDataset
from scenes.cameras import Rig
from scenes.mesh import PhysicalRoom
from scenes.pose import Pose
from sim.bodies import Placement, body_of_object
from sim.camera.camera360 import Camera360
from sim.camera.lens_picture import ScannedLook
from sim.people.figure import person_body
from sim.people.posture import SIDES, Posture, part_poses, resting_hand
from sim.reality.world_error import WorldError

PERSON = "person"
FIGURE_SEED = 0
"""Decides skin and clothes of the person: none of them is known."""


class RehearsedPictures:
    """Draws the stills of a dataset; see `benchmarks.evaluate.dataset.tracking.Pictures`.

    Camera and objects stand where they truly stood, as far as the scan is right. A dataset's
    pictures may have no noise; none is added.

    Args:
        dataset: whose courses are played.
        prepared: the product's copy of its room.
        room: what stands for the real one.
        look: draws it.
        error: of the scan's metric world. A dataset's world is laid on the prepared one by the
            cameras' places, so of its rigid part nothing is left.
    """

    def __init__(
        self,
        dataset: Dataset,
        prepared: PreparedDataset,
        room: PhysicalRoom,
        look: ScannedLook,
        *,
        error: WorldError,
    ) -> None:
        self._room = room
        self._look = look
        self._package_from_true = prepared.true_from_package.inverse()
        views = [view.world_from_camera.translation for view in prepared.package.views]
        self._scan_from_real = error.without_motion(np.array(views)).inverse()
        self._supports = {i.object_id: i.support_z_m for i in prepared.package.objects}
        self._cut_from_true: dict[str, Pose] = {}
        for item in prepared.package.objects:
            start = dataset.objects[item.object_id].world_from_object
            self._cut_from_true[item.object_id] = item.world_from_object.inverse() @ self._in_scan(
                start
            )
        self._cameras: dict[str, Camera360] = {}
        self._last: tuple[str, NDArray[np.uint8]] | None = None

    def __call__(self, pictures: StillSet, still: Still) -> NDArray[np.uint8]:
        """(H, W, 3) what the camera of a set sees of a still."""
        key = f"{pictures.name}/{still.name}"
        if self._last is None or self._last[0] != key:
            view = self._camera(pictures).view(self._placements(still))
            self._last = (key, view.lenses[0].rgb)
        return self._last[1]

    def close(self) -> None:
        """Free the cameras' windows."""
        for camera in self._cameras.values():
            camera.close()

    def _camera(self, pictures: StillSet) -> Camera360:
        if pictures.name not in self._cameras:
            bodies = [body_of_object(item) for item in self._room.objects]
            bodies.append(person_body(PERSON, np.random.default_rng(FIGURE_SEED)))
            self._cameras[pictures.name] = Camera360(
                self._room,
                Rig((pictures.lens,), (Pose.identity(),)),
                self._in_scan(pictures.world_from_camera),
                bodies,
                look=self._look,
            )
        return self._cameras[pictures.name]

    def _placements(self, still: Still) -> dict[str, Placement]:
        placements = {}
        for object_id, true_from_cut in self._cut_from_true.items():
            pose = self._in_scan(still.world_from_object[object_id]) @ true_from_cut.inverse()
            placements[object_id] = Placement((pose,), self._supports[object_id])
        if still.world_from_person is not None:
            stands = self._in_scan(still.world_from_person)
            placements[PERSON] = Placement(part_poses(_standing(stands)), 0.0)
        return placements

    def _in_scan(self, true_from_body: Pose) -> Pose:
        """Return the pose in the scan, whose world is off, of a true pose."""
        return self._scan_from_real.moved(self._package_from_true @ true_from_body)


def _standing(world_from_person: Pose) -> Posture:
    """A person who stands upright with hanging arms."""
    nowhere = np.zeros(3)
    at, yaw = world_from_person.translation[:2], world_from_person.yaw()
    still = Posture(at, yaw, 0.0, 0.0, 0.0, 0.0, nowhere, nowhere)
    left, right = (resting_hand(still, side) for side in SIDES)
    return Posture(at, yaw, 0.0, 0.0, 0.0, 0.0, left, right)
