"""What a study keeps stays, newest answers count, and another text needs another consent."""

from dataclasses import replace

import pytest

from studio.study.folder import ANSWERS, Answers, Ended, StudyFolder
from studio.study.plan import STUDY_FILE


def test_answers_are_checked_and_the_newest_count(folder):
    trial = folder.trials[0]
    given = Answers(trial.participant, trial.name, "sus", "paper",
                    {f"SQ{k}": "3" for k in range(1, 11)})  # fmt: skip
    folder.keep_answers(given)
    folder.keep_answers(replace(given, answers={f"SQ{k}": "4" for k in range(1, 11)}))
    with pytest.raises(ValueError, match="wanted one of 1, 2, 3, 4, 5"):
        folder.keep_answers(replace(given, answers={f"SQ{k}": "9" for k in range(1, 11)}))
    (kept,) = folder.answers()
    assert set(kept.answers.values()) == {"4"}
    with (folder.path / ANSWERS).open("a") as file:
        file.write('{"participant": "cut sh')  # the machine has stopped
    assert len(folder.answers()) == 1


def test_another_text_needs_another_consent(folder):
    who = folder.trials[0].participant
    assert not folder.has_agreed(who)
    folder.agree(who, how="page")
    assert folder.has_agreed(who)
    file = folder.path / STUDY_FILE
    file.write_text(file.read_text().replace("of your own will", "for money"))
    assert not StudyFolder(folder.path).has_agreed(who)


def test_trials_that_are_done_are_not_next(folder):
    trial = folder.trials[0]
    ended = Ended(trial.name, trial.participant, 1, trial.condition, trial.task, "p1", 0, 5, "said",
                  {"whole": (1.0, 2.0)})  # fmt: skip
    assert folder.next_trial(trial.participant) == trial
    folder.keep_trial(ended)
    assert folder.next_trial(trial.participant) == folder.trials[1]
    assert folder.ended() == (ended,)
    (folder.folder_of(trial) / "trial.json").write_text("{}")
    with pytest.raises(ValueError, match="move the trial away"):
        folder.ended()
    with pytest.raises(ValueError, match="wanted one of"):
        folder.trials_for("nobody")
