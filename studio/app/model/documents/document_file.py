"""A document as one JSON file: written whole or not at all, read with every value checked."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from types import MappingProxyType
from typing import Any, TypeVar

import numpy as np

from scenes.formats.storage.atomic import write_whole
from scenes.pose import Pose
from scenes.state import Annotation, Avatar, LiveSurface
from studio.app.model.documents.added_mesh import METRES, AddedMesh, unpacked
from studio.app.model.documents.document import (
    Document,
    Marker,
    Primitive,
    TrackerChoice,
    TwinEdits,
)
from tracking.options import options_from_text, options_text

T = TypeVar("T")

FORMAT, VERSION = "gaussiannexus project", 1
SUFFIX = ".nexus"
"""Of a project's file."""

PROJECT = "project"
"""Key of the document's own file in a file of work in progress."""

SHAPES = ("box", "ball", "cylinder")


class DocumentError(ValueError):
    """A project's file cannot be read: names the file, the key and what is wrong with it."""


def document_to_text(document: Document, *, project: Path | None = None) -> str:
    """The document as JSON, with sorted keys and a line a value: fit for version control.

    Args:
        document: what is written.
        project: of work in progress, the document's own file.
    """
    twin = document.twin
    values: dict[str, Any] = {
        "format": FORMAT,
        "version": VERSION,
        "scene": document.scene,
        "scenario_name": document.scenario_name,
        "scenario": document.scenario,
        "seed": document.seed,
        "markers": [{"t_ns": m.t_ns, "text": m.text} for m in document.markers],
        "tracker": {
            "name": document.tracker.name,
            "is_beside": document.tracker.is_beside,
            "options": options_text(document.tracker.options),
        },
        "draft": document.draft,
        "poses": {key: _matrix(pose) for key, pose in twin.poses.items()},
        "names": dict(twin.names),
        "primitives": {key: _primitive(item) for key, item in twin.primitives.items()},
        "avatars": {key: _avatar(item) for key, item in twin.avatars.items()},
        "cameras": {key: _matrix(pose) for key, pose in twin.cameras.items()},
        "surfaces": {key: _surface(item) for key, item in twin.surfaces.items()},
        "annotations": {key: _annotation(item) for key, item in twin.annotations.items()},
        "meshes": {key: _mesh(item) for key, item in twin.meshes.items()},
    }
    if project is not None:
        values[PROJECT] = str(project)
    return json.dumps(values, indent=1, sort_keys=True, allow_nan=False) + "\n"


def document_from_text(text: str, *, source: str) -> Document:
    """Inverse of `document_to_text`.

    Args:
        text: the file's content.
        source: its name, for messages.

    Raises:
        DocumentError: it is no project of ours, newer, or damaged.
    """
    try:
        values = json.loads(text)
    except ValueError as error:
        raise DocumentError(f"{source}: no project of this program: {error}") from None
    if not isinstance(values, dict) or values.get("format") != FORMAT:
        raise DocumentError(f"{source}: no project of this program (no format {FORMAT!r})")
    if values.get("version") != VERSION:
        raise DocumentError(
            f"{source}: project version {values.get('version')!r}, this program reads {VERSION}"
        )
    try:
        return _document(values)
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise DocumentError(f"{source}: damaged project: {type(error).__name__}: {error}") from None


def save_document(document: Document, path: Path) -> None:
    """Write a document; what was there stays until the new one is whole on the disk.

    Raises:
        OSError: it cannot be written; the old file is as it was.
    """
    write_whole(path, document_to_text(document), makes_folder=True)


def load_document(path: Path) -> Document:
    """Read a document.

    Raises:
        DocumentError: it is no project of ours, newer, or damaged.
        OSError: it cannot be opened.
    """
    try:
        text = path.read_text(encoding="utf-8-sig")
    except UnicodeDecodeError:
        raise DocumentError(f"{path}: no project of this program (not a text)") from None
    return document_from_text(text, source=str(path))


def project_of(path: Path) -> Path | None:
    """The document's own file, which a file of work in progress names; None if it names none.

    Raises:
        DocumentError: it is no such file, or damaged.
        OSError: it cannot be opened.
    """
    try:
        named = json.loads(path.read_text(encoding="utf-8")).get(PROJECT)
    except (ValueError, AttributeError) as error:
        raise DocumentError(f"{path}: no project of this program: {error}") from None
    return Path(named) if isinstance(named, str) else None


def _document(values: Mapping[str, Any]) -> Document:
    return Document(
        scene=_text(values["scene"], "scene"),
        scenario_name=_text(values["scenario_name"], "scenario_name"),
        scenario=_text(values["scenario"], "scenario"),
        seed=int(values["seed"]),
        markers=tuple(Marker(int(m["t_ns"]), _text(m["text"], "text")) for m in values["markers"]),
        tracker=_tracker(values.get("tracker", {})),
        draft=None if values.get("draft") is None else _text(values["draft"], "draft"),
        twin=TwinEdits(
            poses=_each(values["poses"], lambda _key, item: Pose.from_matrix(item)),
            names=_each(values["names"], lambda _key, item: _text(item, "names")),
            primitives=_each(values["primitives"], _read_primitive),
            avatars=_each(values["avatars"], _read_avatar),
            cameras=_each(values["cameras"], lambda _key, item: Pose.from_matrix(item)),
            surfaces=_each(values["surfaces"], _read_surface),
            annotations=_each(values["annotations"], _read_annotation),
            # Projects that were written before meshes could be added have no such key.
            meshes=_each(values.get("meshes", {}), _read_mesh),
        ),
    )


