"""Everything that a study keeps, in one folder: consent, answers, trials. No name is in it."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any, cast

from scenes.formats.storage.atomic import write_file
from sim.tables import ScenarioError
from studio.study.order import Trial, trials_of
from studio.study.plan import STUDY_FILE, Study, read_study

ANSWERS, CONSENTS, TRIALS = "answers.jsonl", "consent.jsonl", "trials"
"""Names in the folder: answers and consent, a line each, and a folder of folders of trials."""

TRIAL_FILE, RECORDING = "trial.json", "live.mcap"
"""Names in the folder of a trial."""

HOWS = ("page", "paper", "simulated")
"""Ways in which something was answered: in the browser, on paper, by a simulated person."""

DIGEST_CHARACTERS = 16
"""Of the digest of the text that was agreed to: enough to tell two texts apart."""


@dataclass(frozen=True, slots=True)
class Answers:
    """A questionnaire, answered once.

    Attributes:
        participant: anonymous id.
        trial: name of the trial after which it was answered; empty before the first.
        questionnaire: its name.
        how: see `HOWS`.
        answers: by item; empty texts where nothing was said.
    """

    participant: str
    trial: str
    questionnaire: str
    how: str
    answers: Mapping[str, str]


@dataclass(frozen=True, slots=True)
class Ended:
    """How a trial went.

    Attributes:
        name: of the trial.
        participant: anonymous id.
        number: of the participant's trials, from 1.
        condition: its id.
        task: its id.
        person: the participant's id in the session.
        begun_ns: session time at which the task began.
        ended_ns: at which it ended; of a goal, since when it was met.
        ended_by: "reached", "said", "limit" or "stopped".
        stages_ms: 50th and 95th percentile of each stage's duration, milliseconds.
        ping_ms: the participant's round trip to the hub, as it was last; None if unknown.
        is_rehearsed: whether simulated people did it.
    """

    name: str
    participant: str
    number: int
    condition: str
    task: str
    person: str
    begun_ns: int
    ended_ns: int
    ended_by: str
    stages_ms: Mapping[str, tuple[float, float]] = field(
        default_factory=dict[str, tuple[float, float]]
    )
    ping_ms: float | None = None
    is_rehearsed: bool = False

    @property
    def duration_s(self) -> float:
        """Time that the task took."""
        return (self.ended_ns - self.begun_ns) / 1e9


class StudyFolder:
    """A study and what it has gathered.

    Args:
        path: of the folder.

    Raises:
        ScenarioError: its description is wrong.
    """

    def __init__(self, path: Path) -> None:
        if not path.is_dir():
            raise ScenarioError(f"{path}: no folder of a study; `nexus study new DIR` makes one")
        self.path = path
        self.study: Study = read_study(path)
        self.trials: tuple[Trial, ...] = trials_of(self.study)

    def trials_for(self, participant: str) -> tuple[Trial, ...]:
        """Return somebody's trials in order.

        Raises:
            ScenarioError: there is no such participant.
        """
        found = tuple(trial for trial in self.trials if trial.participant == participant.upper())
        if not found:
            known = ", ".join(dict.fromkeys(trial.participant for trial in self.trials))
            raise ScenarioError(
                f"{self.path / STUDY_FILE}: participant {participant!r}, wanted one of {known}"
            )
        return found

    def next_trial(self, participant: str) -> Trial | None:
        """Return the first of somebody's trials that has not been done; None after the last."""
        left = (t for t in self.trials_for(participant) if not self._file(t.name).is_file())
        return next(left, None)

    def next_participant(self) -> str | None:
        """Return the first participant of the plan who has trials left; None where nobody has."""
        left = (t for t in self.trials if not self._file(t.name).is_file())
        trial = next(left, None)
        return None if trial is None else trial.participant

    def trial(self, name: str) -> Trial:
        """Return a trial by name.

        Raises:
            ScenarioError: there is none.
        """
        for trial in self.trials:
            if trial.name == name.upper():
                return trial
        raise ScenarioError(f"{self.path}: trial {name!r}, wanted such as {self.trials[0].name}")

    def folder_of(self, trial: Trial) -> Path:
        """Return the folder of a trial's recording and result."""
        return self.path / TRIALS / trial.name

    def keep_trial(self, ended: Ended) -> None:
        """Keep how a trial went.

        Raises:
            OSError: the folder cannot be written into.
        """
        file = self._file(ended.name)
        file.parent.mkdir(parents=True, exist_ok=True)
        write_file(file, [json.dumps(asdict(ended), indent=2).encode()])

    def ended(self) -> tuple[Ended, ...]:
        """Return how the trials went that have been done, in the order of the plan.

        Raises:
            ScenarioError: a file is damaged.
        """
        found: list[Ended] = []
        for trial in self.trials:
            file = self._file(trial.name)
            if not file.is_file():
                continue
            try:
                values = cast(dict[str, Any], json.loads(file.read_text(encoding="utf-8")))
                stages = {name: (p50, p95) for name, (p50, p95) in values["stages_ms"].items()}
                found.append(Ended(**{**values, "stages_ms": stages}))
            except (ValueError, TypeError, KeyError, AttributeError) as error:
                raise ScenarioError(f"{file}: damaged ({error}); move the trial away") from None
        return tuple(found)

    def agree(self, participant: str, *, how: str) -> None:
        """Keep that somebody has agreed to the text as it is now.

        Raises:
            OSError: the folder cannot be written into.
        """
        self.trials_for(participant)
        _append(
            self.path / CONSENTS,
            {"participant": participant, "text": consent_digest(self.study), "how": how},
        )

    def has_agreed(self, participant: str) -> bool:
        """Return whether somebody has agreed to the text as it is now."""
        wanted = consent_digest(self.study)
        return any(
            line.get("participant") == participant and line.get("text") == wanted
            for line in _lines(self.path / CONSENTS)
        )

    def keep_answers(self, given: Answers) -> None:
        """Keep answers; those that somebody gave to the same questions before count no longer.

        Raises:
            ValueError: an answer is not possible.
            OSError: the folder cannot be written into.
        """
        checked = self.study.questionnaire(given.questionnaire).checked(given.answers)
        _append(self.path / ANSWERS, {**asdict(given), "answers": checked})

    def answers(self) -> tuple[Answers, ...]:
        """Return the newest answers to every questionnaire after every trial."""
        newest: dict[tuple[str, str, str], Answers] = {}
        for line in _lines(self.path / ANSWERS):
            answers = Answers(**line)
            newest[answers.participant, answers.trial, answers.questionnaire] = answers
        return tuple(newest.values())

    def has_answered(self, participant: str, questionnaire: str, *, trial: str) -> bool:
        """Return whether somebody has answered a questionnaire after a trial."""
        wanted = (participant, trial, questionnaire)
        return any((a.participant, a.trial, a.questionnaire) == wanted for a in self.answers())

    def _file(self, name: str) -> Path:
        return self.path / TRIALS / name / TRIAL_FILE


def consent_digest(study: Study) -> str:
    """Return a digest of the text that people agree to: another text needs another consent."""
    text = "\n".join((*study.consent, study.contact))
    return hashlib.sha256(text.encode()).hexdigest()[:DIGEST_CHARACTERS]


def _append(file: Path, value: Mapping[str, Any]) -> None:
    """Write a line that stays when the machine stops right after."""
    with file.open("a", encoding="utf-8") as lines:
        lines.write(json.dumps(value, ensure_ascii=False) + "\n")
        lines.flush()
        os.fsync(lines.fileno())


def _lines(file: Path) -> Iterator[dict[str, Any]]:
    """Yield a file's lines; one that was cut short at its end is left out."""
    if not file.is_file():
        return
    for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), start=1):
        try:
            value: Any = json.loads(line)
        except ValueError:
            continue
        if not isinstance(value, dict):
            raise ScenarioError(f"{file}: line {number}: damaged, wanted an object")
        yield cast(dict[str, Any], value)
