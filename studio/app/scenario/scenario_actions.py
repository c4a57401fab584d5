"""Actions of the scenario editor: what its hands, keys, the palette and scripts do."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from studio.app.model.actions import Action
from studio.app.scenario.faults.plugin_faults import fault_fields, title_of
from studio.app.scenario.fields import ACTION_FIELDS, Field, new_values
from studio.app.scenario.text import edits
from studio.app.scenario.text.editing import ScenarioEditing
from studio.app.scenario.text.toml_spans import EditError

Ask = Callable[[str, str, bool], str]
"""Asks for a file: title, filter, whether it is to be written; "" if none was chosen."""

KINDS = "Scenarios (*.toml)"

ACTION_KEYS = sorted({field.key for fields in ACTION_FIELDS.values() for field in fields})
"""Keys that one action or another has."""


class ScenarioActions:
    """Adds the actions to the bench.

    Args:
        editing: what they edit.
        ask: asks for a file where none is named.
        objects: ids of the room's objects.
    """

    def __init__(
        self, editing: ScenarioEditing, ask: Ask, objects: Callable[[], tuple[str, ...]]
    ) -> None:
        self._editing, self._ask, self._objects = editing, ask, objects
        bench = editing.bench
        for action in (*self._file_actions(), *self._people_actions(), *self._other_actions()):
            if action.id not in bench.actions:
                bench.actions.add(action)

    def _file_actions(self) -> list[Action]:
        def command(path: str = "") -> str:
            scene = self._editing.bench.document.scene
            return shlex.join(["nexus", "rehearse", scene, "--scenario", path or "scenario.toml"])

        return [
            _action("open", "Open scenario …", self._open, "a TOML file", "path"),
            Action(
                "scenario.save",
                "Save scenario as …",
                "Scenario",
                self._save,
                "a TOML file that `nexus rehearse --scenario FILE` plays",
                arguments=("path",),
                command=command,
            ),
            _action(
                "choose", "Choose a scenario", self._editing.choose, "one of the program's", "name"
            ),
            _action("text", "Replace the scenario's text", self._editing.type, "all of it", "text"),
            _action("discard", "Go back to the last good text", self._editing.discard, ""),
        ]

    def _people_actions(self) -> list[Action]:
        return [
            _action("add_person", "Add a person", self._add_person, "", "id", "x", "y"),
            _action("remove_person", "Remove a person", self._remove_person, "", "id"),
            _action("move_person", "Move a person's start", self._move, "", "id", "x", "y"),
            _action("face_person", "Turn a person at the start", self._face, "", "id", "deg"),
            _action(
                "add_action",
                "Add an action",
                self._add_action,
                "to what a person does; values are the action's keys",
                *("person", "do", "index", "values", *ACTION_KEYS),
            ),
            _action(
                "remove_action", "Remove an action", self._remove_action, "", "person", "index"
            ),
            _action(
                "move_action",
                "Do an action earlier or later",
                self._move_action,
                "",
                *("person", "index", "to"),
            ),
            _action(
                "set_action",
                "Change an action",
                self._set_action,
                "one of its keys; null takes it out",
                *("person", "index", "key", "value"),
            ),
        ]

    def _other_actions(self) -> list[Action]:
        return [
            _action(
                "move_remote_point",
                "Move a point of a remote user's path",
                self._move_remote,
                "",
                *("id", "index", "x", "y"),
            ),
            _action(
                "add_remote_point",
                "Add a point to a remote user's path",
                self._add_remote,
                "before the one of that index",
                *("id", "index", "x", "y", "z"),
            ),
            _action(
                "remove_remote_point",
                "Remove a point of a remote user's path",
                self._remove_remote,
                "",
                *("id", "index"),
            ),
            _action("set_surface", "Set a live surface", self._surface, "", "id", "corners"),
            _action("remove_surface", "Remove a live surface", self._no_surface, "", "id"),
            _action(
                "set_fault",
                "Set a fault",
                self._set_fault,
                "one of its numbers; null takes the key out",
                *("name", "field", "value", "index"),
            ),
            _action("add_fault", "Add a fault", self._add_fault, "", "name"),
            _action("remove_fault", "Remove a fault", self._remove_fault, "", "name", "index"),
            _action("duration", "Set the scenario's length", self._duration, "seconds", "s"),
            _action("camera", "Set the camera", self._camera, "one of its keys", "key", "value"),
        ]

    def _open(self, path: str = "") -> None:
        chosen = path or self._ask("Open scenario", KINDS, False)
        if chosen:
            self._editing.open(Path(chosen))
            if self._editing.draft is None:  # else it is none yet, see the editor
                self._editing.bench.remember(chosen, "recent_scenarios")

    def _save(self, path: str = "") -> None:
        chosen = path or self._ask("Save scenario", KINDS, True)
        if chosen:
            target = Path(chosen)
            self._editing.save(target if target.suffix else target.with_suffix(".toml"))

    def _add_person(self, id: str = "", x: float = 0.0, y: float = 0.0) -> None:
        names = [person.person_id for person in self._editing.scenario.people]
        name = id or next(n for k in range(1, 999) if (n := f"person-{k}") not in names)
        self._change(f"Add {name}", lambda text: edits.with_person(text, name, x, y))

    def _remove_person(self, id: str) -> None:
        self._change(f"Remove {id}", lambda text: edits.without_person(text, id))

    def _move(self, id: str, x: float, y: float) -> None:
        self._change(f"Move {id}", lambda text: edits.with_person_at(text, id, x, y))

    def _face(self, id: str, deg: float) -> None:
        self._change(
            f"Turn {id}",
            lambda text: edits.with_person_facing(text, id, deg),
            merge=f"face {id}",
        )

    def _add_action(
        self,
        person: str,
        do: str,
        index: int | None = None,
        values: dict[str, Any] | None = None,
        **keys: Any,
    ) -> None:
        if do not in ACTION_FIELDS:
            raise EditError(f"no action {do!r}, wanted one of {', '.join(ACTION_FIELDS)}")
        people = self._editing.scenario.people
        found = next((p for p in people if p.person_id == person), None)
        if found is None:
            edits.person_index(self._editing.text, person)
            return
        given = {**(values or {}), **keys}
        x, y = found.start
        others = tuple(p.person_id for p in people if p.person_id != person)
        usual = new_values(ACTION_FIELDS[do], objects=self._objects(), people=others, x=x, y=y)
        if {"object", "to", "at"} & set(given) and do in ("sit", "point"):
            usual = {key: value for key, value in usual.items() if key != "object"}
        written = {"do": do, **usual, **given}
        at = len(found.actions) if index is None else index
        self._change(
            f"Add {do} for {person}", lambda text: edits.with_action(text, person, at, written)
        )

    def _remove_action(self, person: str, index: int) -> None:
        self._change(
            f"Remove an action of {person}",
            lambda text: edits.without_action(text, person, index),
        )

    def _move_action(self, person: str, index: int, to: int) -> None:
        self._change(
            f"Move an action of {person}",
            lambda text: edits.with_action_moved(text, person, index, to),
        )

    def _set_action(self, person: str, index: int, key: str, value: Any) -> None:
        def edit(text: str) -> str:
            text = edits.with_action_value(text, person, index, key, value)
            # Of `object` and a place, an action has one.
            other = {"object": ("to", "at"), "to": ("object",), "at": ("object",)}.get(key, ())
            path = ("people", edits.person_index(text, person), "actions", index)
            for name in other:
                there = edits.item_at(edits.parsed(text), path)
                if value is not None and there["do"] in ("sit", "point") and name in there:
                    text = edits.with_action_value(text, person, index, name, None)
            return text

        label = f"Change an action of {person}"
        self._change(label, edit, merge=f"action {person} {index} {key}")

    def _move_remote(self, id: str, index: int, x: float, y: float) -> None:
        remote = next((r for r in self._editing.scenario.remote if r.user_id == id), None)
        z = 1.6 if remote is None or index >= len(remote.path) else remote.path[index][2]
        self._change(f"Move {id}", lambda text: edits.with_remote_point(text, id, index, (x, y, z)))

    def _add_remote(self, id: str, index: int, x: float, y: float, z: float = 1.6) -> None:
        self._change(
            f"Add to {id}'s path",
            lambda text: edits.with_new_remote_point(text, id, index, (x, y, z)),
        )

    def _remove_remote(self, id: str, index: int) -> None:
        self._change(
            f"Shorten {id}'s path", lambda text: edits.without_remote_point(text, id, index)
        )

    def _surface(self, id: str, corners: list[list[float]]) -> None:
        self._change(f"Set {id}", lambda text: edits.with_surface(text, id, corners))

    def _no_surface(self, id: str) -> None:
        self._change(f"Remove {id}", lambda text: edits.without_surface(text, id))

    def _set_fault(self, name: str, field: str, value: Any, index: int = 0) -> None:
        def edit(text: str) -> str:
            lines = edits.faults_of(text, more=self._more)
            if name in self._faults and not any(line.name == name for line in lines):
                values = self._usual_fault(name)
                text = edits.with_fault(text, name, values, more=self._more)
            return edits.with_fault_value(text, name, index, field, value, more=self._more)

        label = f"Change {title_of(name).lower()}"
        self._change(label, edit, merge=f"fault {name} {index} {field}")

    def _add_fault(self, name: str) -> None:
        if name not in self._faults:
            raise EditError(f"no fault {name!r}, wanted one of {', '.join(self._faults)}")
        values, more = self._usual_fault(name), self._more
        label = f"Add {title_of(name).lower()}"
        self._change(label, lambda text: edits.with_fault(text, name, values, more=more))

    def _usual_fault(self, name: str) -> dict[str, object]:
        people = tuple(person.person_id for person in self._editing.scenario.people)
        return new_values(self._faults[name], objects=self._objects(), people=people, x=0.0, y=0.0)

    def _remove_fault(self, name: str, index: int = 0) -> None:
        label, more = f"Remove {title_of(name).lower()}", self._more
        self._change(label, lambda text: edits.without_fault(text, name, index, more=more))

    @property
    def _more(self) -> tuple[str, ...]:
        """Names of plug-ins' faults."""
        return tuple(self._editing.bench.offered.faults)

    @property
    def _faults(self) -> Mapping[str, tuple[Field, ...]]:
        return fault_fields(self._editing.bench.offered.faults)

    def _duration(self, s: float) -> None:
        self._change(f"Last {s:g} s", lambda text: edits.with_duration(text, s), merge="duration")

    def _camera(self, key: str, value: Any) -> None:
        self._change(
            f"Set the camera's {key}",
            lambda text: edits.with_camera(text, **{key: value}),
            merge=f"camera {key}",
        )

    def _change(self, label: str, edit: Callable[[str], str], merge: str = "") -> None:
        self._editing.change(label, edit, merge=merge)


def _action(
    verb: str, title: str, run: Callable[..., object], hint: str, *arguments: str
) -> Action:
    return Action(f"scenario.{verb}", title, "Scenario", run, hint, arguments=arguments)
