"""The local user's headset for a session, real or simulated, until a stack is left."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from devices.clock import Clock
from devices.hub.server import Hub
from scenes.package import ScenePackage, Stage, save_package
from scenes.samples import SAMPLE_NAMES
from studio.console.rows import Row, at_most
from studio.live.hololens.figures import TruePoses, simulated_rows, worn_rows
from studio.live.hololens.simulated.attacking import Visited
from studio.live.hololens.simulated.headset import SimulatedHeadset
from studio.live.hololens.worn import WornHeadset, WornPlan

VIEW_FILE = "headset-view.jpg"
"""Name of the last picture of the wearer's view, beside the recording."""

HEIGHT_M = 1.0
"""Height above the middle of the floor at which the origin's error is said."""


@dataclass(frozen=True, slots=True)
class Wearing:
    """A headset that is worn, and the process that simulates it, if one does.

    Attributes:
        worn: the headset.
        simulated: None where it is a real one.
    """

    worn: WornHeadset
    simulated: SimulatedHeadset | None = None

    @property
    def process_ids(self) -> tuple[int, ...]:
        """Of the process that simulates it."""
        return () if self.simulated is None else (self.simulated.process_id,)

    def follow(self, truth: Path) -> None:
        """Have a simulated one be in the room of a simulated camera; a real one is in the real one.

        Args:
            truth: file that the camera writes.
        """
        if self.simulated is not None:
            self.simulated.follow(truth)

    def rows(self, true_poses: TruePoses = ()) -> list[Row]:
        """Return the figures, against the truth where there is one.

        Args:
            true_poses: wall time and poses of objects, in order of time.
        """
        rows = worn_rows(self.worn)
        if self.simulated is not None:
            rows += simulated_rows(self.simulated.figures, true_poses)
        return rows

    def attacked_rows(self, defects: int) -> list[Row]:
        """Return the figures of hostile visits; none where there were none.

        Args:
            defects: errors that ended threads of the session, or that its hub has said.
        """
        visited = Visited() if self.simulated is None else self.simulated.visited
        if not visited.streams:
            return []
        crashes = visited.unserved + defects
        return [
            at_most("session.fuzz.crashes", float(crashes), "", bar=0),
            Row("session.fuzz.streams", float(visited.streams), ""),
        ]

    def save(self, folder: Path) -> None:
        """Write the room's mesh with what the headset added, and what a simulated one showed."""
        self.worn.save_mesh(folder)
        if self.simulated is not None:
            self.simulated.save_view(folder / VIEW_FILE)

    def save_into(self, package: Path, scene: ScenePackage) -> bool:
        """Write the room with what the headset has added to its collision mesh.

        Args:
            package: folder of the room.
            scene: the room as it was opened.

        Returns:
            Whether the headset has added anything.

        Raises:
            PackageError, WriteError: it cannot be written; the room stays as it was.
        """
        meshing = self.worn.meshing
        whole, added = meshing.whole(), len(meshing.hidden.faces)
        if whole is None or not added:
            return False
        stage = Stage("headset mesh", f"{added} triangles that the scan had not")
        save_package(replace(scene, collision=whole, stages=(*scene.stages, stage)), package)
        return True


def worn_for(
    plan: WornPlan | None,
    scene: ScenePackage,
    *,
    scene_name: str,
    seed: int,
    clock: Clock,
    hub: Callable[[], Hub | None],
    stack: ExitStack,
    say: Callable[[str], None],
    name: str = "",
) -> Wearing:
    """Return the headset that is asked for; a simulated one where there is no plan.

    Args:
        plan: of a real headset; None simulates one.
        scene: the room.
        scene_name: its name.
        seed: of the simulated headset.
        clock: session time.
        hub: returns the hub of the moment; None while nobody can join.
        stack: ends a simulated headset when it is left.
        say: takes a line for the log.
        name: of the wearer of a simulated one.

    Raises:
        ValueError: it cannot be simulated in this room, or has ended.
    """
    if plan is not None:
        return Wearing(WornHeadset(plan, scene, clock=clock, hub=hub))
    if scene.physical is None and scene.collision is None:
        raise ValueError(
            f"--simulated --hololens: {scene_name} has no surface that a headset could see: "
            "prepare it of photos or a video with more overlap, or take "
            f"{', '.join(SAMPLE_NAMES)}"
        )
    simulated = stack.enter_context(SimulatedHeadset(scene_name, seed=seed, clock=clock, say=say))
    worn = WornHeadset(simulated.plan(name=name), scene, clock=clock, hub=hub)
    middle = np.append(np.mean(np.asarray(scene.footprint_m), axis=0), HEIGHT_M)
    simulated.measure(worn, middle=middle)
    return Wearing(worn, simulated)
