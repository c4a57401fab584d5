"""`nexus bench physics`: how fast a scanned room's physics is, and whether anything gets out."""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from benchmarks.twin.scan_like import block, scan_like
from scenes.mesh import BoxPart, PhysicalObject
from scenes.pose import Pose
from sim.bodies import UNIT_BOX_CORNERS
from sim.physics.collision.surface import rescanned, surface_of
from sim.physics.scanned.twin import STEP_NS, Twin
from studio.console.rows import Row, as_json, as_table, at_least, at_most, exit_code

SEED = 1

SECOND_NS = 1_000_000_000

MOVABLES = 20

STEPS_BAR, REAL_TIME_BAR = 5_000.0, 3.0

EDIT_BAR_MS = 20.0

SUNK_BAR_MM, JITTER_BAR_MM, JUMP_BAR_MM = 5.0, 1.0, 5.0

THROWS, QUICK_THROWS = 1_000, 100

SLOWEST_M_PER_S, FASTEST_M_PER_S = 1.0, 8.0

SPIN_RAD_PER_S = 6.0

FLIGHT_NS, REST_NS = 2 * SECOND_NS, 2 * SECOND_NS

EDITS, EDIT_SIDE_M = 20, 0.5

Block = tuple[tuple[float, float, float], tuple[float, float, float]]

LOW_M, HIGH_M = (0.0, 0.0, 0.0), (6.0, 5.0, 2.8)
"""Inside of the walls."""

SCAN_EDGE_M = 0.066
"""Longest edge of a triangle that makes a scan of 200,000."""

SCAN_NOISE_M = 0.004
"""Of a headset's mesh, standard deviation along each axis."""

BOARD_M = 0.02

SHELF_X_M, SHELF_DEPTH_M = (0.5, 2.3), 0.32

BOARD_HEIGHTS_M = (0.1, 0.5, 0.9, 1.3, 1.7, 2.1)

TABLE_TOP_M = 0.74

DENSITY_KG_PER_M3 = 300.0
"""Of what is thrown: a full carton."""

SMALLEST_M, LARGEST_M = 0.06, 0.3


