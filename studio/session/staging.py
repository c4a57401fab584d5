"""Stage of a simulated session: a built-in room, or the stand-in for a scanned one."""

from __future__ import annotations

import logging
import time
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from scenes.mesh import PhysicalRoom
from scenes.package import ScenePackage, is_package
from scenes.prepare.progress import Progress
from sim.faults.fault import Fault
from sim.scenarios.scenario import Scenario
from sim.scenarios.switch import Switch, validate_switches
from studio.session.fork import Fork

if TYPE_CHECKING:
    from sim.reality.scanned import Scanned
    from sim.rehearsal import SimulatedStep

log = logging.getLogger(__name__)


class Remedy(StrEnum):
    """Remedies that make a scene fit to rehearse in: words of a button."""

    TRAIN_AGAIN = "Train the photos again and rehearse"
    PREPARE_FILE = "Make a room of this file"
    PREPARE = "Prepare a room from photos"


class UnfitSceneError(ValueError):
    """A scene that cannot be rehearsed in as it is; says why.

    Args:
        text: why, and what to do.
        remedy: what to do.
    """

    def __init__(self, text: str, remedy: Remedy) -> None:
        super().__init__(text)
        self.remedy = remedy


Load = Callable[[str], tuple[Scenario, str]]
"""Reads a scenario by name or path; gives its text, too."""

OPTIMISM = (
    "What is wrong with photos and poses is wrong with both: in a room with exact truth, measured "
    "errors were 1.6 times the rehearsed ones, and 6 % of the poses were lost instead of 1 %"
)
"""How far a rehearsal in a scan is to be trusted: `nexus evaluate twin` on room C, docs/twin.md."""


@dataclass(frozen=True, slots=True, eq=False)
class Staging:
    """A room, its scan, and what happens in it.

    Attributes:
        scene: what the tracker models the room with.
        room: what exists.
        scenario: what happens.
        scenario_text: the same as a file.
        scanned: how the room is drawn where only a scan exists; else None.
        reality: in words, what stands for the real room and what that leaves out; empty of a
            built-in room, which is known.
    """

    scene: ScenePackage
    room: PhysicalRoom
    scenario: Scenario
    scenario_text: str
    scanned: Scanned | None = None
    reality: str = ""

    def steps(
        self, seed: int, then: Sequence[Switch] = ()
    ) -> Callable[[], Iterator[SimulatedStep]]:
        """The simulation, to be started; `then` as `sim.rehearsal.simulate` has it."""
        from sim.rehearsal import simulate

        return partial(
            simulate, self.room, self.scenario, seed=seed, scanned=self.scanned, then=then
        )


def staging_of(
    scene_name: str,
    scenario_name: str | None,
    fork: Fork | None = None,
    *,
    more_faults: Sequence[type[Fault]] = (),
    arranged: str = "",
) -> Staging:
    """Open what a session takes place in.

    Args:
        scene_name: a built-in room, or the path of a scene package.
        scenario_name: a built-in scenario or a file; None for the room's own.
        fork: the session goes on from a recorded one, whose scenario it is.
        more_faults: kinds that a scenario may have beside the built-in ones.
        arranged: tables of what was arranged by hand, which the scenario's text gets at its end.

    Raises:
        ValueError: scene or scenario are bad, they do not fit, or the scan cannot be rehearsed in.
        OSError: a file cannot be opened.
    """
    from scenes.opening import open_scene
    from scenes.samples import SAMPLE_NAMES

    load = partial(_read, more_faults=more_faults, arranged=arranged)
    if scene_name in SAMPLE_NAMES:
        return _built_in(scene_name, None, scenario_name, fork, load)
    scene = open_scene(scene_name)
    if scene.physical is not None:
        return _built_in(scene.physical, scene, scenario_name, fork, load)
    return _scan(scene_name, scene, scenario_name, fork, load, arranged)


def _built_in(
    room_name: str,
    scene: ScenePackage | None,
    scenario_name: str | None,
    fork: Fork | None,
    load: Load,
) -> Staging:
    from scenes.opening import open_scene
    from scenes.samples import sample_room
    from sim.physics.scanned.objects import missing, only_scanned, with_scanned
    from sim.scenarios.scenario import DEFAULT_SCENARIOS

    room = sample_room(room_name)
    added = () if scene is None else only_scanned(room, scene)
    for item in added:
        log.warning(missing(item))
    room = with_scanned(room, added)
    if fork is None:
        scenario, text = load(scenario_name or DEFAULT_SCENARIOS[room.name])
    else:
        scenario, text = fork.scenario, fork.info.scenario
    room = _as_asked(room, scenario)
    # The first opening of a built-in scene takes a minute; a bad scenario is reported before it.
    _check(scenario, room, fork)
    return Staging(scene or open_scene(room_name), room, scenario, text)


