"""The scenario that is edited: what is typed, what was last good, and what is wrong with it."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from scenes.formats.storage.atomic import write_whole
from sim.faults.fault import Fault
from sim.scenarios.scenario import (
    DEFAULT_SCENARIOS,
    SCENARIO_FOLDER,
    Scenario,
    parse_scenario,
    scenario_names,
)
from sim.tables import ScenarioError
from studio.app.model.workbench import Topic, Workbench
from studio.app.scenario.text.toml_spans import EditError

Kinds = tuple[type[Fault], ...]
"""Kinds of faults."""

EMPTY = 'room = "lab"\nduration_s = 10.0\n'
"""Until the room's own first scenario is there."""


class ScenarioEditing:
    """Edits the bench's scenario text.

    Text that is no good scenario is kept in the document as it was typed, beside the last good one,
    which is what a rehearsal plays: so undo, projects and recovery have it.

    Args:
        bench: whose document holds the text.
    """

    def __init__(self, bench: Workbench) -> None:
        self.bench = bench
        self._first_text = ""
        self._scene = bench.document.scene
        self._parsed: tuple[str, Kinds, Scenario] | None = None
        self._judged: tuple[str, Kinds, str] | None = None
        self._listeners: list[Callable[[], None]] = []
        bench.listen(Topic.DOCUMENT, self._on_document)
        bench.listen(Topic.SCENE, self._on_document)
        bench.listen(Topic.OFFERED, self._on_offered)

    @property
    def text(self) -> str:
        """The last good text: the document's, or the scene's own scenario."""
        document = self.bench.document
        if document.scenario:
            return document.scenario
        names = (document.scenario_name, DEFAULT_SCENARIOS.get(self.room, ""))
        for name in names:
            if name in scenario_names():
                return (SCENARIO_FOLDER / f"{name}.toml").read_text(encoding="utf-8-sig")
        return self._first_text or EMPTY

    @property
    def draft(self) -> str | None:
        """The typed text that is no good scenario; None while there is none."""
        return self.bench.document.draft

    @property
    def problem(self) -> str:
        """Fault of the draft, with its key or line; empty without one."""
        draft, more = self.draft, self.more_faults
        if draft is None:
            return ""
        if self._judged is None or self._judged[:2] != (draft, more):
            self._judged = (draft, more, self._problem_of(draft, f"{self.name}.toml"))
        return self._judged[2] or "what was typed is a scenario again; change it to take it"

    @property
    def more_faults(self) -> Kinds:
        """Kinds of plug-ins that the text may have."""
        return tuple(self.bench.offered.faults.values())

    @property
    def name(self) -> str:
        """Name of the scenario."""
        return self.bench.document.scenario_name or DEFAULT_SCENARIOS.get(self.room, "scenario")

    @property
    def room(self) -> str:
        """Name of the built-in room that the scene is or was scanned of; else the scene's name."""
        scene = self.bench.scene
        if scene is None:
            return self.bench.document.scene
        return scene.physical or scene.name

    @property
    def scenario(self) -> Scenario:
        """Scenario of the last good text.

        Raises:
            ScenarioError: it is of another program, or of a plug-in that is not there.
        """
        text, more = self.text, self.more_faults
        if self._parsed is None or self._parsed[:2] != (text, more):
            self._parsed = (text, more, self._read(text))
        return self._parsed[2]

    @property
    def error_line(self) -> int | None:
        """Line of the draft that TOML stumbles over, from 1, or None."""
        found = re.search(r"at line (\d+)", self.problem)
        return int(found.group(1)) if found else None

    def listen(self, callback: Callable[[], None]) -> None:
        """Call back when the text, the draft or the problem is another one."""
        self._listeners.append(callback)

    def set_first_text(self, text: str) -> None:
        """The scenario that a scanned room begins with."""
        self._first_text = text
        self._call_all()

    def type(self, text: str) -> None:
        """Take what was typed: into the document if it is a scenario, else as a draft."""
        problem = self._problem_of(text, f"{self.name}.toml")
        if problem:
            self._keep_draft("Edit scenario text", text, "scenario text")
        elif text != self.text:
            self._put("Edit scenario text", text, "scenario text")
        else:
            self._keep_draft("Edit scenario text", None, "scenario text")

    def discard(self) -> None:
        """Go back to the last good text."""
        self._keep_draft("Go back to the last good text", None)

    def change(self, label: str, edit: Callable[[str], str], *, merge: str = "") -> None:
        """Edit the text.

        Args:
            label: what is done, for undo.
            edit: the text after it, given the text before.
            merge: see `Workbench.change`.

        Raises:
            EditError: the typed text must be corrected first, or the edit cannot be made.
            ScenarioError: the text after it would be no scenario; nothing is changed.
        """
        if self.draft is not None:
            raise EditError(f"correct or discard what was typed first: {self.problem}")
        text = edit(self.text)
        self._read(text)
        if text != self.text:
            self._put(label, text, merge)

    def open(self, path: Path) -> None:
        """Take the text of a file; of a bad one as a draft.

        Raises:
            OSError: it cannot be read.
            ScenarioError: it is no text.
        """
        try:
            text = path.read_text(encoding="utf-8-sig")
        except UnicodeDecodeError:
            raise ScenarioError(f"{path}: is no UTF-8 text, wanted a scenario's TOML") from None
        problem = self._problem_of(text, str(path))
        if problem:
            self._keep_draft(f"Open scenario {path.stem}, with an error in it", text)
            self.bench.say("error", problem)
            return
        document = replace(self.bench.document, scenario=text, scenario_name=path.stem, draft=None)
        self.bench.change(f"Open scenario {path.stem}", document)

    def choose(self, name: str) -> None:
        """Take a scenario that comes with the program.

        Raises:
            ScenarioError: there is none of that name.
        """
        if name not in scenario_names():
            raise ScenarioError(f"scenario {name!r}: wanted one of {', '.join(scenario_names())}")
        self.open(SCENARIO_FOLDER / f"{name}.toml")

    def save(self, path: Path) -> None:
        """Write what is in the editor, a draft included.

        Raises:
            OSError: it cannot be written.
        """
        write_whole(path, self.text if self.draft is None else self.draft, makes_folder=True)
        self.bench.say("info", f"saved {path}")
        self.bench.remember(str(path), "recent_scenarios")

    def close(self) -> None:
        """No longer follow the bench."""
        self.bench.stop_listening(self._on_document)
        self.bench.stop_listening(self._on_offered)

    def _put(self, label: str, text: str, merge: str) -> None:
        document = replace(self.bench.document, scenario=text, scenario_name=self.name, draft=None)
        self.bench.change(label, document, merge=merge)

    def _keep_draft(self, label: str, text: str | None, merge: str = "") -> None:
        if text == self.draft:
            self._call_all()
        else:
            self.bench.change(label, replace(self.bench.document, draft=text), merge=merge)

    def _on_document(self) -> None:
        if self.bench.document.scene != self._scene:
            self._scene, self._first_text = self.bench.document.scene, ""
        self._call_all()

    def _on_offered(self) -> None:
        """Another plug-in may make a draft good, or have other ranges."""
        if self.draft is not None:
            self.type(self.draft)
        else:
            self._call_all()

    def _read(self, text: str) -> Scenario:
        return parse_scenario(text, source=f"{self.name}.toml", more_faults=self.more_faults)

    def _problem_of(self, text: str, source: str) -> str:
        """Return the fault of a text; empty if it is a scenario."""
        try:
            parse_scenario(text, source=source, more_faults=self.more_faults)
        except ScenarioError as error:
            return str(error)
        return ""

    def _call_all(self) -> None:
        for callback in tuple(self._listeners):
            callback()