@dataclass(frozen=True, slots=True)
class Thrown:
    """Results of many throws.

    Attributes:
        escaped: how many ended or were seen outside the room.
        sunk_mm: of each thing at rest, how deep it is in the exact room.
        jitter_mm: of each thing, how far it still moves in a tenth of a second at the end.
    """

    escaped: int
    sunk_mm: NDArray[np.float64]
    jitter_mm: NDArray[np.float64]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Flags of the verb."""
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    parser.add_argument("--quick", action="store_true", help=f"only {QUICK_THROWS} throws")


def run(args: argparse.Namespace) -> int:
    """Measure and print; 1 if a figure missed its bar."""
    rows = measure(throws=QUICK_THROWS if args.quick else THROWS)
    if args.json:
        print(json.dumps(as_json("bench physics", rows, SEED), indent=2))
    else:
        print(as_table(rows))
    return exit_code(rows)


def measure(*, throws: int) -> list[Row]:
    """All figures of a room of 200,000 triangles."""
    rng = np.random.default_rng(SEED)
    triangles = scanned_room(SEED)
    print(f"bench physics: {len(triangles)} triangles", file=sys.stderr)
    begun = time.perf_counter()
    surface = surface_of(triangles)
    built_s = time.perf_counter() - begun
    twin = Twin(surface, cartons(MOVABLES, rng))
    return [
        at_most("physics.triangles", len(triangles), ""),
        at_most("physics.patches", len(surface.patches), ""),
        at_most("physics.build.s", built_s, "s"),
        *speed_rows(twin, rng),
        *edit_rows(Twin(surface, cartons(MOVABLES, rng)), rng),
        *throw_rows(throw_many(Twin(surface, cartons(MOVABLES, rng)), throws, rng)),
    ]


def speed_rows(twin: Twin, rng: np.random.Generator) -> list[Row]:
    """Steps a second while everything flies and tumbles, and while it settles."""
    rates: list[float] = []
    for _ in range(5):
        throw_all(twin, rng)
        begun = time.perf_counter()
        twin.step(SECOND_NS)
        rates.append(SECOND_NS / STEP_NS / (time.perf_counter() - begun))
    low, middle, high = np.quantile(rates, (0.25, 0.5, 0.75))
    real_time = middle * STEP_NS / SECOND_NS
    return [
        at_least("physics.steps_per_s", middle, "1/s", bar=STEPS_BAR, spread=high - low),
        at_least("physics.real_time", real_time, "x", bar=REAL_TIME_BAR),
    ]


def edit_rows(twin: Twin, rng: np.random.Generator) -> list[Row]:
    """Time of a new scan of 0.5 m of surface, and how far what rests nearby moves by it."""
    names = twin.object_ids
    on_table = names[:3]
    for k, name in enumerate(on_table):
        twin.place(name, Pose.from_yaw(0.3 * k, (2.7 + 0.4 * k, 2.45, TABLE_TOP_M + 0.02)))
    twin.step(3 * SECOND_NS)
    top = block((2.4, 2.0, TABLE_TOP_M - 0.03), (3.9, 2.9, TABLE_TOP_M))
    times, stops, jumps = [], [], []
    for k in range(EDITS):
        x, y = rng.uniform((2.4, 2.0), (3.4, 2.4))
        z = TABLE_TOP_M - 0.1
        region = np.array([[x, y, z], [x + EDIT_SIDE_M, y + EDIT_SIDE_M, z + 0.2]])
        again = scan_like(top, edge_m=SCAN_EDGE_M, noise_m=SCAN_NOISE_M, seed=100 + k)
        centre = again.mean(axis=1)
        again = again[((centre > region[0]) & (centre < region[1])).all(axis=1)]
        before = twin.object_poses()
        begun = time.perf_counter()
        change = rescanned(twin.surface, region, again)
        fitted = time.perf_counter()
        twin.apply(change)
        stops.append(1e3 * (time.perf_counter() - fitted))
        times.append(1e3 * (time.perf_counter() - begun))
        moved = 0.0
        for _ in range(20):
            twin.step(10_000_000)
            moved = max(moved, *(_distance_mm(before[n], twin.object_pose(n)) for n in on_table))
        jumps.append(moved)
    low_ms, high_ms = np.quantile(times, (0.25, 0.75))
    return [
        at_most(
            "physics.rescan.ms", np.median(times), "ms", bar=EDIT_BAR_MS, spread=high_ms - low_ms
        ),
        at_most("physics.rescan.max.ms", max(times), "ms", bar=EDIT_BAR_MS),
        at_most("physics.rescan.stop.ms", np.median(stops), "ms"),
        at_most("physics.rescan.jump.mm", max(jumps), "mm", bar=JUMP_BAR_MM),
    ]


def throw_many(twin: Twin, throws: int, rng: np.random.Generator) -> Thrown:
    """Throw everything again and again, from anywhere in the free room in any direction."""
    escaped, sunk, jitter = 0, [], []
    names = twin.object_ids
    for _ in range(-(-throws // len(names))):
        throw_all(twin, rng)
        gone: set[str] = set()
        for _ in range(FLIGHT_NS // (20 * STEP_NS)):
            twin.step(20 * STEP_NS)
            gone |= {name for name in names if _outside_mm(twin, name) > 100.0}
        twin.step(REST_NS)
        before = twin.object_poses()
        twin.step(SECOND_NS // 10)
        escaped += len(gone)
        jitter += [_distance_mm(before[n], twin.object_pose(n)) for n in names]
        sunk += [_sunk_mm(twin, n) for n in names]
    return Thrown(escaped, np.array(sunk), np.array(jitter))


def throw_all(twin: Twin, rng: np.random.Generator) -> None:
    """Give everything a free place, and a velocity at a wall, the floor or the shelves."""
    taken: list[NDArray[np.float64]] = []
    for name in twin.object_ids:
        place = _free_place(rng, taken)
        taken.append(place)
        twin.place(name, Pose.from_yaw(float(rng.uniform(-3.0, 3.0)), place))
        direction = rng.normal(size=3)
        if rng.random() < 0.4:
            x, z = rng.uniform(*SHELF_X_M), rng.choice(BOARD_HEIGHTS_M)
            direction = np.array([x, 0.5 * SHELF_DEPTH_M, z]) - place
        direction /= np.linalg.norm(direction)
        speed = rng.uniform(SLOWEST_M_PER_S, FASTEST_M_PER_S)
        twin.throw(name, speed * direction, spin=rng.uniform(-1.0, 1.0, 3) * SPIN_RAD_PER_S)


def throw_rows(thrown: Thrown) -> list[Row]:
    """Escapes, and how objects come to rest."""
    return [
        at_most("physics.throws", len(thrown.sunk_mm), ""),
        at_most("physics.escaped", thrown.escaped, "", bar=0.0),
        at_most("physics.sunk.max.mm", thrown.sunk_mm.max(), "mm", bar=SUNK_BAR_MM),
        at_most("physics.sunk.over", int(np.sum(thrown.sunk_mm > SUNK_BAR_MM)), ""),
        at_most("physics.sunk.p99.mm", np.quantile(thrown.sunk_mm, 0.99), "mm"),
        at_most("physics.jitter.max.mm", thrown.jitter_mm.max(), "mm", bar=JITTER_BAR_MM),
        at_most("physics.moving", int(np.sum(thrown.jitter_mm > JITTER_BAR_MM)), ""),
    ]


def _free_place(rng: np.random.Generator, taken: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    """A place in the open part of the room, half a metre from the others where there is one."""
    place = np.zeros(3)
    for _ in range(100):
        place = rng.uniform((0.5, 0.9, 1.0), (5.0, 4.3, 2.2))
        if all(np.linalg.norm(place - other) > 0.55 for other in taken):
            break
    return place


def _sunk_mm(twin: Twin, name: str) -> float:
    """How deep the deepest corner of a carton is in the exact room's walls or furniture."""
    corners = _corners(twin, name)
    depths = [max(0.0, 1e-3 * _outside_mm(twin, name))]
    for low, high in furniture():
        depths += np.minimum(corners - low, high - corners).min(axis=1).tolist()
    return 1e3 * max(depths)


