"""The twin as it was arranged by hand, as tables of a scenario's file."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from scenes.coloured_mesh import Geometry
from scenes.pose import Pose
from studio.app.model.documents.document import Primitive, TwinEdits

HEAD = "# Arranged by hand in the studio before the session began."

DENSITY_KG_PER_M3 = 150.0
"""Of a body that was added by hand: a moving box with something in it, light wooden furniture."""

LARGEST_MESH_M = 3.0
"""Longest side of a mesh that is a body, metres. What is longer than a room is high is a part of a
building, and surrounds what it would have to collide with."""


def arranged_text(twin: TwinEdits) -> str:
    """The tables `arranged` and `added` of what was changed in the twin; "" if nothing was."""
    tables = [
        _table("arranged", {"id": key, **_place(pose)}) for key, pose in sorted(twin.poses.items())
    ]
    tables += [_table("added", _primitive(item)) for _, item in sorted(twin.primitives.items())]
    for key, mesh in sorted(twin.meshes.items()):
        if max(mesh.size_m) > LARGEST_MESH_M:
            continue
        values = {"id": key, "shape": "mesh", "source": mesh.source}
        values |= {**_place(mesh.world_from_mesh), **_geometry(mesh.scaled)}
        tables.append(_table("added", values))
    return "\n".join([HEAD, *tables]) if tables else ""


def mass_kg(item: Primitive) -> float:
    """Mass of a body, by its volume."""
    x, y, z = item.size_m
    share = {"box": 1.0, "ball": math.pi / 6.0, "cylinder": math.pi / 4.0}[item.shape]
    return DENSITY_KG_PER_M3 * share * x * y * z


def mesh_mass_kg(geometry: Geometry) -> float:
    """Mass of a mesh: as much as boxes of its parts usually have."""
    from scenes.prepare.cutout.object.solid_parts import guessed_mass_kg
    from sim.scenarios.arrangement import parts_of_mesh

    return guessed_mass_kg(parts_of_mesh(geometry), geometry.size_m)


def _primitive(item: Primitive) -> Mapping[str, Any]:
    return {
        "id": item.primitive_id,
        "shape": item.shape,
        "size_m": item.size_m,
        "colour": item.colour,
        "mass_kg": mass_kg(item),
        **_place(item.world_from_primitive),
    }


def _geometry(geometry: Geometry) -> Mapping[str, Any]:
    return {
        "mass_kg": mesh_mass_kg(geometry),
        "vertices": len(geometry.vertices),
        "faces": len(geometry.faces),
        "triangles": geometry.packed,
    }


def _place(pose: Pose) -> Mapping[str, Any]:
    """A pose as a place and a turn about an axis, degrees."""
    w, *axis = pose.quaternion()
    length = float(np.linalg.norm(axis))
    turn = np.zeros(3) if length < 1e-12 else np.array(axis) / length * 2 * math.atan2(length, w)
    return {"place": pose.translation, "turn_deg": np.degrees(turn)}


def _table(name: str, values: Mapping[str, Any]) -> str:
    lines = [f"{key} = {_value(value)}" for key, value in values.items()]
    return "\n".join([f"[[{name}]]", *lines, ""])


def _value(value: Any) -> str:
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=True)
    if isinstance(value, Iterable):
        return f"[{', '.join(_value(each) for each in value)}]"
    return str(value) if isinstance(value, int) else repr(round(float(value), 7) + 0.0)
