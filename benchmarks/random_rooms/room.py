"""A whole random room: plan, objects, camera, and the light of the scan and of the live day."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from benchmarks.random_rooms.finishes import (
    DARK,
    PATTERNED,
    PLAIN,
    add_highlight,
    add_scanned_highlight,
    random_finish,
)
from benchmarks.random_rooms.furniture import UNDER
from benchmarks.random_rooms.lighting import RoomLight, room_light
from benchmarks.random_rooms.movable import ATLAS_PX, FLOOR, SEAT, TOP, Movable, movable, part
from benchmarks.random_rooms.outlines import outline_of, overlaps, upright
from benchmarks.random_rooms.packed import book, carton, cereal_box, laptop, suitcase
from benchmarks.random_rooms.placing import STAND_HALF_M, Ground, ground_of, place_all
from benchmarks.random_rooms.plan import Plan, random_plan
from benchmarks.random_rooms.seats import armchair, dining_chair, stool, swivel_chair
from benchmarks.random_rooms.turned import ball, bottle, lamp, mug, plant_pot, side_table
from scenes.frames import look_at
from scenes.mesh import PhysicalObject, PhysicalRoom
from scenes.pose import Pose
from scenes.samples.pictures.atlas import mesh_from_surfaces
from scenes.samples.shapes import Surface

FloatArray = NDArray[np.float64]

LENS_SIZES_PX = (640, 960, 1280, 1440)
"""Sides of lens pictures that are drawn from."""

MIN_OBJECTS, MAX_OBJECTS = 6, 10
"""Objects in a room, twins included."""

TWIN_SHARE, LOOK_ALIKE_SHARE = 0.5, 0.3
"""How many rooms have a pair of twins, and how many another object of a family that is there."""

AMBIENT, KEY = 0.62, 0.55
"""Light on objects from all around and from the main light, against the room's level; the floor,
half of whose light comes from the lamps, is as bright."""

CAMERA_PLACES = 4
"""Free places for the camera that are compared; the one nearest to a table is taken. Small objects
stand on tables, and are judged only where the camera sees 24 px of them."""

CAMERA_MARGIN = 0.22
"""Share of the room's sides that the camera keeps from the walls: people put it in the middle."""

GRID = 14
"""Cells along a side of a cushion's face."""


@dataclass(frozen=True, slots=True, eq=False)
class RandomRoom:
    """A room by seed.

    Attributes:
        seed: that it was drawn with.
        scanned: as it was when it was scanned.
        live: the same room under the light of the day on which it is filmed.
        movables: by object id; twins share one.
        ground: where objects may stand.
        lens_px: side of each lens's picture.
    """

    seed: int
    scanned: PhysicalRoom
    live: PhysicalRoom
    movables: Mapping[str, Movable]
    ground: Ground
    lens_px: int

    def kind(self, object_id: str) -> str:
        """Name that an object shares with its twins."""
        return self.scanned.object_by_id(object_id).kind

    def seen_at(self, object_id: str, new_id: str, world_from_object: Pose) -> PhysicalObject:
        """An object as the camera sees it at a place: a shiny one with its highlight there.

        Args:
            object_id: of the room.
            new_id: what the result is called.
            world_from_object: where it stands.
        """
        item = self.movables[object_id]
        surfaces = item.surfaces
        if item.gloss > 0:
            middle = world_from_object.translation + np.array([0.0, 0.0, 0.5 * item.box_m[2]])
            halfway = _halfway(self.live.light_direction, self.ground.camera - middle)
            surfaces = add_highlight(surfaces, world_from_object.rotation.T @ halfway, item.gloss)
        mesh = mesh_from_surfaces(surfaces, width_px=ATLAS_PX)
        return item.physical(new_id, self.kind(object_id), world_from_object, mesh)