def _tracker(values: Mapping[str, Any]) -> TrackerChoice:
    """The choice; projects of before there was one have the usual."""
    usual = TrackerChoice()
    return TrackerChoice(
        _text(values.get("name", usual.name), "tracker.name"),
        bool(values.get("is_beside", usual.is_beside)),
        options_from_text(_text(values.get("options", ""), "tracker.options")),
    )


def _each(values: Mapping[str, Any], read: Callable[[str, Any], T]) -> Mapping[str, T]:
    return MappingProxyType({key: read(key, item) for key, item in values.items()})


def _text(value: Any, key: str) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{key} = {value!r}, wanted a text")
    return value


def _matrix(pose: Pose) -> list[list[float]]:
    return pose.matrix().tolist()


def _primitive(item: Primitive) -> dict[str, Any]:
    return {
        "shape": item.shape,
        "size_m": list(item.size_m),
        "colour": list(item.colour),
        "world_from_primitive": _matrix(item.world_from_primitive),
    }


def _read_primitive(key: str, item: Mapping[str, Any]) -> Primitive:
    if item["shape"] not in SHAPES:
        raise ValueError(f"primitives.{key}.shape = {item['shape']!r}, wanted one of {SHAPES}")
    size_m, colour = _three(item["size_m"]), _three(item["colour"])
    if min(size_m) <= 0:
        raise ValueError(f"primitives.{key}.size_m = {list(size_m)}, wanted lengths above 0")
    pose = Pose.from_matrix(item["world_from_primitive"])
    return Primitive(key, item["shape"], size_m, colour, pose)


def _avatar(item: Avatar) -> dict[str, Any]:
    return {
        "role": item.role,
        "world_from_head": _matrix(item.world_from_head),
        "hands": [np.asarray(hand).tolist() for hand in item.hands],
        "ray": None if item.ray is None else np.asarray(item.ray).tolist(),
    }


def _read_avatar(key: str, item: Mapping[str, Any]) -> Avatar:
    ray = item["ray"]
    return Avatar(
        user_id=key,
        role=_text(item["role"], f"avatars.{key}.role"),
        world_from_head=Pose.from_matrix(item["world_from_head"]),
        hands=tuple(_points(hand) for hand in item["hands"]),
        ray=None if ray is None else _points(ray, count=2),
    )


def _surface(item: LiveSurface) -> dict[str, Any]:
    return {
        "corners": item.corners_in_world.tolist(),
        "size_px": list(item.size_px),
        "stream_id": item.stream_id,
    }


def _read_surface(key: str, item: Mapping[str, Any]) -> LiveSurface:
    width, height = (int(v) for v in item["size_px"])
    corners = _points(item["corners"], count=4)
    return LiveSurface(key, corners, (width, height), _text(item["stream_id"], "stream_id"))


def _annotation(item: Annotation) -> dict[str, Any]:
    return {
        "user_id": item.user_id,
        "points": item.points_in_world.tolist(),
        "colour": list(item.colour),
    }


def _read_annotation(key: str, item: Mapping[str, Any]) -> Annotation:
    points = _points(item["points"])
    return Annotation(key, _text(item["user_id"], "user_id"), points, _three(item["colour"]))


def _mesh(item: AddedMesh) -> dict[str, Any]:
    return {
        "source": item.source,
        "unit": item.unit,
        "up": item.up,
        "scale": list(item.scale),
        "world_from_mesh": _matrix(item.world_from_mesh),
        "vertex_count": len(item.geometry.vertices),
        "face_count": len(item.geometry.faces),
        "data": item.geometry.packed,
    }


def _read_mesh(key: str, item: Mapping[str, Any]) -> AddedMesh:
    geometry = unpacked(
        _text(item["data"], f"meshes.{key}.data"),
        vertex_count=int(item["vertex_count"]),
        face_count=int(item["face_count"]),
    )
    pose = Pose.from_matrix(item["world_from_mesh"])
    source = _text(item["source"], f"meshes.{key}.source")
    # Projects that were written before meshes could be scaled have none of these keys.
    unit, up, scale = (
        item.get("unit", "m"),
        item.get("up", "z"),
        _three(item.get("scale", (1,) * 3)),
    )
    if unit not in METRES or up not in ("y", "z"):
        raise ValueError(
            f"meshes.{key}: unit {unit!r} and up {up!r}, wanted {list(METRES)}, y or z"
        )
    if min(scale) <= 0:
        raise ValueError(f"meshes.{key}.scale = {list(scale)}, wanted factors above 0")
    return AddedMesh(key, source, geometry, pose, unit, up, scale)


def _three(values: Any) -> tuple[float, float, float]:
    x, y, z = (float(v) for v in values)
    if not np.isfinite([x, y, z]).all():
        raise ValueError(f"{list(values)}, wanted three finite numbers")
    return x, y, z


def _points(values: Any, *, count: int | None = None) -> np.ndarray:
    points = np.array(values, dtype=np.float64).reshape(-1, 3)
    if not np.isfinite(points).all() or (count is not None and len(points) != count):
        raise ValueError(
            f"{np.asarray(values).tolist()}, wanted {count or 'some'} finite (x, y, z)"
        )
    return points
