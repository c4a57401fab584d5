"""A simulated HoloLens and a remote person who points, as a process: JSON lines of what truly is.

`python -m studio.live.hololens.simulated.stand_in lab --seed 0` prints its ports, then four times a
second the true clock and the true place of its world. A line `join URL CODE [ROOT.pem]` on its
input lets somebody join that hub who points at legs of objects; it says how long each took to be
seen on the headset, and where. A line `attack URL CODE CAMERA_PORT VISITS` sends hostile visitors
to the session's ports. A line `follow PATH` has objects and 360° camera be where the truth of a
simulated camera has them, as that is written. It ends with its input.
"""

from __future__ import annotations

import argparse
import json
import sys
import threading
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from devices.clock import WallClock
from devices.hololens.wire.packets import TICK_NS
from scenes.package.records import pose_to_json
from scenes.workers.task import Task
from sim.hololens.drawing.scenery import CAMERA, Scenery
from sim.hololens.faults import read_hololens_faults
from sim.hololens.holograms import Hologram
from sim.hololens.simulator import Simulator, SimulatorPlan
from sim.hololens.wearer import Stroller
from sim.wire.streaming.truth_file import newest_row
from studio.live.hololens.simulated.attacking import attack_session
from studio.live.hololens.simulated.pointing import Pointer, leg_of
from studio.session.staging import staging_of

EVERY_S = 0.25
"""Seconds between two lines of truth."""

SHOWN_EVERY = 8
"""Lines of truth between two of all that the headset shows."""

FOLLOW_S = 1.0 / 60.0
"""Seconds between two looks at the truth of a simulated camera, which takes 30 pictures a second: a
chair that is pushed at 1 m/s is drawn 2 cm late at most, and 13 more where it is drawn ahead."""

FAULTS = (
    "jitter",
    "drift",
    "slide:at=5,for=3600,size=0.0002",
    *(f"box:at={at},for=10" for at in range(20, 1000, 20)),
)
"""Faults of the usual headset: a network's jitter, a clock that is off by 50 ppm, a world that
slides by a centimetre in 50 s, and a box that somebody puts there and takes away again."""


def main(words: Sequence[str]) -> int:
    """Run it until its input ends."""
    parser = argparse.ArgumentParser(prog="stand_in")
    parser.add_argument("scene")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--fault", action="append", default=[])
    args = parser.parse_args(words)
    try:
        room = staging_of(args.scene, None).room
    except (ValueError, OSError) as error:
        print(error, file=sys.stderr)
        return 1
    targets = [tuple(code.world_from_code.translation.tolist()) for code in room.codes]
    targets += [tuple((o.world_from_object @ np.array([0, 0, 0.5])).tolist()) for o in room.objects]
    x, y = room.footprint_m.mean(axis=0).tolist()
    clock = WallClock()
    plan = SimulatorPlan(
        room,
        wearer=Stroller(args.seed, (x, y), targets),
        faults=read_hololens_faults(args.fault or FAULTS),
        seed=args.seed,
    )
    simulator = Simulator(plan, clock)
    pointers: list[Pointer] = []
    attacks: list[Task[None]] = []
    followed: list[Task[None]] = []
    try:
        _say({"event": "started", "ports": _ports(simulator)})
        truth = Task("truth", lambda task: _tell_truth(simulator, clock, task=task)).start()
        chairs = [item for item in room.objects if item.kind == "chair"] or room.objects
        legs = {item.object_id: leg_of(item) for item in chairs}
        for line in sys.stdin:
            word, *rest = line.split()
            if word == "join" and len(rest) >= 2 and not pointers:
                pointers.append(Pointer(rest, legs, simulator=simulator, say=_say))
                pointers[0].start()
            elif word == "attack" and len(rest) == 4 and not attacks:
                attacks.append(_attack(rest, seed=args.seed).start())
            elif word == "follow" and rest and not followed:
                path = Path(line.split(maxsplit=1)[1].rstrip("\n"))
                followed.append(_following(path, simulator.scenery).start())
        truth.cancel()
    finally:
        for task in (*attacks, *followed):
            task.cancel()
        for pointer in pointers:
            pointer.end()
        simulator.close()
    return 0


def _attack(words: Sequence[str], *, seed: int) -> Task[None]:
    url, code, port, visits = words[0], words[1], int(words[2]), int(words[3])

    def attack(task: Task[None]) -> None:
        attack_session(
            task, hub_url=url, code=code, camera_port=port, visits=visits, say=_say, seed=seed
        )

    return Task("attack", attack)


def _following(path: Path, scenery: Scenery) -> Task[None]:
    return Task("follow the camera's truth", lambda task: follow(path, scenery, task=task))


def follow(path: Path, scenery: Scenery, *, task: Task[None]) -> None:
    """Have everything that moves be where a truth has it, until the task is cancelled.

    Args:
        path: file of the truth, which may not be there yet.
        scenery: what the headset sees.
        task: of this work.
    """
    while not path.exists():
        if task.pause(EVERY_S):
            return
    with path.open(encoding="utf-8") as file:
        rest = ""
        while not task.pause(FOLLOW_S):
            whole, end, rest = (rest + file.read()).rpartition("\n")
            row = newest_row(whole + end)
            if row is None:
                continue
            scenery.move(row.world_from_object)
            if row.world_from_rig is not None:
                scenery.move({CAMERA: row.world_from_rig})


def _ports(simulator: Simulator) -> dict[str, int]:
    ports = simulator.ports
    return {
        "configuration": ports.configuration,
        "video": ports.video,
        "body": ports.body,
        "surfaces": ports.surfaces,
        "display": ports.display,
    }


def _tell_truth(simulator: Simulator, clock: WallClock, *, task: Task[None]) -> None:
    number = 0
    while not task.pause(EVERY_S):
        number += 1
        if number % SHOWN_EVERY == 0:
            _say({"event": "shown", "items": [_item(e) for e in simulator.holograms.shown()]})
        now_ns, perf_ns = clock.now_ns(), time.perf_counter_ns()
        _say(
            {
                "event": "truth",
                "perf_ns": perf_ns,
                "device_ns": simulator.world.ticks(now_ns) * TICK_NS,
                "room_from_world": pose_to_json(simulator.room_from_world()),
                "items": len(simulator.holograms.shown()),
                "lists": simulator.holograms.lists,
            }
        )


def _item(each: Hologram) -> dict[str, Any]:
    return {
        "shape": each.shape,
        "pose": pose_to_json(each.world_from_item),
        "scale": each.scale.tolist(),
        "colour": list(each.colour),
        "text": each.text,
    }


_saying = threading.Lock()


def _say(values: dict[str, Any]) -> None:
    with _saying:
        sys.stdout.write(json.dumps(values, separators=(",", ":")) + "\n")
        sys.stdout.flush()


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
