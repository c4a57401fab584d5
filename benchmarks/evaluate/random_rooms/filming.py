"""Pictures of a random room with their truth, drawn from its meshes by the simulated camera."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.evaluate.answers import Visibility
from benchmarks.evaluate.filmed.conditions import Conditions
from benchmarks.evaluate.filmed.filming import FilmSet, Shot
from benchmarks.evaluate.filmed.takes import Take, TakeCache
from benchmarks.evaluate.random_rooms.staging import Moment, Staged
from benchmarks.random_rooms.room import RandomRoom
from devices.messages import Frame
from scenes.cameras import Rig
from scenes.mesh import PhysicalObject
from scenes.pose import Pose
from sim.bodies import Placement

NOISE = (0.7, 1.8)
"""Least and most sensor noise of a room, against the simulated sensor's own."""


@dataclass(frozen=True, slots=True, eq=False)
class Picture:
    """One picture and what is true of it.

    Attributes:
        moment: what stands where.
        frame: as the tracker gets it, but for the camera pose, which is exact here.
        visible: by object id.
        masks: by object id, one (H, W) per lens.
    """

    moment: Moment
    frame: Frame
    visible: Mapping[str, Visibility]
    masks: Mapping[str, tuple[NDArray[np.bool_], ...]]


class RoomFilm:
    """Everything that was filmed in a room.

    Args:
        room: what is filmed, under its live light.
        staged: what stands where.
        cache: where takes are kept.
        advance: is called with the share that is filmed, 0..1.
    """

    def __init__(
        self,
        room: RandomRoom,
        staged: Staged,
        *,
        cache: TakeCache,
        advance: Callable[[float], None],
    ) -> None:
        self._room = room
        self._staged = staged
        shown, self._names = _as_seen(room, staged)
        live = replace(room.live, objects=tuple(shown))
        self._by_name = {item.object_id: item for item in shown}
        conditions = Conditions(
            lens_size_px=room.lens_px,
            noise=float(np.random.default_rng([room.seed, 3]).uniform(*NOISE)),
        )
        takes = [[moment] for moment in staged.stills] + [list(staged.sequence)]
        self._takes: list[Take] = []
        with FilmSet(live, staged.people, cache=cache) as film_set:
            for number, moments in enumerate(takes):
                shots = [self._shot(moment) for moment in moments]
                begun = number / len(takes)
                self._takes.append(
                    film_set.film(
                        shots,
                        conditions,
                        seed=1000 * room.seed + number,
                        advance=lambda share, begun=begun: advance(begun + share / len(takes)),
                    )
                )

    def still(self, number: int) -> Picture:
        """One of the stills."""
        return next(self._pictures([self._staged.stills[number]], self._takes[number]))

    def sequence(self) -> Iterator[Picture]:
        """The pictures of the sequence, in order."""
        return self._pictures(self._staged.sequence, self._takes[-1])

    def _shot(self, moment: Moment) -> Shot:
        placements: dict[str, Placement] = {}
        for object_id, pose in moment.objects.items():
            z = float(pose.translation[2])
            # In the air, a shadow falls onto the floor.
            is_carried = moment.people and z not in self._heights()
            placements[self._names[moment.name, object_id]] = Placement(
                (pose,), 0.0 if is_carried else z
            )
        return Shot(moment.t_ns, {**placements, **moment.people})

    def _heights(self) -> set[float]:
        return {0.0, *(stand.z for stand in self._room.ground.stands)}

    def _pictures(self, moments: Sequence[Moment], take: Take) -> Iterator[Picture]:
        messages = take.play(self._room.live.world_from_rig)
        for moment, message in zip(moments, messages, strict=True):
            truth = message.truth
            if truth is None or truth.masks is None:
                raise ValueError(f"picture {moment.name}: the take has no truth; film it again")
            visible: dict[str, Visibility] = {}
            masks: dict[str, tuple[NDArray[np.bool_], ...]] = {}
            for object_id, pose in moment.objects.items():
                name = self._names[moment.name, object_id]
                width = width_px(self._by_name[name], pose, message.frame.rig, self._room)
                fraction = truth.recorded.visible_fraction[name]
                visible[object_id] = Visibility(fraction, width if fraction > 0 else 0.0)
                masks[object_id] = truth.masks[name]
            yield Picture(moment, message.frame, visible, masks)


def width_px(item: PhysicalObject, world_from_object: Pose, rig: Rig, room: RandomRoom) -> float:
    """Width of an object alone in the lens that sees it best; 0 where none does."""
    world_from_rig = room.live.world_from_rig
    points = np.concatenate([world_from_object @ mesh.vertices for mesh in item.meshes])
    widths: list[tuple[int, float]] = []
    for lens, rig_from_lens in zip(rig.lenses, rig.rig_from_lens, strict=True):
        pixels, valid = lens.project((world_from_rig @ rig_from_lens).inverse() @ points)
        if valid.any():
            widths.append((int(valid.sum()), float(np.ptp(pixels[valid, 0]))))
    return max(widths)[1] if widths else 0.0


def _as_seen(
    room: RandomRoom, staged: Staged
) -> tuple[list[PhysicalObject], dict[tuple[str, str], str]]:
    """Objects as they are drawn, and the name of each in each picture.

    What shines has a highlight of its own in every still, and one throughout the sequence.
    """
    shown: list[PhysicalObject] = []
    names: dict[tuple[str, str], str] = {}
    for object_id, item in room.movables.items():
        sequence_pose = staged.sequence[0].objects[object_id]
        shown.append(room.seen_at(object_id, object_id, sequence_pose))
        for moment in staged.sequence:
            names[moment.name, object_id] = object_id
        for moment in staged.stills:
            name = object_id
            if item.gloss > 0:
                name = f"{object_id}-still-{moment.name}"
                shown.append(room.seen_at(object_id, name, moment.objects[object_id]))
            names[moment.name, object_id] = name
    return shown, names
