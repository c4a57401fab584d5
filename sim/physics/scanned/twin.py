"""Physics of a scanned room: its surface stands still, objects and people move.

The other world, `sim/physics/world.py`, is a room of boxes.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.mesh import PhysicalObject
from scenes.pose import Pose
from sim.physics.clear_place import place_clear
from sim.physics.collision.contact import OBJECT_BIT
from sim.physics.collision.grid import Array
from sim.physics.collision.heights import height_below
from sim.physics.collision.static_geoms import OutOfSpares, StaticGeoms
from sim.physics.collision.surface import Change, Surface, rescanned
from sim.physics.engine import mujoco
from sim.physics.mouse_hand import MouseHand, push
from sim.physics.moving.air import set_drag
from sim.physics.moving.objects import add_object
from sim.physics.moving.people import People, PersonTarget
from sim.physics.moving.rest import is_at_rest
from sim.physics.moving.tracked import TrackedBodies
from sim.physics.moving.virtual import Virtual, add_virtual, size_m

STEP_NS = 2_000_000
STEP_S = STEP_NS * 1e-9
SUPPORT_GAP_M = 0.015
"""How far above an object's origin a surface may lie and still carry it: noise of a scan."""
WAKING_SPEED = 1e-9
"""Velocity that wakes a sleeping object, m/s and rad/s."""
DEEP_M = 0.005
"""Overlap of two objects at the start above which they are moved apart."""
PARTING_M_PER_S = 0.1
"""Speed at which they are."""
PARTING_STEPS = 500
"""Steps after which what still overlaps is left to physics."""
PARTED_M = 0.01
"""Way above which it is reported."""
STEPS_AWAKE = 11
"""Steps at rest after which MuJoCo lets an object sleep (its `mjMINAWAKE`, and the first one)."""