def random_room(seed: int) -> RandomRoom:
    """The room of a seed, always the same; takes some seconds.

    Raises:
        ValueError: the seed is negative.
    """
    if seed < 0:
        raise ValueError(f"random room {seed}: wanted a seed of 0 or more")
    of_plan, of_items, of_places, of_light = np.random.default_rng(seed).spawn(4)
    plan = random_plan(of_plan)
    camera = _camera(plan, of_places)
    ground = ground_of(plan, camera)
    wanted = random_items(of_items)
    poses = place_all(wanted, ground, of_places)
    items = {name: wanted[name] for name in poses}
    level = float(of_light.uniform(0.62, 0.98))
    light = room_light(plan.parts.surfaces, plan.lights, of_light, level=level)
    towards = _main_light(plan)
    view = Pose.from_yaw(float(of_places.uniform(-math.pi, math.pi))).rotation[:, 0]
    rig = look_at(camera, camera + view)
    scanned = _light(seed, plan, light, np.ones((len(plan.lights), 3)), rig, towards, level)
    every = tuple(
        _as_scanned(item, name, poses[name], _kind(name, items), towards)
        for name, item in items.items()
    )
    lamps, share, turned = _other_day(len(plan.lights), towards, of_light)
    live = _light(seed, plan, light, lamps, rig, turned, level * share)
    lens_px = int(of_places.choice(LENS_SIZES_PX))
    return RandomRoom(
        seed, replace(scanned, objects=every), replace(live, objects=every), items, ground, lens_px
    )


def random_items(rng: np.random.Generator) -> dict[str, Movable]:
    """Objects of different families, some with a twin or with another one of their family.

    Twins are named NAME-1 and NAME-2, others of a family NAME-b.
    """
    count = int(rng.integers(MIN_OBJECTS, MAX_OBJECTS + 1))
    names = [list(FAMILIES)[int(k)] for k in rng.permutation(len(FAMILIES))]
    twins = int(rng.random() < TWIN_SHARE) + int(rng.random() < TWIN_SHARE / 2)
    look_alikes = int(rng.random() < LOOK_ALIKE_SHARE)
    items: dict[str, Movable] = {}
    for number, family in enumerate(names[: count - twins - look_alikes]):
        made = FAMILIES[family](rng)
        if number < twins:
            items[f"{family}-1"] = items[f"{family}-2"] = made
        else:
            items[family] = made
        if number == twins and look_alikes:
            items[f"{family}-b"] = FAMILIES[family](rng)
    return items


def _kind(name: str, items: Mapping[str, Movable]) -> str:
    """Twins share a kind, others have one of their own."""
    item = items[name]
    has_twin = any(other is item for n, other in items.items() if n != name)
    return item.family if has_twin else name


def _as_scanned(
    item: Movable, name: str, pose: Pose, kind: str, towards: FloatArray
) -> PhysicalObject:
    up = np.array([0.0, 0.0, 1.0])
    halfway = pose.rotation.T @ _halfway(towards, up)
    surfaces = add_scanned_highlight(item.surfaces, halfway, item.gloss)
    return item.physical(name, kind, pose, mesh_from_surfaces(surfaces, width_px=ATLAS_PX))


def _light(
    seed: int,
    plan: Plan,
    light: RoomLight,
    weights: FloatArray,
    rig: Pose,
    towards: FloatArray,
    level: float,
) -> PhysicalRoom:
    return PhysicalRoom(
        name=f"random-{seed}",
        static=(light.mesh(weights),),
        objects=(),
        solids=tuple(plan.parts.solids),
        light_direction=towards,
        world_from_rig=rig,
        ambient=AMBIENT * level,
        key=KEY * level,
        footprint_m=np.stack([plan.inside.low[:2], plan.inside.high[:2]]),
    )


def _other_day(
    lamps: int, towards: FloatArray, rng: np.random.Generator
) -> tuple[FloatArray, float, FloatArray]:
    """Weights (S, 3) of the lamps, the level of the light on objects, and where it comes from.

    Each lamp is up to a fifth brighter or darker than in the scan, and a little warmer or colder.
    """
    gain = np.exp(rng.uniform(-0.2, 0.2, (lamps, 1)))
    warmth = 1.0 + rng.uniform(-0.04, 0.04) * np.array([[1.0, 0.0, -1.0]])
    # Textures are scaled in linear light, objects in sRGB, whose exponent is about 2.2.
    level = float(gain.mean() ** (1 / 2.2))
    turned = towards + 0.25 * rng.normal(0, 1, 3)
    turned[2] = max(turned[2], 0.1)
    return gain * warmth, level, turned / np.linalg.norm(turned)


