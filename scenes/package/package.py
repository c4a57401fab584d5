"""The scene package: a folder that holds a prepared room and reopens to the same room.

Layout, format version 4 (lengths in metres, world right-handed and Z up):
    scene.json           format, version, name, creator, stages, footprint; size and hash per file
    splats/room.ply      everything that does not move, in the world frame
    splats/objects/*.ply one file per movable object, in the object's frame
    splats/objects/*.seen  from where photos saw its splats, if that was measured
    objects.json         id, name, kind, box, support height, last pose, solid parts, guessed mass
    anchors.json         printed QR codes: payload, side, pose
    cameras.json         where the 360° camera stands, and from where the room was photographed
    collision/room.glb   what objects collide with, if it is known
    cuts.json, cuts/     what was taken out of the room, in order, so that it can be put back
    reality/             a second reconstruction of the room, if it can be rehearsed in
In a compact package splats are .spz instead of .ply, a tenth of the size and slightly rounded, and
there are no cuts and no second reconstruction. Version 1 had no views, no collision mesh and no
cuts; version 2 was not compact; version 3 had no refined objects.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from scenes.cut import Cut
from scenes.formats.mesh_glb import read_mesh, write_mesh
from scenes.formats.ply import WORLD_COMMENT, read_ply, write_ply
from scenes.formats.spz import read_spz, write_spz
from scenes.formats.storage.atomic import write_folder
from scenes.formats.storage.error import FormatError
from scenes.frames import WORLD_FROM_FORWARD_CAMERA
from scenes.harmonics import turned
from scenes.mesh import CollisionMesh
from scenes.package.coverage import SUFFIX, read_coverage, write_coverage
from scenes.package.cuts import CUTS, read_cuts, write_cuts
from scenes.package.files import (
    PackageError,
    fingerprint,
    inside,
    numbers,
    read_items,
    read_json,
    text,
    verify_files,
    write_items,
    write_json,
)
from scenes.package.reality import REALITY, Reality, reality_of, write_reality
from scenes.package.records import (
    OBJECT_ID,
    Stage,
    ViewPoint,
    code_from_json,
    code_to_json,
    object_from_json,
    object_id_of,
    object_to_json,
    pose_from_json,
    pose_to_json,
    stage_from_json,
    stage_to_json,
    view_from_json,
    view_to_json,
)
from scenes.pose import Pose
from scenes.quad import QrCode
from scenes.splats import SplatCloud, validate
from scenes.state import ObjectModel

FORMAT_NAME = "gaussiannexus scene"
FORMAT_VERSION = 4
DISTRIBUTION = "gaussiannexus-studio"

_SCENE, _OBJECTS, _ANCHORS, _CAMERAS = "scene.json", "objects.json", "anchors.json", "cameras.json"
_ROOM, _COLLISION = "splats/room", "collision/room.glb"
_EXACT, _COMPACT = ".ply", ".spz"


@dataclass(frozen=True, slots=True, eq=False)
class ScenePackage:
    """A prepared room.

    Attributes:
        name: shown to people; of a built-in room, its name.
        room: everything that does not move, world frame, metres.
        objects: movable objects, each in its own frame with its last pose.
        codes: printed QR codes whose poses are known.
        world_from_rig: where the 360° camera stands.
        footprint_m: (2, 2) lowest and highest floor corner (x, y), metres.
        physical: name of the built-in physical room this is a scan of, or None for a real one.
        stages: how it was made, oldest first.
        views: where it was photographed from.
        collision: what objects collide with, or None where nobody has measured it.
        cuts: what was taken out of the room, oldest first.
        reality: what stands for the real room in rehearsals, or None; never read by a tracker.

    Raises:
        ValueError: an object id is unfit for a file name or appears twice, or the footprint is
            not (2, 2) and finite.
    """

    name: str
    room: SplatCloud
    objects: tuple[ObjectModel, ...]
    codes: tuple[QrCode, ...]
    world_from_rig: Pose
    footprint_m: NDArray[np.float64]
    physical: str | None
    stages: tuple[Stage, ...] = ()
    views: tuple[ViewPoint, ...] = ()
    collision: CollisionMesh | None = None
    cuts: tuple[Cut, ...] = ()
    reality: Reality | None = None

    def __post_init__(self) -> None:
        footprint = np.array(self.footprint_m, dtype=np.float64)
        if footprint.shape != (2, 2) or not np.isfinite(footprint).all():
            raise ValueError(
                f"ScenePackage.footprint_m: {footprint.tolist()}, wanted finite (2, 2)"
            )
        footprint.setflags(write=False)
        object.__setattr__(self, "footprint_m", footprint)
        seen: set[str] = set()
        for item in self.objects:
            if not OBJECT_ID.fullmatch(item.object_id):
                raise ValueError(
                    f"object id {item.object_id!r}: wanted 1 to 64 letters, digits, '-' or '_', "
                    "beginning with a letter or digit"
                )
            if item.object_id.lower() in seen:
                raise ValueError(f"object id {item.object_id!r}: appears twice")
            seen.add(item.object_id.lower())

    def object_by_id(self, object_id: str) -> ObjectModel:
        """The movable object with this id.

        Raises:
            KeyError: no such object; the message lists those there are.
        """
        for item in self.objects:
            if item.object_id == object_id:
                return item
        known = ", ".join(sorted(item.object_id for item in self.objects)) or "none"
        raise KeyError(f"scene {self.name!r} has no object {object_id!r}; it has: {known}")


def save_package(
    package: ScenePackage, folder: str | Path, *, replace: bool = True, compact: bool = False
) -> None:
    """Write the package as a folder: whole, or not at all.

    Means, rotations and colours come back exactly, poses to 1e-12, scales and opacities within 1e-6
    relative (see `scenes.formats.ply.write_ply`), and exactly from the second saving on. A compact
    package is rounded as `scenes.formats.spz.write_spz` says.

    Args:
        package: what to save.
        folder: where; it may exist if it is empty or a scene package, which is then replaced.
        replace: False keeps a package that another process puts there meanwhile.
        compact: make it small, to be handed on: what was cut out can no longer be put back.

    Raises:
        PackageError: the folder holds something else, or splats have values no file may have.
        WriteError: the disk is full or the place not writable; nothing is left behind.
    """
    target = Path(folder)
    if target.exists() and not _may_be_replaced(target):
        raise PackageError(
            f"{target}: exists and is not a scene package; move it away or choose another folder"
        )
    _refuse_bad_splats(package)
    write_folder(target, lambda part: _fill(part, package, compact), replace=replace)


def load_package(folder: str | Path) -> ScenePackage:
    """Open a scene package, checking version, sizes and checksums of every file.

    Raises:
        PackageError: names the file, what is wrong with it and what to do.
    """
    source = Path(folder)
    scene = _read_scene(source)
    files = scene.get("files")
    verify_files(source / _SCENE, files, {_OBJECTS, _ANCHORS, _CAMERAS})
    try:
        cameras = read_json(source / _CAMERAS)
        return ScenePackage(
            name=text(scene["name"], "name"),
            room=_read_room(source, scene["files"]),
            objects=tuple(
                _read_object(source, scene["files"], item) for item in read_items(source / _OBJECTS)
            ),
            codes=tuple(code_from_json(c) for c in read_items(source / _ANCHORS)),
            world_from_rig=pose_from_json(cameras["world_from_rig"]),
            footprint_m=np.array([numbers(c, 2, "footprint_m") for c in scene["footprint_m"]]),
            physical=None if scene["physical"] is None else text(scene["physical"], "physical"),
            stages=tuple(stage_from_json(stage) for stage in scene["stages"]),
            views=tuple(view_from_json(view) for view in cameras.get("views", [])),
            collision=_read_collision(source) if _COLLISION in scene["files"] else None,
            cuts=read_cuts(source, scene["files"]) if CUTS in scene["files"] else (),
            reality=reality_of(source) if REALITY in scene["files"] else None,
        )
    except PackageError:
        raise
    except KeyError as error:
        raise PackageError(f"{source}: field {error} is missing; save the scene again") from None
    except (TypeError, ValueError) as error:
        raise PackageError(f"{source}: {error}; save the scene again") from None


def is_package(folder: Path) -> bool:
    """Whether this folder says that it is a scene package, of whatever version."""
    try:
        values = read_json(folder / _SCENE)
    except PackageError:
        return False
    return values.get("format") == FORMAT_NAME


def program_version() -> str:
    """Name and version of this program, as written into packages."""
    # Imported here because it takes a tenth of a second and only saving needs it.
    from importlib.metadata import PackageNotFoundError, version

    try:
        return f"{DISTRIBUTION} {version(DISTRIBUTION)}"
    except PackageNotFoundError:
        return f"{DISTRIBUTION} (not installed)"


def _fill(part: Path, package: ScenePackage, compact: bool) -> None:
    (part / "splats" / "objects").mkdir(parents=True)
    if compact:
        # Upright in any other program too.
        upright = turned(package.room, WORLD_FROM_FORWARD_CAMERA.inverse())
        write_spz(part / f"{_ROOM}{_COMPACT}", upright)
    else:
        write_ply(part / f"{_ROOM}{_EXACT}", package.room, comments=[WORLD_COMMENT])
    for item in package.objects:
        write = write_spz if compact else write_ply
        write(
            part / f"{_object_stem(item.object_id)}{_COMPACT if compact else _EXACT}", item.splats
        )
        if item.coverage is not None:
            write_coverage(part / f"{_object_stem(item.object_id)}{SUFFIX}", item.coverage)
    write_items(part / _OBJECTS, [object_to_json(item) for item in package.objects])
    write_items(part / _ANCHORS, [code_to_json(code) for code in package.codes])
    write_json(
        part / _CAMERAS,
        {
            "world_from_rig": pose_to_json(package.world_from_rig),
            "views": [view_to_json(view) for view in package.views],
        },
    )
    if package.collision is not None:
        (part / _COLLISION).parent.mkdir()
        write_mesh(part / _COLLISION, package.collision)
    if package.cuts and not compact:
        write_cuts(part, package.cuts)
    if package.reality is not None and not compact:
        write_reality(part, package.reality)
    files = sorted(path for path in part.rglob("*") if path.is_file())
    write_json(
        part / _SCENE,
        {
            "format": FORMAT_NAME,
            "version": FORMAT_VERSION,
            "name": package.name,
            "units": "m",
            "up": "z",
            "creator": program_version(),
            "physical": package.physical,
            "footprint_m": package.footprint_m.tolist(),
            "stages": [stage_to_json(stage) for stage in package.stages],
            "files": {path.relative_to(part).as_posix(): fingerprint(path) for path in files},
        },
    )


def _may_be_replaced(target: Path) -> bool:
    return target.is_dir() and (is_package(target) or not any(target.iterdir()))


def _refuse_bad_splats(package: ScenePackage) -> None:
    try:
        validate(package.room, f"scene {package.name!r}, room")
        for item in package.objects:
            validate(item.splats, f"scene {package.name!r}, object {item.object_id!r}")
    except ValueError as error:
        raise PackageError(f"{error}; nothing was saved") from None


def _read_scene(source: Path) -> dict[str, Any]:
    if not source.is_dir():
        raise PackageError(f"{source}: no such scene folder; check the path")
    if not (source / _SCENE).is_file():
        raise PackageError(f"{source}: not a scene package (no {_SCENE}); choose another folder")
    scene = read_json(source / _SCENE)
    if scene.get("format") != FORMAT_NAME:
        raise PackageError(f"{source / _SCENE}: not a scene package; choose another folder")
    found = scene.get("version")
    if not isinstance(found, int) or isinstance(found, bool) or found < 1:
        raise PackageError(
            f"{source / _SCENE}: version {found!r}, wanted a whole number from 1; "
            "the file is damaged, restore the folder from a copy"
        )
    if found > FORMAT_VERSION:
        raise PackageError(
            f"{source}: format version {found} made by a newer program ({scene.get('creator')}); "
            f"this one reads up to {FORMAT_VERSION}: update it"
        )
    if (scene.get("units"), scene.get("up")) != ("m", "z"):
        raise PackageError(
            f"{source / _SCENE}: units {scene.get('units')!r}, up {scene.get('up')!r}, "
            "wanted 'm' and 'z'; the file is damaged, restore the folder from a copy"
        )
    return scene


def _read_room(source: Path, files: Mapping[str, Any]) -> SplatCloud:
    if f"{_ROOM}{_EXACT}" in files:
        return _read_splats(source, files, _ROOM)
    return turned(_read_splats(source, files, _ROOM), WORLD_FROM_FORWARD_CAMERA)


def _read_splats(source: Path, files: Mapping[str, Any], stem: str) -> SplatCloud:
    for suffix, read in ((_EXACT, read_ply), (_COMPACT, read_spz)):
        if f"{stem}{suffix}" not in files:
            continue
        try:
            return read(inside(source / _SCENE, f"{stem}{suffix}"))
        except FormatError as error:
            raise PackageError(str(error)) from None
    raise PackageError(
        f"{source / _SCENE}: does not list {stem}{_EXACT}; restore the folder from a copy"
    )


def _object_stem(object_id: str) -> str:
    return f"splats/objects/{object_id}"


def _read_object(source: Path, files: Mapping[str, Any], values: Mapping[str, Any]) -> ObjectModel:
    stem = _object_stem(object_id_of(values))
    splats, seen = _read_splats(source, files, stem), f"{stem}{SUFFIX}"
    if seen not in files:
        return object_from_json(values, splats)
    coverage = read_coverage(inside(source / _SCENE, seen), values, splats=len(splats))
    return object_from_json(values, splats, coverage=coverage)


def _read_collision(source: Path) -> CollisionMesh:
    try:
        return read_mesh(inside(source / _SCENE, _COLLISION))
    except FormatError as error:
        raise PackageError(str(error)) from None
