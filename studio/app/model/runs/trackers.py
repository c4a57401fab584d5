"""Trackers that a session is played with, and what goes wrong in those of plug-ins."""

from __future__ import annotations

from collections import deque
from functools import partial
from typing import TYPE_CHECKING

from studio.app.model.workbench import Workbench

if TYPE_CHECKING:  # what makes trackers takes a second to import: not before the window is shown
    from studio.session.trackers.methods import MethodMaker

PROBLEMS = 100
"""Lines of trackers that failed, until the window takes them; of more, the oldest go."""


class Trackers:
    """Those that the bench's document asks for.

    Args:
        bench: with the document, and what plug-ins offer.
    """

    def __init__(self, bench: Workbench) -> None:
        self._bench = bench
        self._problems: deque[str] = deque(maxlen=PROBLEMS)

    def check(self, name: str) -> None:
        """Refuse a tracker that is not there.

        Raises:
            ValueError: it is not.
        """
        from studio.session.trackers.methods import METHODS

        known = (*METHODS, *self._bench.offered.trackers)
        if name not in known:
            raise ValueError(
                f"tracker {name!r}: wanted one of {', '.join(known)}; one of a plug-in is there "
                "while its file is in the folder of plug-ins and loads"
            )

    def names(self) -> tuple[str, ...]:
        """Names of the trackers that the document asks for; the first is shown.

        Raises:
            ValueError: one is not there.
        """
        from studio.session.trackers.methods import METHODS

        choice = self._bench.document.tracker
        self.check(choice.name)
        is_beside = choice.is_beside and choice.name != METHODS[0]
        return (choice.name, METHODS[0]) if is_beside else (choice.name,)

    def guarded(self) -> dict[str, MethodMaker]:
        """The trackers of plug-ins; what goes wrong in one is a problem to be said."""
        from studio.session.trackers.guarded import GuardedMethod

        say = self._problems.append
        offered = self._bench.offered.trackers
        return {name: partial(GuardedMethod, name, make, say=say) for name, make in offered.items()}

    def say_problems(self) -> None:
        """Say what has gone wrong in them since the last time."""
        while self._problems:
            self._bench.say("error", self._problems.popleft())
