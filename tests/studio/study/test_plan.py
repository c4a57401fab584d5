"""A study's description: what comes along is valid, and what is wrong is named."""

import pytest

from studio.study.plan import FIRST_STUDY, GoalKind, When, parse_study, read_study

FIRST = FIRST_STUDY.read_text()


def test_the_first_study_has_both_applications_of_the_paper():
    study = read_study(FIRST_STUDY)
    assert [task.scene for task in study.tasks] == ["lab", "tangram"]
    assert [task.goal.kind for task in study.tasks] == [GoalKind.LAYOUT, GoalKind.FIGURE]
    assert len(study.task("tangram").goal.targets) == 7
    assert [asked.when for asked in study.asked if asked.questionnaire.name == "tlx"] == [When.TASK]
    assert study.condition("each-second").every_s == 1.0


@pytest.mark.parametrize(
    ("old", "new", "wanted"),
    [
        ("participants = 12", "participants = 0", "participants = 0"),
        ('id = "each-second"', 'id = "live"', "twice"),
        ('id = "each-second"', 'id = "Each Second"', "small letters"),
        ('kind = "layout"', 'kind = "said"', "'said' without targets"),
        ('questionnaire = "sus"', 'questionnaire = "suz"', "a built-in one"),
        ('when = "end"', 'when = "later"', "wanted one of first, task, condition, end"),
        ("every_s = 1.0", "every = 1.0", "no such key"),
        ("[consent]", "[consent", "not TOML"),
    ],
)
def test_what_is_wrong_is_named(old, new, wanted):
    assert old in FIRST
    with pytest.raises(ValueError, match=wanted):
        parse_study(FIRST.replace(old, new, 1), source="study.toml")


def test_a_study_can_have_its_own_questionnaire():
    own = """
[[questionnaires]]
id = "own"
items = [
  { id = "a", text = "How was it?", points = 7, low = "bad", high = "good" },
  { id = "b", text = "Which?", kind = "choice", options = ["this", "that"] },
]
[[ask]]
questionnaire = "own"
"""
    found = parse_study(FIRST + own, source="study.toml").questionnaire("own")
    assert found.checked({"a": 7, "b": "that"}) == {"a": "7", "b": "that"}
    with pytest.raises(ValueError, match="wanted one of this, that"):
        found.checked({"a": 7, "b": "other"})


def test_a_folder_without_a_study_says_what_to_do(tmp_path):
    with pytest.raises(ValueError, match="nexus study new"):
        read_study(tmp_path)