def _scan(
    path: str,
    scene: ScenePackage,
    scenario_name: str | None,
    fork: Fork | None,
    load: Load,
    arranged: str,
) -> Staging:
    from scenes.prepare.cutout.likewise import TakenApart
    from scenes.render.native import NativeRenderer
    from sim.physics.scanned.objects import missing
    from sim.reality.look import SplatLook
    from sim.reality.parts import parts_of
    from sim.reality.room import scanned_room
    from sim.reality.scanned import Scanned
    from sim.reality.world_error import drawn_error
    from sim.scenarios.first import first_scenario
    from sim.scenarios.scenario import parse_scenario

    if scene.collision is None:
        raise _without_surface(path)
    reality, renderer = scene.reality, NativeRenderer()
    if reality is not None:
        parts = parts_of(scene, reality, renderer)
        words = (
            f"a second reconstruction ({reality.trainer}) from {reality.photos} photos, "
            f"{reality.shared} of which the scan knows, too. {OPTIMISM}"
        )
    elif not scene.objects:
        # Nothing is tracked here, so nothing is shown to a tracker that it models.
        parts = TakenApart(scene.room, {}, {})
        words = "the scan itself: it has no movable object, so nothing is tracked"
    else:
        raise _without_reality(path)
    for object_id, why in parts.missing.items():
        log.warning("%s stands still in this rehearsal: %s", object_id, why)
    for item in scene.objects:
        if item.object_id not in parts.objects and item.object_id not in parts.missing:
            log.warning(missing(item))
    room = scanned_room(scene, parts, renderer)
    if fork is not None:
        scenario, text = fork.scenario, fork.info.scenario
    elif scenario_name is not None:
        scenario, text = load(scenario_name)
    else:
        text = _with_arranged(first_scenario(room), arranged)
        scenario = parse_scenario(text, source=f"first scenario of {scene.name}")
    scanned_at = {item.object_id: item.world_from_object for item in room.objects}
    room = _as_asked(room, scenario)
    _check(scenario, room, fork)
    error = None if reality is None else partial(drawn_error, reality)
    scanned = Scanned(partial(SplatLook, renderer=renderer, scanned_at=scanned_at), error)
    return Staging(scene, room, scenario, text, scanned, words)


def _without_reality(path: str) -> UnfitSceneError:
    """The lack of a scan with objects, and whether its photos are there to mend it."""
    why = f"{Path(path).name}: to rehearse with objects that were cut out of a scan, "
    if is_prepared_here(Path(path)):
        return UnfitSceneError(
            f"{why}its photos are trained once more, some minutes, once: the simulated camera must "
            "not show the tracker the very model that it tracks with (nexus rehearse does it, too)",
            Remedy.TRAIN_AGAIN,
        )
    return UnfitSceneError(
        f"{why}its photos are needed, and {work_folder_of(Path(path)).name} is not beside it: put "
        "that folder back, or prepare the room from photos or a video (nexus prepare --rehearsable "
        "trains them at once); a splat file has none: undo the cuts to rehearse in it",
        Remedy.PREPARE,
    )


def _without_surface(path: str) -> UnfitSceneError:
    name = Path(path).name
    if not is_package(Path(path)):
        return UnfitSceneError(
            f"{name}: splats alone do not say how large they are and what people stand on: say "
            "what one unit is, or how high the ceiling, and a room is made of the file",
            Remedy.PREPARE_FILE,
        )
    return UnfitSceneError(
        f"{name}: no surface was found in it that people and objects could stand on: prepare it "
        "again, of photos or a video with more overlap",
        Remedy.PREPARE,
    )


def work_folder_of(scene: Path) -> Path:
    """The folder of a package's photos and stages, if none was named at its preparation."""
    return scene.with_name(f"{scene.name}.prepare")


def is_prepared_here(scene: Path) -> bool:
    """Whether the photos of a package are there, beside it."""
    return (work_folder_of(scene) / "training").is_dir()


def add_reality(
    scene: Path, work_folder: Path | None = None, *, seed: int = 0, progress: Progress
) -> None:
    """Train the photos of a package once more, and keep what comes out in it.

    Args:
        scene: a package's folder.
        work_folder: of its preparation; the one beside the package if not given.
        seed: of the training.
        progress: shows the stages; whatever it raises ends the training, which goes on from there
            the next time.

    Raises:
        ValueError: the work folder is not there or another room's; the scene is damaged.
        OSError: the disk is full.
    """
    from scenes.package import load_package, save_package
    from scenes.prepare.reality import with_reality

    package = with_reality(
        load_package(scene),
        work_folder or work_folder_of(scene),
        seed=seed,
        seconds=time.monotonic,
        progress=progress,
    )
    save_package(package, scene)


def _read(
    scenario_name: str, *, more_faults: Sequence[type[Fault]], arranged: str
) -> tuple[Scenario, str]:
    from sim.scenarios.scenario import load_scenario, parse_scenario

    scenario = load_scenario(scenario_name, more_faults=more_faults)
    text = Path(scenario.source).read_text(encoding="utf-8-sig")
    if arranged:
        text = _with_arranged(text, arranged)
        scenario = parse_scenario(text, source=scenario.source, more_faults=more_faults)
    return scenario, text


def _with_arranged(text: str, arranged: str) -> str:
    return f"{text.rstrip()}\n\n{arranged}" if arranged else text


def _as_asked(room: PhysicalRoom, scenario: Scenario) -> PhysicalRoom:
    """The room with camera and objects where the scenario puts them."""
    from sim.scenarios.arrangement import arranged_room

    room = arranged_room(room, scenario.arrangement)
    placed = scenario.camera.world_from_rig
    return room if placed is None else replace(room, world_from_rig=placed)


def _check(scenario: Scenario, room: PhysicalRoom, fork: Fork | None) -> None:
    from sim.scenarios.scenario import validate_scenario

    validate_scenario(scenario, room)
    if fork is not None:
        validate_switches(scenario, fork.then, room)