class Twin:
    """A MuJoCo model of a scanned room, its movable objects and virtual solids.

    Args:
        surface: what stands still.
        movables: objects, each where it is when physics begins.
        virtual: what exists in the physics alone.
        tracked: ids of movables that a tracker moves; the others are free.
        people: where each person starts, by person id; their hands hold what is free.
        notes: what had to be assumed to make the surface.

    Raises:
        ValueError: an id appears twice, or a tracked one is no movable's.
    """

    def __init__(
        self,
        surface: Surface,
        movables: Sequence[PhysicalObject],
        *,
        virtual: Sequence[Virtual] = (),
        tracked: Collection[str] = (),
        people: Mapping[str, PersonTarget] | None = None,
        notes: Sequence[str] = (),
    ) -> None:
        self._movables = {item.object_id: item for item in movables}
        self._virtual = {item.object_id: item for item in virtual}
        if len({*self._movables, *self._virtual}) < len(movables) + len(virtual):
            raise ValueError(f"ids {sorted([*self._movables, *self._virtual])}: one is double")
        unknown = set(tracked) - set(self._movables)
        if unknown:
            raise ValueError(f"tracked {sorted(unknown)}: known are {sorted(self._movables)}")
        self._tracked_ids = tuple(name for name in self._movables if name in tracked)
        self._people = People(people or {})
        self._hand = MouseHand()
        self._notes = tuple(notes)
        self._time_ns = 0
        self._is_begun = False
        self._compile(surface, {}, {})

    @property
    def t_ns(self) -> int:
        """Simulated time since the start."""
        return self._time_ns

    @property
    def notes(self) -> tuple[str, ...]:
        """Assumptions and changes at the start, a sentence each."""
        return self._notes

    @property
    def surface(self) -> Surface:
        """Static surface, with all edits so far."""
        return self._static.surface

    @property
    def object_ids(self) -> tuple[str, ...]:
        """Everything that can move, and the virtual ones that cannot."""
        return (*self._movables, *self._virtual)

    def step(self, duration_ns: int) -> None:
        """Let `duration_ns` pass, in steps of 2 ms (a remainder is left out).

        Raises:
            ValueError: the state is no longer finite.
        """
        count = duration_ns // STEP_NS
        self._time_ns += count * STEP_NS
        while count > 0 and (
            self._static.is_rising or self._tracked.is_moving or self._hand.object_id is not None
        ):
            if self._static.is_rising:
                self._static.rise(self._model, self._data, dt_s=STEP_S)
                self._wake()
            self._tracked.advance(self._model, self._data, dt_s=STEP_S)
            self._hand.apply(self._model, self._data)
            mujoco.mj_step(self._model, self._data)
            count -= 1
        if count > 0:
            mujoco.mj_step(self._model, self._data, nstep=count)
        if not (np.isfinite(self._data.qpos).all() and np.isfinite(self._data.qvel).all()):
            raise ValueError(f"physics at {self._time_ns * 1e-9:.3f} s: a pose is not finite")

    def part_overlaps(self) -> None:
        """Before the start, move objects gently apart that overlap; `notes` then say which."""
        before = self.object_poses()
        for _ in range(PARTING_STEPS):
            if float(min(self._data.contact.dist, default=0.0)) > -DEEP_M:
                break
            self._wake()
            mujoco.mj_step(self._model, self._data)
            fast = np.maximum(np.abs(self._data.qvel) / PARTING_M_PER_S, 1.0)
            self._data.qvel[:] /= fast
        self._data.qvel[:] = 0.0
        mujoco.mj_forward(self._model, self._data)
        for name, pose in self.object_poses().items():
            way = float(np.linalg.norm(pose.translation - before[name].translation))
            if way > PARTED_M:
                text = f"{name}: moved by {100 * way:.0f} cm, it overlapped what stands beside it"
                self._notes = (*self._notes, text)

    def move_people(self, targets: Mapping[str, PersonTarget]) -> None:
        """Set what every named person wants from now on.

        Raises:
            KeyError: no such person, or a hand holds an object that isn't there or isn't free.
        """
        if self._people.move(targets):
            self._wake()

    def hand_position(self, person_id: str, hand: str) -> Array:
        """(3,) world metres: where a hand has really got to."""
        return self._people.hand_position(person_id, hand)

    def support_height(self, position: Array) -> float:
        """Height of the highest level surface of the room at or below a point (3,), metres."""
        return height_below(self.surface, position, gap_m=SUPPORT_GAP_M)

    def object_pose(self, object_id: str) -> Pose:
        """`world_from_object`; a primitive's origin is its centre."""
        body = self._model.body(object_id).id
        return Pose.from_quaternion(self._data.xquat[body], self._data.xpos[body])

    def object_poses(self) -> dict[str, Pose]:
        """`world_from_object` of everything, by id."""
        return {name: self.object_pose(name) for name in self.object_ids}

    def size_m(self, object_id: str) -> tuple[float, float, float]:
        """Sides of the box around an object, in its own frame."""
        item = self._movables.get(object_id)
        return size_m(self._virtual[object_id]) if item is None else item.box_m

    def speed(self, object_id: str) -> float:
        """How fast a free object's origin moves, m/s."""
        return float(np.linalg.norm(self._free_joint(object_id).qvel[:3]))

    @property
    def is_at_rest(self) -> bool:
        """Whether nothing moves, and nothing is pulled."""
        return self._hand.object_id is None and is_at_rest(self._model, self._data)

    def place(self, object_id: str, world_from_object: Pose) -> Pose:
        """See `place_clear`."""
        placed = place_clear(object_id, world_from_object, model=self._model, data=self._data)
        self._wake()
        return placed

    def pull(
        self,
        object_id: str,
        point_in_object: Array,
        target_in_world: Array,
        *,
        turn_rad: float = 0.0,
    ) -> None:
        """See `MouseHand.pull`."""
        self._hand.pull(
            object_id, point_in_object, target_in_world,
            turn_rad=turn_rad, model=self._model, data=self._data,
        )  # fmt: skip
        self._wake()

    def release(self) -> str | None:
        """See `MouseHand.release`."""
        self._wake()
        return self._hand.release(self._model, self._data)

    def push(self, object_id: str, point_in_world: Array, impulse_ns: Array) -> None:
        """See `sim.physics.mouse_hand.push`."""
        push(object_id, point_in_world, impulse_ns, model=self._model, data=self._data)
        self._wake()

    def throw(self, object_id: str, velocity: Array, *, spin: Array | None = None) -> None:
        """Give a free object a velocity (3,), m/s, and a spin (3,) in its own frame, rad/s."""
        joint = self._free_joint(object_id)
        joint.qvel[:3] = velocity
        joint.qvel[3:] = 0.0 if spin is None else spin
        self._wake()

    def follow(self, poses: Mapping[str, Pose], *, within_ns: int) -> None:
        """Let tracked objects be at given poses `within_ns` from now (one frame of the tracker).

        Raises:
            KeyError: one isn't tracked.
            ValueError: no time is left.
        """
        self._tracked.aim(poses, self._model, self._data, within_s=within_ns * 1e-9)
        self._wake()

    def set_friction(self, object_id: str, friction: float) -> None:
        """Change an object's sliding friction while it runs."""
        _check_positive(object_id, "friction", friction)
        item = self._movables.get(object_id)
        if item is not None:
            self._movables[object_id] = replace(item, friction=friction)
        else:
            solid = self._virtual[object_id]
            self._virtual[object_id] = replace(solid, friction=friction)
        body = self._model.body(object_id).id
        self._model.geom_friction[self._model.geom_bodyid == body, 0] = friction
        self._wake()

    def set_mass(self, object_id: str, mass_kg: float) -> None:
        """Change a free object's mass while it runs; its inertia goes with it."""
        _check_positive(object_id, "mass", mass_kg)
        self._free_joint(object_id)
        body = int(self._model.body(object_id).id)
        share = mass_kg / float(self._model.body_mass[body])
        item = self._movables.get(object_id)
        if item is not None:
            self._movables[object_id] = replace(item, mass_kg=mass_kg)
        else:
            solid = self._virtual[object_id]
            self._virtual[object_id] = replace(solid, mass_kg=mass_kg)
        self._model.body_mass[body] = mass_kg
        self._model.body_inertia[body] *= share
        set_drag(self._model, body)
        mujoco.mj_setConst(self._model, mujoco.MjData(self._model))
        self._wake()

    def add_virtual(self, item: Virtual) -> None:
        """Add a virtual object; the model is compiled anew, and everything else goes on as it was.

        Raises:
            ValueError: its id is taken.
        """
        if item.object_id in self.object_ids:
            raise ValueError(f"virtual {item.object_id!r}: the id is taken")
        poses, speeds = self._state()
        self._virtual[item.object_id] = item
        self._compile(self.surface, poses, speeds)

    def remove_virtual(self, object_id: str) -> None:
        """Take a virtual object away.

        Raises:
            KeyError: no such virtual object.
        """
        del self._virtual[object_id]
        poses, speeds = self._state()
        self._compile(self.surface, poses, speeds)

    def rescan(self, region_m: Array, triangles: Array) -> None:
        """Replace the surface in a box (2, 3) of the world by triangles (T, 3, 3), while it runs.

        What stands on it stays; what a new surface appears in is moved out gently.
        """
        self.apply(rescanned(self.surface, region_m, triangles))

    def apply(self, change: Change) -> None:
        """Exchange the surface; `rescanned` may have worked the change out on another thread.

        Raises:
            ValueError: the surface has changed since.
        """
        if change.before is not self.surface:
            raise ValueError("change of a surface that is no longer there; work it out anew")
        try:
            self._static.apply(change, self._model, self._data, movable=self._free_geoms)
        except OutOfSpares:
            poses, speeds = self._state()
            self._compile(change.surface, poses, speeds)
        self._wake()

    def _compile(
        self, surface: Surface, poses: Mapping[str, Pose], speeds: Mapping[str, Array]
    ) -> None:
        """Build the model; what has a pose begins there, what has a speed with it."""
        spec = mujoco.MjSpec()
        _set_options(spec)
        self._static = StaticGeoms(spec, surface)
        for name, item in self._movables.items():
            pose = poses.get(name, item.world_from_object)
            add_object(spec, item, pose, is_tracked=name in self._tracked_ids, is_damped=False)
        for name, solid in self._virtual.items():
            add_virtual(spec, solid, poses.get(name, solid.world_from_object))
        is_held = [name for name in self._movables if name not in self._tracked_ids]
        is_held += [name for name, solid in self._virtual.items() if solid.mass_kg is not None]
        self._people.add_to(spec, is_held)
        self._model: Any = spec.compile()
        self._data: Any = mujoco.MjData(self._model)
        self._static.bind(self._model)
        is_free = self._model.geom_contype == OBJECT_BIT
        self._free_geoms: NDArray[np.int64] = np.flatnonzero(is_free)
        self._tracked = TrackedBodies(self._tracked_ids, self._model, self._free_geoms)
        for body in range(self._model.nbody):
            set_drag(self._model, body)
        for name, speed in speeds.items():
            if name in self.object_ids:
                self._data.joint(f"{name}:free").qvel[:] = speed
        if self._is_begun:
            self._people.resume(self._model, self._data)
        else:
            self._people.begin(self._model, self._data)
        self._is_begun = True
        mujoco.mj_forward(self._model, self._data)

    def _state(self) -> tuple[dict[str, Pose], dict[str, Array]]:
        """Poses of everything, and the speeds (6,) of what is free."""
        poses = {
            name: self.object_pose(name) for name in self.object_ids if self._is_compiled(name)
        }
        free = [name for name in poses if self._is_compiled(f"{name}:free", joint=True)]
        return poses, {name: self._data.joint(f"{name}:free").qvel.copy() for name in free}

    def _is_compiled(self, name: str, *, joint: bool = False) -> bool:
        kind = mujoco.mjtObj.mjOBJ_JOINT if joint else mujoco.mjtObj.mjOBJ_BODY
        return int(mujoco.mj_name2id(self._model, int(kind), name)) >= 0

    def _free_joint(self, object_id: str) -> Any:
        if not self._is_compiled(f"{object_id}:free", joint=True):
            raise KeyError(f"{object_id!r} is not free; ids are {sorted(self.object_ids)}")
        return self._data.joint(f"{object_id}:free")

    def _wake(self) -> None:
        """Let everything that sleeps be looked at again."""
        # MuJoCo wakes what has got a velocity; this one moves nothing by a micrometre a minute.
        self._data.qvel[self._data.qvel == 0.0] = WAKING_SPEED
        # What is awake counts its steps at rest from -STEPS_AWAKE up: at -1 it would sleep before
        # it has begun to fall.
        is_awake = self._data.tree_asleep < 0
        self._data.tree_asleep[is_awake] = -STEPS_AWAKE


def _set_options(spec: Any) -> None:
    """As in `sim/physics/world.py`, and what rests is left out until something touches it."""
    spec.option.timestep = STEP_S
    spec.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    spec.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    spec.option.impratio = 10.0
    spec.option.noslip_iterations = 3
    # A reset would put everything back to its start without a word; `Twin.step` says so instead.
    spec.option.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_AUTORESET)
    spec.option.enableflags |= int(mujoco.mjtEnableBit.mjENBL_SLEEP)


def _check_positive(object_id: str, name: str, value: float) -> None:
    if not (math.isfinite(value) and value > 0.0):
        raise ValueError(f"{object_id}: {name} {value}, wanted a positive number")
