"""A simulated HoloLens 2: the real ports, a wearer in a room, and faults."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from devices.clock import Clock
from devices.hololens.plan import Ports
from scenes.mesh import PhysicalRoom
from scenes.pose import Pose
from sim.hololens.drawing.scenery import Scenery
from sim.hololens.faults import HoloLensFaults
from sim.hololens.holograms import Holograms
from sim.hololens.meshing import Meshing
from sim.hololens.ports.body import BodyPort
from sim.hololens.ports.configuration import ConfigurationPort
from sim.hololens.ports.display import DisplayPort
from sim.hololens.ports.mapping import MappingPort
from sim.hololens.ports.video import VideoPort
from sim.hololens.wearer import Stroller, Wearer
from sim.hololens.world import Counts, HeadsetWorld

ANY_PORTS = Ports(0, 0, 0, 0, 0)
"""Any free ports: which ones, `Simulator.ports` says."""

LOOPBACK = "127.0.0.1"
"""This computer alone: the protocol has no password."""

P = TypeVar("P", ConfigurationPort, VideoPort, BodyPort, MappingPort, DisplayPort)


@dataclass(frozen=True, slots=True)
class SimulatorPlan:
    """A simulated headset.

    Attributes:
        room: that it is in.
        wearer: whose head it is on; None for somebody who strolls about the room's middle.
        faults: what goes wrong when.
        ports: where it listens.
        host: address that it listens at.
        seed: of everything random.
        has_camera: whether the 360° camera is to be seen, with its code.
        has_time_code: whether `glass_ns` is burnt into every picture.
        utc_ns: coordinated time, since 1970.
        glass_ns: a clock of the machine that consumers can read, too.
    """

    room: PhysicalRoom
    wearer: Wearer | None = None
    faults: HoloLensFaults = field(default_factory=HoloLensFaults)
    ports: Ports = ANY_PORTS
    host: str = LOOPBACK
    seed: int = 0
    has_camera: bool = True
    has_time_code: bool = False
    utc_ns: Callable[[], int] = time.time_ns
    glass_ns: Callable[[], int] = time.perf_counter_ns


class Simulator:
    """Listens from the beginning until `close`.

    Args:
        plan: which headset.
        clock: session time.

    Attributes:
        scenery: what it sees; whoever moves objects says so there.
        meshing: what it has meshed.
        holograms: what it shows.
        world: its clock, its world and its wearer, as they truly are.

    Raises:
        OSError: a port is taken.
    """

    def __init__(self, plan: SimulatorPlan, clock: Clock) -> None:
        centre = np.asarray(plan.room.footprint_m, dtype=np.float64).mean(axis=0)
        x, y = centre.tolist()
        wearer = Stroller(plan.seed, (x, y)) if plan.wearer is None else plan.wearer
        self.scenery = Scenery(plan.room, has_camera=plan.has_camera)
        self.holograms = Holograms()
        self.world = HeadsetWorld(
            clock, wearer, plan.faults, plan.seed, plan.utc_ns(), plan.glass_ns
        )
        self.meshing = Meshing(plan.room, self.world.utc_ticks(self.world.began_ns))
        host, ports = plan.host, plan.ports
        self._open: list[ConfigurationPort | VideoPort | BodyPort | MappingPort | DisplayPort] = []
        try:
            self._configuration = self._opened(
                ConfigurationPort((host, ports.configuration), self.world)
            )
            self._video = self._opened(
                VideoPort(
                    (host, ports.video),
                    self.world,
                    scenery=self.scenery,
                    has_time_code=plan.has_time_code,
                )
            )
            self._body = self._opened(BodyPort((host, ports.body), self.world))
            self._mapping = self._opened(
                MappingPort(
                    (host, ports.surfaces),
                    self.world,
                    meshing=self.meshing,
                    box_m=np.array([x, y, 0.0]),
                )
            )
            self._display = self._opened(
                DisplayPort((host, ports.display), self.world, holograms=self.holograms)
            )
        except OSError:
            self.close()
            raise

    @property
    def ports(self) -> Ports:
        """Ports that it listens at."""
        return Ports(
            self._configuration.number,
            self._video.number,
            self._body.number,
            self._mapping.number,
            self._display.number,
        )

    def counts(self) -> Mapping[str, Counts]:
        """Return what each port did so far."""
        return {
            "configuration": self._configuration.counts,
            "video": self._video.counts,
            "body": self._body.counts,
            "surfaces": self._mapping.counts,
            "display": self._display.counts,
        }

    def room_from_world(self) -> Pose:
        """Return where the headset's world, z up, lies in the room at this moment."""
        return self.world.room_from_world(self.world.now_s())

    def close(self) -> None:
        """Hang up and stop listening; waits for the threads."""
        self.world.stop.set()
        for port in self._open:
            port.close()

    def _opened(self, port: P) -> P:
        self._open.append(port)
        return port
