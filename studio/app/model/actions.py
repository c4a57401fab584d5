"""Actions of the studio: one table for menus, buttons, keys, palette and scripts."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

ACTION_ID = re.compile(r"[a-z_]+(\.[a-z_0-9]+)+")
"""`group.verb`, lower case."""


@dataclass(frozen=True, slots=True, eq=False)
class Choice:
    """One way to do an action, for a menu.

    Attributes:
        title: what is chosen.
        values: arguments of the action.
        is_on: whether that is so now, and doing it again ends it; None for what is only done.
    """

    title: str
    values: Mapping[str, Any]
    is_on: bool | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Action:
    """One action of a user.

    Attributes:
        id: `group.verb`; never changes, since scripts name it.
        title: what menus and the palette show, imperative.
        group: menu that it stands in.
        run: does it; takes the named arguments.
        hint: one sentence of what it does.
        keys: default key sequence in Qt's portable notation, or empty.
        arguments: names that `run` accepts; empty for what needs none.
        available: whether it can be done now; None means always.
        command: the command line that does the same, given the arguments; None if there is none.
        icon: name of its icon, or empty.
        choices: its ways, as a menu of its own; None if it has one way only.
        is_on: whether what it switches is on now; None if it switches nothing.
        says: its title as it is now, such as what would be undone; None if it never changes.
    """

    id: str
    title: str
    group: str
    run: Callable[..., object]
    hint: str = ""
    keys: str = ""
    arguments: tuple[str, ...] = ()
    available: Callable[[], bool] | None = None
    command: Callable[..., str] | None = None
    icon: str = ""
    choices: Callable[[], Sequence[Choice]] | None = None
    is_on: Callable[[], bool] | None = None
    says: Callable[[], str] | None = None

    @property
    def is_available(self) -> bool:
        """Whether it can be done now."""
        return self.available is None or self.available()


SYNONYMS: Mapping[str, tuple[str, ...]] = {
    "annotate": ("note", "mark"),
    "batch": ("sweep",),
    "benchmark": ("sweep",),
    "branch": ("fork",),
    "comment": ("note", "mark"),
    "connect": ("live",),
    "crop": ("cut",),
    "delete": ("remove",),
    "diff": ("compare",),
    "distance": ("measure",),
    "documentation": ("manual",),
    "dump": ("export",),
    "erase": ("remove", "delete"),
    "exit": ("quit",),
    "experiment": ("sweep", "fork"),
    "export": ("share", "picture of", "film", "save"),
    "extract": ("cut",),
    "font": ("text",),
    "gravity": ("physics",),
    "guide": ("manual", "first page"),
    "help": ("manual", "keys"),
    "history": ("sessions", "undo"),
    "hotkey": ("keys",),
    "import": ("open", "mesh", "prepare"),
    "licence": ("about",),
    "license": ("about",),
    "load": ("open",),
    "movie": ("film",),
    "options": ("tracker", "dark", "keys"),
    "play": ("rehearse",),
    "preferences": ("dark", "keys", "text"),
    "publish": ("share",),
    "reconstruct": ("prepare",),
    "record": ("rehearse", "live", "film"),
    "recordings": ("sessions",),
    "render": ("film", "picture"),
    "revert": ("undo",),
    "rotate": ("turn",),
    "ruler": ("measure",),
    "run": ("rehearse", "physics"),
    "runs": ("sessions",),
    "scan": ("prepare",),
    "screenshot": ("picture",),
    "segment": ("cut",),
    "send": ("share",),
    "settings": ("tracker", "dark", "keys"),
    "shortcut": ("keys",),
    "simulate": ("rehearse", "physics"),
    "simulation": ("rehearse", "physics"),
    "snapshot": ("picture",),
    "stream": ("live",),
    "train": ("prepare",),
    "translate": ("move",),
    "trash": ("remove", "delete"),
    "tutorial": ("first page", "manual"),
    "version": ("about",),
    "video": ("film",),
    "zoom": ("frame", "text"),
}
"""Words that people type who come from other programs, and what the same is called here."""

MIN_TYPED = 3
"""Letters from which on a beginning is taken for one of these words."""


class ActionError(ValueError):
    """An action is not known, cannot be done now, or was given a wrong argument."""


class ActionTable:
    """All actions by id, in the order they were added."""

    def __init__(self) -> None:
        self._actions: dict[str, Action] = {}

    def add(self, action: Action) -> None:
        """Add an action.

        Raises:
            ActionError: its id is malformed or taken.
        """
        if ACTION_ID.fullmatch(action.id) is None:
            raise ActionError(f"action id {action.id!r}, wanted group.verb in lower case")
        if action.id in self._actions:
            raise ActionError(f"action {action.id!r} exists already")
        self._actions[action.id] = action

    def remove(self, action_id: str) -> None:
        """Forget an action, if there is one of that id: a plug-in that goes takes its own along."""
        self._actions.pop(action_id, None)

    def __iter__(self) -> Iterator[Action]:
        return iter(tuple(self._actions.values()))

    def __len__(self) -> int:
        return len(self._actions)

    def __contains__(self, action_id: str) -> bool:
        return action_id in self._actions

    def get(self, action_id: str) -> Action:
        """The action of an id.

        Raises:
            ActionError: there is none; the message names those that are spelled closely.
        """
        import difflib

        action = self._actions.get(action_id)
        if action is None:
            near = difflib.get_close_matches(action_id, self._actions, n=3)
            hint = f"; did you mean {', '.join(near)}?" if near else ""
            raise ActionError(f"no action {action_id!r}{hint}")
        return action

    def check(self, action_id: str, values: dict[str, Any]) -> Action:
        """The action, if it can be done with these arguments now.

        Raises:
            ActionError: it cannot; the message says why.
        """
        action = self.get(action_id)
        unknown = sorted(set(values) - set(action.arguments))
        if unknown:
            wanted = ", ".join(action.arguments) or "none"
            raise ActionError(f"{action_id}: no argument {unknown[0]!r}, wanted {wanted}")
        if not action.is_available:
            raise ActionError(f"{action_id}: cannot be done now ({action.hint or action.title})")
        return action


def matching(actions: Iterator[Action] | ActionTable, typed: str) -> list[Action]:
    """Actions whose title, group, id or hint has every typed word, best first; all for "".

    A word of another program counts as ours, see `SYNONYMS`: behind what has it literally, and
    only in titles.
    """
    words = typed.lower().split()
    same = {word: _ours(word) for word in words}

    def rank(action: Action) -> tuple[int, int, str] | None:
        title = action.title.lower()
        text = f"{action.group.lower()} {title} {action.id} {action.hint.lower()}"
        foreign = [word for word in words if word not in text]
        if not all(any(ours in title for ours in same[word]) for word in foreign):
            return None
        starts = sum(any(part.startswith(word) for part in title.split()) for word in words)
        return len(foreign), -starts, title

    ranked = [(rank(action), action) for action in actions]
    found = [(key, action) for key, action in ranked if key is not None]
    if not words:
        return [action for _, action in found]
    return [action for _, action in sorted(found, key=lambda pair: pair[0])]


def _ours(word: str) -> tuple[str, ...]:
    """Names that a word of other programs, or the beginning of one, has here."""
    if len(word) < MIN_TYPED:
        return ()
    return tuple(ours for key, each in SYNONYMS.items() if key.startswith(word) for ours in each)
