"""Patches and planes in a MuJoCo model, and their exchange while it runs.

Beside the patches the model has spare boxes that collide with nothing. A patch that goes becomes
a spare, a spare becomes a patch; nothing is compiled anew until the spares are used up.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.physics.collision.contact import (
    CONTACT_TIME_S,
    FLOOR_HALF_SIZE_M,
    ROOM_FRICTION,
    STATIC_BIT,
)
from sim.physics.collision.grid import Array
from sim.physics.collision.limits import Plane
from sim.physics.collision.overlap import depths_in_patches, way_out
from sim.physics.collision.patches import Patches
from sim.physics.collision.surface import Change, Surface
from sim.physics.engine import Spec, mujoco

MIN_SPARES = 600
"""Boxes kept for edits: a new surface of 0.5 m takes up to a hundred."""
SPARE_SHARE = 0.1
"""And as a share of the patches."""
SPARE_HALF_M = 0.001
RISE_M_PER_S = 0.2
"""Speed at which a new surface lifts or pushes what it appears in, instead of flinging it."""
TOLERATED_M = 0.0005
"""Overlap with a new surface that physics may resolve at once: what a resting object sinks."""


class OutOfSpares(RuntimeError):
    """There are more patches than boxes; the model has to be compiled anew."""


class StaticGeoms:
    """Static geometry as geoms of a model.

    Args:
        spec: the model that is built; they are added to it.
        surface: patches and planes.
    """

    def __init__(self, spec: Spec, surface: Surface) -> None:
        self._surface = surface
        patches = surface.patches
        spares = max(MIN_SPARES, round(SPARE_SHARE * len(patches)))
        for index, plane in enumerate(surface.planes):
            _add_plane(spec, f"plane-{index}", plane)
        position, quaternion, size = _boxes(patches, np.zeros(len(patches)))
        for k in range(len(patches)):
            _add_box(spec, f"patch-{k}", (position[k], quaternion[k], size[k]))
        # A spare waits under the floor's middle, where a broad phase finds no object.
        below = np.array([0.0, 0.0, min((p.offset_m for p in surface.planes), default=0.0) - 1.0])
        unused = (below, np.array([1.0, 0.0, 0.0, 0.0]), np.full(3, SPARE_HALF_M))
        for k in range(len(patches), len(patches) + spares):
            _add_box(spec, f"patch-{k}", unused)
        self._slots = np.arange(len(patches))
        self._free = list(range(len(patches) + spares - 1, len(patches) - 1, -1))
        self._first = -1
        self._lowered: dict[int, float] = {}
        self._waiting: set[int] = set()
        self._movable = np.zeros(0, dtype=np.int64)

    @property
    def surface(self) -> Surface:
        """As it is now."""
        return self._surface

    @property
    def spares(self) -> int:
        """How many boxes are left for new patches."""
        return len(self._free)

    @property
    def is_rising(self) -> bool:
        """Whether a new surface is still on its way to its place, so `rise` is wanted."""
        return bool(self._lowered or self._waiting)

    def bind(self, model: Any) -> None:
        """Look the geoms up in the compiled model."""
        self._first = model.geom("patch-0").id
        # Geoms that touch nothing when the model is compiled never will, so they learn it here.
        model.geom_contype[self._first + np.array(self._free)] = 0

    def apply(self, change: Change, model: Any, data: Any, *, movable: NDArray[np.int64]) -> None:
        """Exchange the patches.

        A new patch in which an object stands begins behind it and comes on at `RISE_M_PER_S`; one
        that would push it back in waits until it is out.

        Args:
            change: from the present surface.
            model: compiled with these geoms.
            data: its state; sleeping objects have to be woken by the caller.
            movable: geoms that may stand where a new patch is.

        Raises:
            OutOfSpares: nothing was changed.
        """
        fresh = change.fresh
        gone = np.ones(len(self._slots), dtype=np.bool_)
        gone[change.kept] = False
        freed = self._slots[gone].tolist()
        if len(fresh) > len(self._free) + len(freed):
            raise OutOfSpares(f"{len(fresh)} new patches, {len(self._free) + len(freed)} boxes")
        self._free.extend(reversed(freed))
        taken = np.array([self._free.pop() for _ in range(len(fresh))], dtype=np.int64)
        kept = self._slots[change.kept]
        self._surface, self._slots = change.surface, np.concatenate([kept, taken])
        for slot in freed:
            self._lowered.pop(slot, None)
            self._waiting.discard(slot)
        off = self._first + np.setdiff1d(np.array(freed, dtype=np.int64), taken)
        model.geom_contype[off] = 0
        model.geom_size[off] = SPARE_HALF_M
        patches = change.surface.patches
        rows = np.concatenate([np.flatnonzero(change.rethought), len(kept) + np.arange(len(fresh))])
        if len(rows):
            self._write(model, data, self._slots[rows], patches.chosen(rows), at_once=True)
        # The bounds that collisions are found by; on a scratch state, it is left at the start.
        mujoco.mj_setConst(model, mujoco.MjData(model))
        out = way_out(fresh, model, data, movable, tolerated_m=TOLERATED_M)
        self._lowered.update(
            (slot, m) for slot, m in zip(taken.tolist(), out.lowered_m.tolist(), strict=True) if m
        )
        self._waiting |= set(taken[out.is_waiting].tolist())
        self._movable = movable
        self.rise(model, data, dt_s=0.0)

    def rise(self, model: Any, data: Any, *, dt_s: float) -> None:
        """Let new surfaces that something stood in come on by `dt_s`."""
        moving = np.array(sorted(self._lowered.keys() | self._waiting), dtype=np.int64)
        if not len(moving):
            return
        patches = self._surface.patches.chosen(_rows_of(moving, self._slots))
        left = np.array([self._lowered.get(slot, 0.0) for slot in moving.tolist()])
        left = np.maximum(left - RISE_M_PER_S * dt_s, 0.0)
        self._write(model, data, moving, patches, lowered_m=left)
        self._lowered = {s: m for s, m in zip(moving.tolist(), left.tolist(), strict=True) if m}
        depths, backs = depths_in_patches(patches, model, data, self._movable)
        is_in = (np.minimum(depths, backs) > TOLERATED_M).any(axis=1)
        self._waiting &= set(moving[is_in].tolist())
        waiting = np.array(sorted(self._waiting), dtype=np.int64)
        model.geom_contype[self._first + waiting] = 0

    def _write(
        self,
        model: Any,
        data: Any,
        slots: NDArray[np.int64],
        patches: Patches,
        *,
        lowered_m: Array | None = None,
        at_once: bool = False,
    ) -> None:
        """Put boxes where patches are; bounds are the caller's."""
        lowered = np.zeros(len(patches)) if lowered_m is None else lowered_m
        position, quaternion, size = _boxes(patches, lowered)
        geoms = self._first + slots
        model.geom_pos[geoms] = position
        model.geom_size[geoms] = size
        model.geom_contype[geoms] = STATIC_BIT
        # Where static objects sleep their places are not worked out again.
        data.geom_xpos[geoms] = position
        if at_once:
            model.geom_quat[geoms] = quaternion
            data.geom_xmat[geoms] = patches.world_from_patch.reshape(-1, 9)


