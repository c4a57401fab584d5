"""Actions of the tracker: which one follows the objects in the next session."""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from studio.app.model.actions import Action
from studio.app.model.documents.document import TrackerChoice
from studio.app.model.runs.session_run import SessionRun
from studio.app.model.workbench import Workbench
from tracking.options import TrackerOptions

OPTIONS = tuple(field.name for field in fields(TrackerOptions))
"""Names of our tracker's settings."""


class TrackerActions:
    """Actions of the tracker.

    Args:
        bench: whose document has the choice.
        run: plays the sessions.
    """

    def __init__(self, bench: Workbench, run: SessionRun) -> None:
        self._bench, self._run = bench, run

    def add(self) -> None:
        """Add them to the bench."""
        for action in (
            Action(
                "tracker.choose",
                "Choose the tracker",
                "Session",
                self.choose,
                "this program's, the paper's, or a plug-in's, for the next rehearsal or replay",
                arguments=("name", "beside"),
            ),
            Action(
                "session.track_again",
                "Track the recording again",
                "Session",
                self.track_again,
                "the chosen tracker on the pictures of the recording that is open",
                "Ctrl+F5",
                ("out",),
                available=lambda: self._bench.recording is not None and not self._run.is_playing,
                icon="mdi6.replay",
            ),
            Action(
                "tracker.set",
                "Change the tracker's settings",
                "Session",
                self.set_options,
                "of this program's tracker; a session that plays follows from the next frame on",
                arguments=OPTIONS,
            ),
            Action(
                "tracker.try",
                "Try settings of the tracker",
                "Session",
                self.try_options,
                "beside the session that plays, which stays as it is",
                arguments=OPTIONS,
                available=lambda: self._run.is_playing,
            ),
            Action(
                "tracker.end_try",
                "End trying settings of the tracker",
                "Session",
                self.end_try,
                available=lambda: self._run.is_playing,
            ),
        ):
            self._bench.actions.add(action)

    def choose(self, name: str, beside: bool | None = None) -> None:
        """Take a tracker for the next session.

        Args:
            name: of a built-in tracker, or of a plug-in's.
            beside: whether ours runs beside it; None as before.

        Raises:
            ValueError: there is none of that name.
        """
        self._run.trackers.check(name)
        before = self._bench.document.tracker
        is_beside = before.is_beside if beside is None else bool(beside)
        self._put(f"Tracker {name}", replace(before, name=name, is_beside=is_beside))

    def set_options(self, **values: Any) -> None:
        """Change settings by name; those that are not named stay.

        Raises:
            ValueError: one has no such value.
        """
        before = self._bench.document.tracker
        options = _changed(before.options, values)
        words = ", ".join(_words(name, getattr(options, name)) for name in values)
        self._put(f"Tracker: {words}", replace(before, options=options))

    def try_options(self, **values: Any) -> None:
        """Track with other settings beside the session.

        Raises:
            ValueError: one has no such value, or no session plays.
        """
        self._run.try_tracker(_changed(self._bench.document.tracker.options, values))

    def end_try(self) -> None:
        """No longer track beside the session.

        Raises:
            ValueError: no session plays.
        """
        self._run.try_tracker(None)

    def track_again(self, out: str = "") -> None:
        """Track the open recording with the chosen tracker.

        Raises:
            ValueError: there is none, or the tracker cannot be used on it.
        """
        recording = self._bench.recording
        if recording is None:
            raise ValueError("there is nothing to track again: rehearse, or open a recording first")
        self._run.track_again(recording, Path(out) if out else None)

    def _put(self, label: str, choice: TrackerChoice) -> None:
        if choice != self._bench.document.tracker:
            self._bench.change(label, replace(self._bench.document, tracker=choice))


def _changed(options: TrackerOptions, values: dict[str, Any]) -> TrackerOptions:
    """Settings with some changed.

    Raises:
        ValueError: one has no such value.
    """
    for name, value in values.items():
        usual = getattr(options, name)
        is_number = isinstance(value, int | float) and not isinstance(value, bool)
        if not (isinstance(value, bool) if isinstance(usual, bool) else is_number):
            wanted = "true or false" if isinstance(usual, bool) else "a number"
            raise ValueError(f"{name} = {value!r}, wanted {wanted}")
    return replace(options, **values)


def _words(name: str, value: bool | float) -> str:
    shown = {True: "on", False: "off"}[value] if isinstance(value, bool) else f"{value:g}"
    return f"{name} {shown}"