def _outside_mm(twin: Twin, name: str) -> float:
    """How far the outermost corner of a carton is outside the exact room; negative inside."""
    corners = _corners(twin, name)
    return 1e3 * float(max((LOW_M - corners).max(), (corners - HIGH_M).max()))


def _corners(twin: Twin, name: str) -> NDArray[np.float64]:
    """(8, 3) of a carton, world metres."""
    half = 0.5 * np.asarray(twin.size_m(name))
    return twin.object_pose(name) @ (UNIT_BOX_CORNERS * half + (0.0, 0.0, half[2]))


def _distance_mm(first: Pose, second: Pose) -> float:
    return 1e3 * float(np.linalg.norm(second.translation - first.translation))


def furniture() -> tuple[Block, ...]:
    """Lowest and highest corners of the shelves, a table, a sofa and a cupboard, metres."""
    x0, x1 = SHELF_X_M
    depth, top = SHELF_DEPTH_M, BOARD_HEIGHTS_M[-1] + BOARD_M
    return (
        *(((x0, 0.0, z), (x1, depth, z + BOARD_M)) for z in BOARD_HEIGHTS_M),
        *(((x, 0.0, 0.0), (x + BOARD_M, depth, top)) for x in (x0 - BOARD_M, x1)),
        *(
            ((x, y, 0.0), (x + 0.05, y + 0.05, TABLE_TOP_M - 0.03))
            for x in (2.5, 3.75)
            for y in (2.1, 2.75)
        ),
        ((2.4, 2.0, TABLE_TOP_M - 0.03), (3.9, 2.9, TABLE_TOP_M)),
        ((0.6, 4.0, 0.0), (2.6, 5.0, 0.42)),
        ((0.6, 4.8, 0.42), (2.6, 5.0, 0.85)),
        ((5.4, 1.0, 0.0), (6.0, 2.2, 1.9)),
    )


def exact_room() -> NDArray[np.float64]:
    """(T, 3, 3) triangles of the room and its furniture."""
    blocks = [block(low, high) for low, high in furniture()]
    return np.concatenate([block(LOW_M, HIGH_M, is_room=True), *blocks])


def scanned_room(seed: int) -> NDArray[np.float64]:
    """(T, 3, 3) the room as a headset scans it: 200,000 triangles."""
    return scan_like(exact_room(), edge_m=SCAN_EDGE_M, noise_m=SCAN_NOISE_M, seed=seed)


def cartons(count: int, rng: np.random.Generator) -> tuple[PhysicalObject, ...]:
    """Boxes of random sides, above the floor in rows."""
    found: list[PhysicalObject] = []
    for k in range(count):
        x, y, z = (float(side) for side in rng.uniform(SMALLEST_M, LARGEST_M, 3))
        place = (0.8 + 0.9 * (k % 6), 0.8 + 0.8 * (k // 6 % 4), 1.5 + 0.2 * (k // 24))
        part = BoxPart(Pose.from_yaw(0.0, (0.0, 0.0, 0.5 * z)), (0.5 * x, 0.5 * y, 0.5 * z))
        found.append(
            PhysicalObject(
                object_id=f"carton-{k}",
                kind="carton",
                meshes=(),
                box_m=(x, y, z),
                parts=(part,),
                mass_kg=DENSITY_KG_PER_M3 * x * y * z,
                friction=0.5,
                world_from_object=Pose.from_yaw(float(rng.uniform(-3.0, 3.0)), place),
            )
        )
    return tuple(found)