def _boxes(patches: Patches, lowered_m: Array) -> tuple[Array, Array, Array]:
    """Position (N, 3), quaternion (N, 4) and half size (N, 3) of the bodies behind the faces.

    The face is `lowered_m` (N,) behind its place; the back stays, as long as the face is before it.
    """
    thickness = np.maximum(patches.depth_m - lowered_m, 2.0 * SPARE_HALF_M)
    position = patches.centre - patches.normal * (lowered_m + 0.5 * thickness)[:, None]
    quaternion = np.empty((len(patches), 4))
    for k, rotation in enumerate(patches.world_from_patch):
        mujoco.mju_mat2Quat(quaternion[k], rotation.ravel())
    half = np.maximum(patches.half_m, SPARE_HALF_M)
    return position, quaternion, np.column_stack([half, 0.5 * thickness])


def _rows_of(slots: NDArray[np.int64], all_slots: NDArray[np.int64]) -> NDArray[np.int64]:
    """Row of each of some slots among all of them."""
    order = np.argsort(all_slots)
    return order[np.searchsorted(all_slots, slots, sorter=order)]


def _add_box(spec: Spec, name: str, box: tuple[Array, Array, Array]) -> None:
    position, quaternion, size = box
    spec.worldbody.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_BOX,
        pos=position.tolist(),
        quat=quaternion.tolist(),
        size=size.tolist(),
        friction=list(ROOM_FRICTION),
        solref=[CONTACT_TIME_S, 1.0],
        contype=STATIC_BIT,
        conaffinity=0,
    )


def _add_plane(spec: Spec, name: str, plane: Plane) -> None:
    normal = np.asarray(plane.normal)
    quaternion = np.empty(4)
    mujoco.mju_quatZ2Vec(quaternion, normal)
    spec.worldbody.add_geom(
        name=name,
        type=mujoco.mjtGeom.mjGEOM_PLANE,
        pos=(normal * plane.offset_m).tolist(),
        quat=quaternion.tolist(),
        size=[FLOOR_HALF_SIZE_M, FLOOR_HALF_SIZE_M, 0.1],
        friction=list(ROOM_FRICTION),
        solref=[CONTACT_TIME_S, 1.0],
        contype=STATIC_BIT,
        conaffinity=0,
    )
