"""Edits of a scenario's text, as the editor's hands make them; the rest keeps its every byte."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from tomlkit.items import AoT, InlineTable

from sim.faults.settings import LINES, NUMBERS
from studio.app.scenario.text.toml_edits import (
    with_item,
    with_item_moved,
    with_table,
    with_value,
    without,
)
from studio.app.scenario.text.toml_spans import EditError, Path, item_at, parsed

FAULT_KEYS: Mapping[str, tuple[str, ...]] = {
    "drop_share": ("drop_share", "dropped_frames"),
    "delay_ms": ("delay_ms", "jitter_ms"),
    "bump": ("bump_s", "bump_deg", "bump_cm"),
    "clock_drift_ppm": ("clock_drift_ppm",),
}
"""Keys of `[faults]` itself, by the fault they belong to."""

FAULT_NAMES = tuple(kind.name for kind in (*NUMBERS, *LINES))
"""All faults, in the order in which the simulator draws them."""


@dataclass(frozen=True, slots=True)
class FaultLine:
    """One fault of a scenario's text.

    Attributes:
        name: of `FAULT_NAMES`.
        index: among those of its name.
        values: as they are written.
    """

    name: str
    index: int
    values: Mapping[str, Any]


def values_of(text: str) -> dict[str, Any]:
    """The text's plain values.

    Raises:
        EditError: it is no TOML.
    """
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise EditError(f"not TOML: {error}") from None


def person_index(text: str, person_id: str) -> int:
    """Return the index of the person with an id.

    Raises:
        EditError: nobody has.
    """
    return _index_of(text, "people", person_id)


def with_duration(text: str, seconds: float) -> str:
    """The text with another length."""
    return with_value(text, ("duration_s",), float(seconds))


def with_camera(text: str, **values: float | Sequence[float]) -> str:
    """The text with some of the camera's keys: fps, position, facing_deg and others."""
    for key, value in values.items():
        text = with_value(text, ("camera", key), value)
    return text


def with_person_at(text: str, person_id: str, x_m: float, y_m: float) -> str:
    """The text with a person starting elsewhere."""
    return _with_place(text, ("people", person_index(text, person_id), "start"), (x_m, y_m))


def with_person_facing(text: str, person_id: str, facing_deg: float) -> str:
    """The text with a person facing elsewhere at the start."""
    path = ("people", person_index(text, person_id), "facing_deg")
    return with_value(text, path, float(facing_deg))


def with_person(text: str, person_id: str, x_m: float, y_m: float) -> str:
    """The text with another person, who stands still.

    Raises:
        EditError: somebody has that id.
    """
    if person_id in _ids(text, "people"):
        raise EditError(f"people: {person_id!r} is there already, wanted another id")
    values = {"id": person_id, "start": [float(x_m), float(y_m)], "actions": []}
    return with_table(text, ("people",), values)


def without_person(text: str, person_id: str) -> str:
    """The text without a person."""
    return without(text, ("people", person_index(text, person_id)))


def with_action(text: str, person_id: str, index: int, values: Mapping[str, Any]) -> str:
    """The text with an action put into a person's list before `index`.

    Args:
        text: of the scenario.
        person_id: whose.
        index: of the new action; the number of actions for the end.
        values: the action's keys, `do` among them.
    """
    path = _actions(text, person_id)
    there = item_at(parsed(text), path)
    if there is None:
        return with_value(text, path, [values])
    if isinstance(there, AoT):
        added = with_table(text, path, values)
        last = len(there)
        return added if index >= last else with_item_moved(added, path, last, index)
    return with_item(text, path, index, values)


def without_action(text: str, person_id: str, index: int) -> str:
    """The text without one of a person's actions."""
    path = (*_actions(text, person_id), index)
    if item_at(parsed(text), path) is None:
        raise EditError(f"{person_id}: there is no action {index}")
    return without(text, path)


def with_action_moved(text: str, person_id: str, index: int, to: int) -> str:
    """The text with one of a person's actions done at another place of the order."""
    return with_item_moved(text, _actions(text, person_id), index, to)


def with_action_value(text: str, person_id: str, index: int, key: str, value: Any) -> str:
    """The text with a key of an action changed; None takes the key out."""
    path = (*_actions(text, person_id), index, key)
    return without(text, path) if value is None else _with_place(text, path, value)


def with_remote_point(text: str, user_id: str, index: int, xyz: Sequence[float]) -> str:
    """The text with a point of a remote user's path elsewhere."""
    path = ("remote", _index_of(text, "remote", user_id), "path", index)
    return _with_place(text, path, xyz)


def with_new_remote_point(text: str, user_id: str, index: int, xyz: Sequence[float]) -> str:
    """The text with another point on a remote user's path, before `index`."""
    path = ("remote", _index_of(text, "remote", user_id), "path")
    return with_item(text, path, index, [float(value) for value in xyz])


