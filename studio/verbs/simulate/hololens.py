"""`nexus simulate hololens SCENE`: a HoloLens on its real ports, worn by somebody in a room."""

from __future__ import annotations

import argparse
import json
import math
import os
import sys
import time
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from devices.clock import Clock
    from scenes.mesh import PhysicalRoom
    from sim.hololens.acting import Acting
    from sim.hololens.simulator import Simulator, SimulatorPlan

WATCH_S = 0.5
"""How often it looks whether it is to end."""

LOOPBACK, EVERYWHERE = "127.0.0.1", "0.0.0.0"
"""Addresses that it listens at."""

FLOOR_LOOK_M = (1.2, 0.4)
"""Place that a wearer looks at between codes: before them at the height of a seat, metres."""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the verb's flags."""
    parser.add_argument("scene", nargs="?", default="lab", help="built-in room or scene package")
    parser.add_argument("--seed", type=int, default=0, help="decides everything random")
    parser.add_argument("--seconds", type=float, metavar="S", help="how long (until Ctrl-C)")
    parser.add_argument(
        "--any-ports", action="store_true", help="free ports in place of 3809 to 3816; printed"
    )
    parser.add_argument(
        "--network", action="store_true", help="not only this computer: listen to all"
    )
    parser.add_argument(
        "--scenario",
        metavar="F",
        help="play a scenario of the room: one of its people wears it, and objects move",
    )
    parser.add_argument("--person", default="", metavar="ID", help="who wears it (the first)")
    parser.add_argument(
        "--strolls",
        action="store_true",
        help="the wearer looks wherever the way leads, not at the room's codes in turn",
    )
    parser.add_argument(
        "--no-camera", action="store_true", help="the 360° camera and its code are not to be seen"
    )
    parser.add_argument(
        "--time-code", action="store_true", help="burn this machine's time into every picture"
    )
    parser.add_argument(
        "--fault",
        action="append",
        default=[],
        metavar="KIND:at=S,for=S,size=V",
        help="delay, jitter, drift, drop, stall, hang_up, broken, lost, shift, slide or box; "
        "repeatable",
    )
    parser.add_argument("--json", action="store_true", help="print events as lines of JSON")


def run(args: argparse.Namespace) -> int:
    """Play it until its time is over, and say what it did.

    Raises:
        ValueError, OSError: bad input, or a port that is taken.
    """
    from devices.clock import WallClock
    from sim.hololens.simulator import Simulator

    acting = _acting(args)
    plan = _plan(args, acting)
    clock = WallClock()
    simulator = Simulator(plan, clock)
    if acting is not None:
        acting.start(clock, simulator.scenery)
    try:
        _say(args, "started", values=_about(simulator, plan, clock=clock))
        _wait(args, clock)
    except KeyboardInterrupt:
        pass  # the usual way to end it
    finally:
        if acting is not None:
            acting.close()
        simulator.close()
        counts = {name: asdict(each) for name, each in simulator.counts().items()}
        _say(args, "ended", values={"ports": counts, "lists": simulator.holograms.lists})
    return 0


def _acting(args: argparse.Namespace) -> Acting | None:
    """Return the scenario that is played; None where nobody asked for one."""
    from sim.hololens.acting import Acting
    from studio.session.staging import staging_of

    if args.scenario is None:
        return None
    staging = staging_of(args.scene, args.scenario)
    return Acting(staging.room, staging.scenario, person=args.person)


def _plan(args: argparse.Namespace, acting: Acting | None) -> SimulatorPlan:
    from devices.hololens.plan import Ports
    from sim.hololens.faults import read_hololens_faults
    from sim.hololens.simulator import ANY_PORTS, SimulatorPlan
    from sim.hololens.wearer import Stroller
    from studio.session.staging import staging_of

    room = staging_of(args.scene, args.scenario).room
    x, y = room.footprint_m.mean(axis=0).tolist()
    targets = () if args.strolls else _targets(room)
    strolls = Stroller(args.seed, (x, y), targets)
    return SimulatorPlan(
        room,
        strolls if acting is None else acting.wearer,
        read_hololens_faults(args.fault),
        ANY_PORTS if args.any_ports else Ports(),
        EVERYWHERE if args.network else LOOPBACK,
        args.seed,
        not args.no_camera,
        args.time_code,
    )


def _targets(room: PhysicalRoom) -> tuple[tuple[float, float, float], ...]:
    """Return what a wearer looks at in turn: the codes on the walls, the camera, a seat."""
    places = [code.world_from_code.translation for code in room.codes]
    places.append(room.world_from_rig.translation)
    found: list[tuple[float, float, float]] = []
    for place in places:
        x, y, z = place.tolist()
        found.append((x, y, z))
    return (*found, (FLOOR_LOOK_M[0], 0.0, FLOOR_LOOK_M[1]))


def _about(simulator: Simulator, plan: SimulatorPlan, *, clock: Clock) -> dict[str, Any]:
    since_ns = clock.now_ns() - simulator.world.began_ns
    return {
        "host": plan.host,
        "ports": asdict(simulator.ports),
        "room": plan.room.name,
        "began_glass_ns": plan.glass_ns() - since_ns,
        "drift_ppm": plan.faults.drift_ppm,
        "room_from_world": simulator.room_from_world().matrix().tolist(),
    }


def _wait(args: argparse.Namespace, clock: Clock) -> None:
    """Return when its time is over, or whoever started it with --json is gone."""
    parent = os.getppid()
    seconds: float = math.inf if args.seconds is None else args.seconds
    begun_ns = clock.now_ns()
    while (left_s := seconds - (clock.now_ns() - begun_ns) * 1e-9) > 0:
        if args.json and os.getppid() != parent:
            return
        time.sleep(min(WATCH_S, left_s))


def _say(args: argparse.Namespace, event: str, *, values: dict[str, Any]) -> None:
    if args.json:
        print(json.dumps({"event": event, **values}), flush=True)
        return
    if event == "started":
        ports = ", ".join(f"{name} {number}" for name, number in values["ports"].items())
        print(f"a HoloLens in {values['room']} at {values['host']}: {ports}", flush=True)
        print("Ctrl-C ends it", file=sys.stderr, flush=True)
        return
    for name, counts in values["ports"].items():
        words = ", ".join(f"{value} {key}" for key, value in counts.items())
        print(f"{name}: {words}")
