"""Plays a script of user actions in the window, one step after the other, as fast as it goes."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from studio.app.model.script import READING, ScriptError, Step
from studio.app.model.workbench import Workbench

WAIT_S = 600.0
"""How long one step may wait: a rehearsal of half a minute takes some minutes on two cores."""


class ScriptRun:
    """Steps that are done one by one; `wait.…` steps let the window work meanwhile.

    Args:
        bench: does the steps.
        steps: of the script.
        source: its name, for messages.
        conditions: by id of a `wait.…` step: whether what it waits for is there.
    """

    def __init__(
        self,
        bench: Workbench,
        steps: Sequence[Step],
        *,
        source: str,
        conditions: dict[str, Callable[..., bool]],
    ) -> None:
        self._bench = bench
        self._steps = list(steps)
        self._source = source
        self._conditions = conditions
        self._since: float | None = None
        self.failure: ScriptError | None = None

    @property
    def is_done(self) -> bool:
        """Whether all steps are done, or one has failed."""
        return not self._steps or self.failure is not None

    def advance(self) -> None:
        """Do the next step, if what is waited for is there; called by the window's timer."""
        if self.is_done or READING in self._bench.busy:
            return  # what a recording is opened for comes when it is open
        step = self._steps[0]
        try:
            if step.action_id.startswith("wait."):
                if not self._has_waited(step):
                    return
            else:
                self._bench.perform(step.action_id, **step.values)
        except (ValueError, OSError, TypeError) as error:
            self.failure = ScriptError(f"{self._source}:{step.line}: {error}")
            self._bench.say("error", str(self.failure))
        self._steps.pop(0)
        self._since = None

    def _has_waited(self, step: Step) -> bool:
        now = time.monotonic()
        self._since = now if self._since is None else self._since
        if step.action_id == "wait.seconds":
            return now - self._since >= float(step.values.get("s", 1.0))
        condition = self._conditions.get(step.action_id)
        if condition is None:
            known = ", ".join(["wait.seconds", *self._conditions])
            raise ScriptError(f"no step {step.action_id!r}, wanted one of {known}")
        if now - self._since > WAIT_S:
            raise ScriptError(f"{step.action_id}: nothing came in {WAIT_S:.0f} s")
        return condition(**step.values)