def without_remote_point(text: str, user_id: str, index: int) -> str:
    """The text without a point of a remote user's path."""
    return without(text, ("remote", _index_of(text, "remote", user_id), "path", index))


def with_surface(text: str, surface_id: str, corners: Sequence[Sequence[float]]) -> str:
    """The text with a live surface: four (x, y, z) in metres, clockwise from the top left."""
    places = [[float(value) for value in corner] for corner in corners]
    if surface_id in _ids(text, "surfaces"):
        path = ("surfaces", _index_of(text, "surfaces", surface_id), "corners")
        return with_value(text, path, places)
    return with_table(text, ("surfaces",), {"id": surface_id, "corners": places})


def without_surface(text: str, surface_id: str) -> str:
    """The text without a live surface."""
    return without(text, ("surfaces", _index_of(text, "surfaces", surface_id)))


def faults_of(text: str, *, more: Sequence[str] = ()) -> list[FaultLine]:
    """The faults that a text has, in the order of `FAULT_NAMES`; those of `more` come last."""
    table = values_of(text).get("faults", {})
    found: list[FaultLine] = []
    for name in (*FAULT_NAMES, *more):
        if name in FAULT_KEYS:
            values = {key: table[key] for key in FAULT_KEYS[name] if key in table}
            if values:
                found.append(FaultLine(name, 0, values))
            continue
        lines = table.get(name, [])
        for index, values in enumerate([lines] if isinstance(lines, dict) else lines):
            found.append(FaultLine(name, index, values))
    return found


def with_fault(text: str, name: str, values: Mapping[str, Any], *, more: Sequence[str] = ()) -> str:
    """The text with another fault; of a kind of which there is one, the second.

    Raises:
        EditError: there is no such fault.
    """
    _check_fault(name, more)
    if name in FAULT_KEYS:
        for key, value in values.items():
            text = with_value(text, ("faults", key), value)
        return text
    there = item_at(parsed(text), ("faults", name))
    if there is None:
        return with_value(text, ("faults", name), values)
    if isinstance(there, list):
        return with_table(text, ("faults", name), values)
    if not isinstance(there, InlineTable):
        raise EditError(f"faults.{name}: is one table; write a list to have a second one")
    return with_value(text, ("faults", name), [values_of(text)["faults"][name], values])


def with_fault_value(
    text: str, name: str, index: int, key: str, value: Any, *, more: Sequence[str] = ()
) -> str:
    """The text with a key of a fault changed; None takes the key out."""
    path = _fault(text, name, index, key, more)
    return without(text, path) if value is None else _with_place(text, path, value)


def without_fault(text: str, name: str, index: int = 0, *, more: Sequence[str] = ()) -> str:
    """The text without a fault."""
    _check_fault(name, more)
    if name in FAULT_KEYS:
        for key in FAULT_KEYS[name]:
            text = without(text, ("faults", key))
        return text
    there = item_at(parsed(text), ("faults", name))
    if isinstance(there, list) and len(there) > 1:
        return without(text, ("faults", name, index))
    return without(text, ("faults", name))


def _fault(text: str, name: str, index: int, key: str, more: Sequence[str]) -> Path:
    _check_fault(name, more)
    if name in FAULT_KEYS:
        if key not in FAULT_KEYS[name]:
            wanted = ", ".join(FAULT_KEYS[name])
            raise EditError(f"faults.{name}: no key {key!r}, wanted {wanted}")
        return ("faults", key)
    there = item_at(parsed(text), ("faults", name))
    return ("faults", name, index, key) if isinstance(there, list) else ("faults", name, key)


def _check_fault(name: str, more: Sequence[str]) -> None:
    known = (*FAULT_NAMES, *more)
    if name not in known:
        raise EditError(f"no fault {name!r}, wanted one of {', '.join(known)}")


def _with_place(text: str, path: Path, value: Any) -> str:
    """A value set; of a list of as many numbers, number by number, so that its spaces stay."""
    if not isinstance(value, Sequence) or isinstance(value, str):
        return with_value(text, path, value)
    there = item_at(values_of(text), path)
    is_number = all(isinstance(item, int | float) for item in value)
    if not is_number or not isinstance(there, list) or len(there) != len(value):
        return with_value(text, path, value)
    before = list(there)
    for index, number in enumerate(value):
        if float(before[index]) != float(number):
            text = with_value(text, (*path, index), float(number))
    return text


def _actions(text: str, person_id: str) -> Path:
    return ("people", person_index(text, person_id), "actions")


def _index_of(text: str, key: str, wanted: str) -> int:
    ids = _ids(text, key)
    if wanted not in ids:
        raise EditError(f"{key}: no {wanted!r}, wanted one of {', '.join(ids) or '(none)'}")
    return ids.index(wanted)


def _ids(text: str, key: str) -> list[str]:
    return [str(item.get("id", "")) for item in values_of(text).get(key, [])]
