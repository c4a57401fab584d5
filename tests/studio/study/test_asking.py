"""Steps of a participant: answers are taken once, from one person, and checked."""

import json

import pytest

from studio.study.asking import NOW, TAKEN, Asking, StepKind, steps_of
from studio.study.folder import Answers


@pytest.fixture
def asking(folder):
    trial = folder.trials[0]
    given = []
    found = Asking(steps_of(folder, trial), lambda step, answers: given.append((step, answers)))
    found.given = given
    return found


def send(asking, step, answers, person="p1"):
    data = json.dumps({"step": step, "answers": answers}).encode()
    return asking.assets[TAKEN].takes(person, data)


def now(asking):
    return json.loads(asking.assets[NOW].content)


def test_a_participant_goes_from_consent_to_thanks(asking):
    assert now(asking)["kind"] == "consent"
    assert "without your consent" in send(asking, 0, {"agree": "no"})
    assert send(asking, 0, {"agree": "yes"}) == ""
    assert send(asking, 0, {"agree": "yes"}) == "this was answered already"
    assert send(asking, 1, {}, person="p2") == "somebody else is asked"
    assert "no item" in send(asking, 1, {"shoe size": "45"})
    assert send(asking, 1, {"age": "25"}) == ""
    assert now(asking)["kind"] == "ready"
    assert send(asking, 2, {}) == ""
    assert asking.step.kind is StepKind.TASK
    asking.end_task()
    asking.end_task()
    assert now(asking)["title"] == "Task load (NASA-TLX)"
    answers = dict.fromkeys(
        ("mental", "physical", "temporal", "performance", "effort", "frustration"), "50"
    )
    assert send(asking, 4, answers) == ""
    assert now(asking)["kind"] == "thanks"
    assert send(asking, 5, {}) == "nothing is asked any more"
    assert asking.person == "p1"


@pytest.mark.parametrize("data", [b"", b"[]", b"{", b'{"step": 0}', b"\xff", b'{"answers": 3}'])
def test_what_is_no_answer_is_refused(asking, data):
    assert asking.assets[TAKEN].takes("p1", data).startswith("no answer")
    assert asking.place == 0


def test_what_was_given_before_is_not_asked_again(folder):
    trial = folder.trials[0]
    folder.agree(trial.participant, how="paper")
    folder.keep_answers(Answers(trial.participant, "", "about", "paper", {"age": "30"}))
    kinds = [step.kind for step in steps_of(folder, trial)]
    assert kinds == [StepKind.READY, StepKind.TASK, StepKind.FORM, StepKind.THANKS]
    last = folder.trials_for(trial.participant)[-1]
    asked = [step.questionnaire.name for step in steps_of(folder, last) if step.questionnaire]
    assert asked == ["tlx", "sus", "paper-presence", "paper-feedback"]
