"""Scenario files: what happens in a rehearsal. TOML in, checked values out.

Everything wrong with a file is one `ScenarioError` line: file, key, value, what is allowed.
"""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from scenes.frames import look_at
from scenes.mesh import PhysicalRoom
from scenes.pose import Pose
from scenes.quad import quad_of
from sim.faults.fault import Fault
from sim.faults.settings import Faults, read_faults
from sim.scenarios.action_checks import Checks, check_people
from sim.scenarios.action_tables import read_action, read_colour, read_line
from sim.scenarios.actions import PersonSettings
from sim.scenarios.arrangement import Arrangement, read_arrangement
from sim.tables import ScenarioError, Table

SCENARIO_FOLDER = Path(__file__).parent
DEFAULT_SCENARIOS = {"lab": "lab-rearrange", "desk": "desk-reading", "tangram": "tangram-lesson"}
"""Built-in scenario of each built-in room."""

ROOM_MARGIN_M = 0.05
AIM_M = 0.2
"""Height above an object's base where a remote user's ray ends, metres: on a chair's legs, clear of
the floor."""


@dataclass(frozen=True, slots=True)
class CameraSettings:
    """The 360° camera of a scenario.

    Attributes:
        fps: frames per second.
        lens_size_px: side of each lens's square picture, even.
        pose_error_deg: size of the error of the known camera pose, about a random axis.
        pose_error_cm: size of its error in position, in a random direction.
        bitrate_mbps: of the H.264 stream of both lenses.
        position: (x, y, z) of the front lens, metres; None leaves it where the scene has it.
        facing_deg: where the front lens looks, from world x, anticlockwise.
    """

    fps: float = 10.0
    lens_size_px: int = 1440
    pose_error_deg: float = 0.2
    pose_error_cm: float = 0.5
    bitrate_mbps: float = 24.0
    position: tuple[float, float, float] | None = None
    facing_deg: float = 90.0

    @property
    def world_from_rig(self) -> Pose | None:
        """Pose of the camera, or None where the scenario leaves it to the room."""
        if self.position is None:
            return None
        eye, turn = np.array(self.position), math.radians(self.facing_deg)
        return look_at(eye, eye + np.array([math.cos(turn), math.sin(turn), 0.0]))


@dataclass(frozen=True, slots=True)
class RemoteDrawing:
    """A line that a remote user draws.

    Attributes:
        points: its corners (x, y, z), metres, at least two.
        from_s: when it begins.
        seconds: how long it takes.
        colour: red, green, blue, 0..1.
    """

    points: tuple[tuple[float, float, float], ...]
    from_s: float
    seconds: float
    colour: tuple[float, float, float]


@dataclass(frozen=True, slots=True)
class RemoteProposal:
    """A place that a remote user proposes for an object.

    Attributes:
        object_id: of what.
        place_m: (x, y) of its origin; it stands at the height at which it stands then.
        yaw_rad: its turn about the vertical; None as it is turned then.
        from_s: when it is proposed.
    """

    object_id: str
    place_m: tuple[float, float]
    yaw_rad: float | None
    from_s: float


@dataclass(frozen=True, slots=True)
class RemoteSettings:
    """A remote user's avatar.

    Attributes:
        user_id: unique.
        path: (x, y, z) of the head, metres, passed at a steady pace over the scenario.
        points_at: ids of objects pointed at, one after the other, for equal times.
        aim_m: height above an object's base of the place that is pointed at.
        draws: lines drawn meanwhile.
        proposes: places proposed meanwhile; only where they join a live session as a person.
    """

    user_id: str
    path: tuple[tuple[float, float, float], ...]
    points_at: tuple[str, ...] = ()
    aim_m: float = AIM_M
    draws: tuple[RemoteDrawing, ...] = ()
    proposes: tuple[RemoteProposal, ...] = ()


@dataclass(frozen=True, slots=True)
class SurfaceSettings:
    """A surface that a local user has made live before the session begins.

    Attributes:
        surface_id: unique.
        corners_in_world: four (x, y, z) in metres, clockwise from the top left.
    """

    surface_id: str
    corners_in_world: tuple[tuple[float, float, float], ...]


