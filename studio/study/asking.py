"""Questions put to a participant on the live page, one after the other, and the answers."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any, cast

from devices.hub.contract import Asset
from devices.hub.roles import Role
from studio.study.folder import StudyFolder
from studio.study.order import Trial
from studio.study.plan import Asked, GoalKind, Study, When
from studio.study.questionnaires import Questionnaire

NOW, TAKEN = "/study/now.json", "/study/answers"
"""Paths of what is asked, and of where answers go."""

JSON = "application/json"
"""Type of both."""


class StepKind(StrEnum):
    """Kinds of steps that a participant goes through."""

    CONSENT = "consent"
    FORM = "form"
    READY = "ready"
    TASK = "task"
    THANKS = "thanks"


@dataclass(frozen=True, slots=True)
class Step:
    """One step.

    Attributes:
        kind: of it.
        title: over it.
        text: paragraphs.
        button: by which it is left; empty where it ends by itself.
        questionnaire: of a form.
    """

    kind: StepKind
    title: str
    text: tuple[str, ...] = ()
    button: str = ""
    questionnaire: Questionnaire | None = None


Answered = Callable[[Step, Mapping[str, str]], None]
"""Takes a step that was answered, and the answers."""


class Asking:
    """Steps of one participant in one session; any thread.

    Whoever answers first is the participant: nobody else in the session can answer for them.

    Args:
        steps: in order; the last one stays.
        answered: takes answers, on the hub's thread. What it raises as ValueError or OSError is
            said on the page, and the step stays.
        role: of the person who is asked.
    """

    def __init__(
        self, steps: Sequence[Step], answered: Answered, *, role: Role = Role.REMOTE
    ) -> None:
        self._steps, self._answered, self._role = tuple(steps), answered, role
        self._lock = threading.Lock()
        self._at = 0
        self._person = ""
        self.assets: dict[str, Asset] = {TAKEN: Asset(b"", JSON, is_private=True, takes=self._take)}
        """Files of the hub: what is asked, which changes, and where answers go."""
        self._show()

    @property
    def step(self) -> Step:
        """The step that the participant is at."""
        return self._steps[self._at]

    @property
    def place(self) -> int:
        """Number of that step, from 0."""
        return self._at

    @property
    def person(self) -> str:
        """Id of the participant in the session; empty before they have answered anything."""
        return self._person

    def end_task(self) -> None:
        """Go on after the task; harmless when it has ended."""
        with self._lock:
            if self.step.kind is StepKind.TASK:
                self._go_on()

    def _take(self, person: str, data: bytes) -> str:
        """Take what somebody sends; return why it is not taken, empty if it is."""
        try:
            given: Any = json.loads(data)
        except ValueError:
            return "no answer: it cannot be read"
        fields = cast(dict[str, Any], given) if isinstance(given, dict) else {}
        answers = fields.get("answers")
        if not isinstance(answers, dict):
            return "no answer: wanted step and answers"
        with self._lock:
            if self._person not in ("", person):
                return "somebody else is asked"
            if fields.get("step") != self._at:
                return "this was answered already"
            try:
                self._answer(cast(dict[str, Any], answers))
            except (ValueError, OSError) as error:
                return str(error)
            self._person = person
            self._go_on()
        return ""

    def _answer(self, answers: Mapping[str, Any]) -> None:
        """Hand answers over.

        Raises:
            ValueError: they are not those that are wanted.
        """
        step = self.step
        match step.kind:
            case StepKind.CONSENT:
                if answers.get("agree") != "yes":
                    raise ValueError("without your consent there is no study: you may leave")
                self._answered(step, {"agree": "yes"})
            case StepKind.FORM:
                assert step.questionnaire is not None
                self._answered(step, step.questionnaire.checked(answers))
            case StepKind.READY | StepKind.TASK:
                self._answered(step, {})
            case StepKind.THANKS:
                raise ValueError("nothing is asked any more")

    def _go_on(self) -> None:
        self._at = min(self._at + 1, len(self._steps) - 1)
        self._show()

    def _show(self) -> None:
        step = self.step
        items = () if step.questionnaire is None else step.questionnaire.items
        fields = {
            "step": self._at,
            "of": len(self._steps),
            "kind": step.kind,
            "role": self._role,
            "title": step.title,
            "text": list(step.text),
            "button": step.button,
            "items": [item.fields() for item in items],
        }
        content = json.dumps(fields, ensure_ascii=False).encode()
        self.assets[NOW] = Asset(content, JSON, is_private=True)


def steps_of(folder: StudyFolder, trial: Trial) -> tuple[Step, ...]:
    """Return what a participant goes through in a trial's session.

    Consent and what is asked first are left out where they were given before, on paper or here.
    """
    study, task = folder.study, folder.study.task(trial.task)
    steps: list[Step] = []
    if not folder.has_agreed(trial.participant):
        steps.append(consent_step(study))
    steps += [
        form_step(asked)
        for asked in study.asked
        if asked.when is When.FIRST
        and not folder.has_answered(trial.participant, asked.questionnaire.name, trial="")
    ]
    steps.append(Step(StepKind.READY, task.title, (task.prompt,), "Begin"))
    said = "I am satisfied" if task.goal.kind is GoalKind.SAID else "I give up"
    steps.append(Step(StepKind.TASK, task.title, (task.prompt,), said))
    steps += [form_step(asked) for asked in study.asked if trial.asks(asked)]
    more = () if trial.is_last else ("There is one more task: the experimenter will tell you.",)
    steps.append(Step(StepKind.THANKS, "Thank you", ("That was all of this part.", *more)))
    return tuple(steps)


def consent_step(study: Study) -> Step:
    """Return the step in which people agree."""
    contact = f"Questions, and the wish to have your data deleted, go to: {study.contact}"
    return Step(StepKind.CONSENT, study.title, (*study.consent, contact), "I agree")


def form_step(asked: Asked) -> Step:
    """Return the step in which a questionnaire is answered."""
    found = asked.questionnaire
    lead = (found.lead,) if found.lead else ()
    return Step(StepKind.FORM, found.title, lead, "Send", found)
