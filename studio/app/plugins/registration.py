"""Registration of a plug-in's parts with the studio."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from sim.faults.fault import Fault
from sim.faults.settings import LINES, NUMBERS
from studio.app.model.actions import Action
from studio.session.trackers.methods import METHODS, MethodMaker


@dataclass(slots=True)
class Registration:
    """Additions of one plug-in's `register(studio)`; they take effect when that returns.

    Attributes:
        trackers: makers of tracking methods, by name.
        panels: makers of widgets, by title; each is given the bench.
        faults: classes of faults, by name.
        actions: of the palette and menus.
    """

    trackers: dict[str, MethodMaker] = field(default_factory=dict)
    panels: dict[str, Callable[..., Any]] = field(default_factory=dict)
    faults: dict[str, type[Fault]] = field(default_factory=dict)
    actions: list[Action] = field(default_factory=list)

    def tracker(self, name: str, make: MethodMaker) -> None:
        """Offer a tracker; `make` takes the scene.

        Raises:
            ValueError: a built-in tracker has that name.
        """
        if name in METHODS:
            raise ValueError(f"tracker {name!r} is built in: choose another name")
        self.trackers[name] = make

    def panel(self, title: str, make: Callable[..., Any]) -> None:
        """Offer a panel; `make` takes the bench and returns a QWidget."""
        self.panels[title] = make

    def fault(self, kind: type[Fault]) -> None:
        """Offer a fault for scenarios: a line of its name in `[faults]`.

        Raises:
            ValueError: a built-in fault has that name.
        """
        if kind.name in {known.name for known in (*NUMBERS, *LINES)}:
            raise ValueError(f"fault {kind.name!r} is built in: choose another name")
        self.faults[kind.name] = kind

    def action(
        self, action_id: str, title: str, run: Callable[..., object], *, hint: str = ""
    ) -> None:
        """Offer an action; it stands in the menu Plug-ins and in the palette."""
        self.actions.append(Action(action_id, title, "Plug-ins", run, hint))
