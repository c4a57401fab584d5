from dataclasses import replace

import pytest

from scenes.pose import Pose
from scenes.state import SceneState
from studio.app.model.actions import Action, ActionError, matching
from studio.app.model.documents.document import Change, Document, with_item
from studio.app.model.settings import Settings
from studio.app.model.workbench import Topic, Workbench


class PlainHistory:
    def __init__(self):
        self.changes = []

    def push(self, change):
        self.changes.append(change)

    def clear(self):
        self.changes.clear()

    def undo(self):
        pass

    def redo(self):
        pass


@pytest.fixture
def bench():
    return Workbench(Document("lab"), Settings(), PlainHistory())


def moved(document, x):
    twin = document.twin
    poses = with_item(twin.poses, "chair-1", Pose.from_yaw(0.0, (x, 0.0, 0.0)))
    return replace(document, twin=replace(twin, poses=poses))


def test_a_change_is_shown_remembered_and_announced(bench):
    calls = []
    bench.listen(Topic.DOCUMENT, lambda: calls.append("document"))
    bench.listen(Topic.STATE, lambda: calls.append("state"))
    bench.change("Move chair-1", moved(bench.document, 0.5))
    assert bench.state.objects["chair-1"].world_from_object.translation[0] == 0.5
    assert [c.label for c in bench.history.changes] == ["Move chair-1"]
    assert calls == ["state", "document"]
    assert not bench.is_saved


def test_changes_of_one_drag_are_one_step():
    first = Change("Move", Document("a"), Document("b"), "drag 1")
    second = Change("Move", first.after, Document("c"), "drag 1")
    merged = first.merged(second)
    assert (merged.before.scene, merged.after.scene) == ("a", "c")
    assert first.merged(replace(second, merge="drag 2")) is None
    assert replace(first, merge="").merged(replace(second, merge="")) is None


def test_a_session_decides_where_objects_are(bench):
    bench.change("Move chair-1", moved(bench.document, 0.5))
    bench.show_state(SceneState())
    assert "chair-1" not in bench.state.objects
    assert not bench.is_by_hand
    bench.show_state(None)
    assert "chair-1" in bench.state.objects


def test_an_action_is_traced_as_the_user_did_it(bench):
    bench.actions.add(Action("a.inner", "Inner", "A", lambda: None))
    bench.actions.add(
        Action("a.outer", "Outer", "A", lambda x: bench.perform("a.inner"), arguments=("x",))
    )
    assert bench.do("a.outer", x=3)
    assert bench.trace() == ["a.outer x=3"]


@pytest.mark.parametrize(
    ("action_id", "values", "word"),
    [
        ("a.run", {"z": 1}, "no argument 'z'"),
        ("a.rum", {}, "did you mean a.run"),
        ("a.never", {}, "cannot be done now"),
        ("a.run", {}, "wanted x"),
    ],
)
def test_what_cannot_be_done_is_said(bench, action_id, values, word):
    bench.actions.add(Action("a.run", "Run", "A", lambda x: None, arguments=("x",)))
    bench.actions.add(Action("a.never", "Never", "A", lambda: None, available=lambda: False))
    with pytest.raises(ActionError, match=word):
        bench.perform(action_id, **values)
    assert not bench.do(action_id, **values)
    assert word in bench.log.lines("error")[-1].text
    assert bench.trace() == []


def test_the_palette_finds_by_parts_of_words(bench):
    for action_id, title in (("a.save", "Save project"), ("a.open", "Open"), ("a.pro", "Projects")):
        bench.actions.add(Action(action_id, title, "File", lambda: None))
    assert [a.id for a in matching(bench.actions, "pro")] == ["a.pro", "a.save"]
    assert [a.id for a in matching(bench.actions, "sa pr")] == ["a.save"]
    assert len(matching(bench.actions, "")) == 3