@dataclass(frozen=True, slots=True)
class Scenario:
    """One rehearsal.

    Attributes:
        name: file name without ending.
        source: where it was read from, for messages.
        room: built-in room it is written for.
        duration_s: how long it lasts.
        camera: the 360° camera.
        people: those who move objects.
        remote: who watches from elsewhere.
        surfaces: what shows live video.
        faults: what goes wrong.
        arrangement: what stands elsewhere than in the scan, and what was put into the room.
    """

    name: str
    source: str
    room: str
    duration_s: float
    camera: CameraSettings = field(default_factory=CameraSettings)
    people: tuple[PersonSettings, ...] = ()
    remote: tuple[RemoteSettings, ...] = ()
    surfaces: tuple[SurfaceSettings, ...] = ()
    faults: Faults = field(default_factory=Faults)
    arrangement: Arrangement = field(default_factory=Arrangement)

    @property
    def frame_count(self) -> int:
        """How many frames the camera takes, those that are lost included."""
        return math.floor(self.duration_s * self.camera.fps + 1e-9)


def scenario_names() -> tuple[str, ...]:
    """Names of the built-in scenarios."""
    return tuple(sorted(path.stem for path in SCENARIO_FOLDER.glob("*.toml")))


def load_scenario(name_or_path: str | Path, *, more_faults: Sequence[type[Fault]] = ()) -> Scenario:
    """Read a built-in scenario by name, or a TOML file by path; see `parse_scenario`.

    Raises:
        ScenarioError: there is none, it is no TOML, or a value in it is wrong.
    """
    path = Path(name_or_path)
    if str(name_or_path) in scenario_names():
        path = SCENARIO_FOLDER / f"{name_or_path}.toml"
    try:
        text = path.read_text(encoding="utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        known = ", ".join(scenario_names())
        raise ScenarioError(
            f"scenario {str(name_or_path)!r}: cannot be read ({_reason(error)}); "
            f"wanted a TOML file or one of {known}"
        ) from None
    return parse_scenario(text, source=str(path), more_faults=more_faults)


def parse_scenario(text: str, *, source: str, more_faults: Sequence[type[Fault]] = ()) -> Scenario:
    """A scenario from TOML text.

    Args:
        text: the file's content.
        source: its name, for messages.
        more_faults: kinds beside the built-in ones, such as those of plug-ins.

    Raises:
        ScenarioError: the text is no TOML, or a key or value is wrong.
    """
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{source}: not TOML: {error}") from None
    table = Table(values, source, "")
    scenario = Scenario(
        name=Path(source).stem,
        source=source,
        room=table.text("room"),
        duration_s=table.number("duration_s", low=0.1, high=3600.0),
        camera=_camera(table.table("camera")),
        people=tuple(_person(person) for person in table.tables("people")),
        remote=tuple(_remote(remote) for remote in table.tables("remote")),
        surfaces=tuple(_surface(surface) for surface in table.tables("surfaces")),
        faults=read_faults(table.table("faults"), more=more_faults),
        arrangement=read_arrangement(table),
    )
    table.done()
    _check_unique([p.person_id for p in scenario.people], f"{source}: people.id")
    _check_unique([r.user_id for r in scenario.remote], f"{source}: remote.id")
    _check_unique([s.surface_id for s in scenario.surfaces], f"{source}: surfaces.id")
    return scenario


def recorded_camera(text: str, *, source: str) -> CameraSettings:
    """Only the camera of a scenario whose other parts may be of another version or a plug-in.

    Raises:
        ScenarioError: the text is no TOML, or a value of the camera is wrong.
    """
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{source}: not TOML: {error}") from None
    return _camera(Table(values, source, "").table("camera"))


def recorded_arrangement(text: str, *, source: str) -> Arrangement:
    """Only what was arranged, of a scenario whose other parts may be of another version.

    Raises:
        ScenarioError: the text is no TOML, or a value of the arrangement is wrong.
    """
    try:
        values = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise ScenarioError(f"{source}: not TOML: {error}") from None
    return read_arrangement(Table(values, source, ""))


def validate_scenario(scenario: Scenario, room: PhysicalRoom) -> None:
    """Check that a scenario fits a room.

    Raises:
        ScenarioError: it is written for another room, names an object that isn't there, or sends
            someone or something out of the room, into furniture or where nobody gets.
    """
    where = scenario.source
    if scenario.room != room.name:
        raise ScenarioError(f"{where}: room = {scenario.room!r}, wanted {room.name!r}")
    known = sorted(item.object_id for item in room.objects)
    low, high = room.footprint_m

    def check_point(key: str, point: Sequence[float]) -> None:
        if (
            not (low + ROOM_MARGIN_M < point[:2]).all()
            or not (point[:2] < high - ROOM_MARGIN_M).all()
        ):
            raise ScenarioError(
                f"{where}: {key} = {list(point)}, wanted a place inside the room: "
                f"x {low[0]:g}..{high[0]:g}, y {low[1]:g}..{high[1]:g}"
            )

    def check_corners(key: str, corners: Sequence[tuple[float, float, float]]) -> None:
        points = np.array(corners)
        if (points[:, :2] < low).any() or (points[:, :2] > high).any():
            raise ScenarioError(
                f"{where}: {key} = {points.tolist()}, wanted places inside the room: "
                f"x {low[0]:g}..{high[0]:g}, y {low[1]:g}..{high[1]:g}"
            )
        try:
            quad_of(points)
        except ValueError as error:
            raise ScenarioError(f"{where}: {key}: {error}") from None

    def check_object(key: str, object_id: str) -> None:
        if object_id not in known:
            raise ScenarioError(f"{where}: {key} = {object_id!r}, wanted one of {', '.join(known)}")

    if scenario.camera.position is not None:
        check_point("camera.position", scenario.camera.position)
    check_people(scenario.people, room, Checks(check_point, check_object, where))
    for i, surface in enumerate(scenario.surfaces):
        check_corners(f"surfaces[{i}].corners", surface.corners_in_world)
    for i, remote in enumerate(scenario.remote):
        for object_id in remote.points_at:
            check_object(f"remote[{i}].points_at", object_id)
        for proposal in remote.proposes:
            check_object(f"remote[{i}].proposes.object", proposal.object_id)
            check_point(f"remote[{i}].proposes.at", proposal.place_m)
    people = tuple(person.person_id for person in scenario.people)
    scenario.faults.check(room, people, source=where)


def _camera(table: Table) -> CameraSettings:
    default = CameraSettings()
    camera = CameraSettings(
        fps=table.number("fps", default.fps, low=0.5, high=120.0),
        lens_size_px=table.integer("lens_size_px", default.lens_size_px, low=64, high=4096),
        pose_error_deg=table.number("pose_error_deg", default.pose_error_deg, low=0.0, high=45.0),
        pose_error_cm=table.number("pose_error_cm", default.pose_error_cm, low=0.0, high=100.0),
        bitrate_mbps=table.number("bitrate_mbps", default.bitrate_mbps, low=0.1, high=400.0),
        position=table.optional_point3("position"),
        facing_deg=table.number("facing_deg", default.facing_deg, low=-360.0, high=360.0),
    )
    if camera.lens_size_px % 2:
        raise table.error("lens_size_px", camera.lens_size_px, "an even number of pixels")
    table.done()
    return camera


def _person(table: Table) -> PersonSettings:
    person = PersonSettings(
        person_id=table.text("id"),
        start=table.point("start"),
        facing_deg=table.number("facing_deg", 0.0, low=-360.0, high=360.0),
        actions=tuple(read_action(action) for action in table.tables("actions")),
    )
    table.done()
    return person


def _remote(table: Table) -> RemoteSettings:
    remote = RemoteSettings(
        user_id=table.text("id"),
        path=table.points("path"),
        points_at=table.texts("points_at"),
        aim_m=table.number("aim_m", AIM_M, low=0.0, high=2.0),
        draws=tuple(_drawing(drawing) for drawing in table.tables("draws")),
        proposes=tuple(_proposal(proposal) for proposal in table.tables("proposes")),
    )
    table.done()
    return remote


def _proposal(table: Table) -> RemoteProposal:
    yaw_deg = table.optional_number("yaw_deg", -360.0, 360.0)
    proposal = RemoteProposal(
        object_id=table.text("object"),
        place_m=table.point("at"),
        yaw_rad=None if yaw_deg is None else math.radians(yaw_deg),
        from_s=table.number("from_s", low=0.0, high=3600.0),
    )
    table.done()
    return proposal


def _drawing(table: Table) -> RemoteDrawing:
    drawing = RemoteDrawing(
        points=read_line(table),
        from_s=table.number("from_s", low=0.0, high=3600.0),
        seconds=table.number("seconds", low=0.1, high=600.0),
        colour=read_colour(table),
    )
    table.done()
    return drawing


def _surface(table: Table) -> SurfaceSettings:
    surface = SurfaceSettings(surface_id=table.text("id"), corners_in_world=table.points("corners"))
    if len(surface.corners_in_world) != 4:
        raise table.error("corners", surface.corners_in_world, "four [x, y, z] in metres")
    table.done()
    return surface


def _check_unique(names: Sequence[str], key: str) -> None:
    twice = sorted({name for name in names if names.count(name) > 1})
    if twice:
        raise ScenarioError(f"{key} = {twice[0]!r} twice, wanted a different id for each")


def _reason(error: Any) -> str:
    return error.strerror if isinstance(error, OSError) and error.strerror else type(error).__name__