def _main_light(plan: Plan) -> FloatArray:
    """Unit vector from the middle of the room towards what lights it most: window and lamps."""
    middle = 0.5 * (plan.inside.low + plan.inside.high) * (1, 1, 0.4)
    total = np.zeros(3)
    for light in plan.lights:
        area = float(np.linalg.norm(np.cross(light.u, light.v)))
        towards = light.corner + 0.5 * (light.u + light.v) - middle
        square = float(towards @ towards)
        total += towards / math.sqrt(square) * area * light.radiance[1] / square
    return total / np.linalg.norm(total)


def _camera(plan: Plan, rng: np.random.Generator) -> FloatArray:
    """(3,) a free place for the camera's stand, among a few the one nearest to a table."""
    solids = [outline_of(box, Pose.identity()) for box in plan.parts.solids]
    size = (plan.inside.high - plan.inside.low)[:2]
    margin = np.maximum(CAMERA_MARGIN * size, 0.6)
    low, high = plan.inside.low[:2] + margin, plan.inside.high[:2] - margin
    tops = [np.add(s.low, s.high) / 2 for s in plan.stands if s.kind in (TOP, UNDER)]
    found: list[FloatArray] = []
    height = float(rng.uniform(0.85, 1.7))
    side = 2 * STAND_HALF_M
    for _ in range(400):
        at = rng.uniform(low, high)
        stand = upright((side, side, height + 0.1), Pose.from_yaw(0.0, (*at, 0.0)))
        if not any(overlaps(stand, solid, 0.1) for solid in solids):
            found.append(np.array([*at, height]))
            if len(found) == CAMERA_PLACES:
                break
    if not found:
        found.append(np.array([*(0.5 * (low + high)), height]))

    def distance(at: FloatArray) -> float:
        return min((float(np.linalg.norm(at[:2] - top)) for top in tops), default=0.0)

    return min(found, key=distance)


def _halfway(towards_light: FloatArray, towards_eye: FloatArray) -> FloatArray:
    total = towards_light / np.linalg.norm(towards_light) + towards_eye / np.linalg.norm(
        towards_eye
    )
    return total / max(float(np.linalg.norm(total)), 1e-9)


def cushion(rng: np.random.Generator) -> Movable:
    """A lying cushion, thick in the middle and flat at its seam."""
    finish = random_finish(rng, kinds=(PLAIN, PATTERNED, DARK))
    w = float(rng.uniform(0.34, 0.55))
    is_square = rng.random() < 0.5
    d = w if is_square else w * float(rng.uniform(0.6, 0.8))
    t = float(rng.uniform(0.1, 0.17))
    u = np.linspace(-1.0, 1.0, GRID + 1)
    x, y = np.meshgrid(u, u)
    bulge = ((1 - np.abs(x) ** 3.2) * (1 - np.abs(y) ** 3.2)) ** 0.5
    # Sides bend inwards between the corners, as they do on a filled cover.
    rim = np.maximum(np.abs(x), np.abs(y)) ** 4
    inward = 1.0 - 0.07 * rim * (1.0 - np.abs(x * y))
    px, py = 0.5 * w * x * inward, 0.5 * d * y * inward
    upper = np.stack([px, py, 0.5 * t * bulge], axis=2)[::-1]
    lower = np.stack([px, py, -0.5 * t * bulge], axis=2)
    surfaces = [
        Surface(upper, finish.material(w, d)),
        Surface(lower, finish.material(w, d)),
    ]
    even = 4 if is_square else 2
    return movable(
        "cushion", surfaces, [part((0.0, 0.0, 0.0), (0.42 * w, 0.42 * d, t / 2))], finish=finish,
        mass_kg=0.6, symmetry=even if finish.is_even else 1, on=(FLOOR, SEAT),
    )  # fmt: skip


Build = Callable[[np.random.Generator], Movable]
"""A random member of one family."""

FAMILIES: Mapping[str, Build] = {
    "swivel-chair": swivel_chair,
    "dining-chair": dining_chair,
    "armchair": armchair,
    "stool": stool,
    "side-table": side_table,
    "suitcase": suitcase,
    "carton": carton,
    "cushion": cushion,
    "plant-pot": plant_pot,
    "lamp": lamp,
    "laptop": laptop,
    "bottle": bottle,
    "cereal-box": cereal_box,
    "book": book,
    "mug": mug,
    "ball": ball,
}
