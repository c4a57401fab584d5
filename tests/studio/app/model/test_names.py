"""One naming in all places: the user's, else the scan's, else the id."""

from dataclasses import replace

from scenes.pose import Pose
from scenes.state import Avatar
from studio.app.model.documents.document import Document, TwinEdits
from studio.app.model.names import distinct_names, shown_name


def test_the_users_name_comes_before_the_scans_and_that_before_the_id(tiny):
    item = tiny.scene.objects[0]
    plain = Document("tiny")
    named = replace(plain, twin=TwinEdits(names={item.object_id: "Grandma's", "ana": "Ana Maria"}))
    assert shown_name(item.object_id, named, tiny.scene) == "Grandma's"
    assert shown_name(item.object_id, plain, tiny.scene) == item.name
    assert shown_name(item.object_id, plain, None) == item.object_id
    assert shown_name("ana", named, tiny.scene) == "Ana Maria"
    assert shown_name("ana", plain, tiny.scene) == "ana"
    assert shown_name("camera", plain, tiny.scene) == "360° camera"


def test_people_are_called_as_they_call_themselves_unless_the_user_says_otherwise(tiny):
    people = {"p1": Avatar("p1", "remote", Pose.identity(), name="Ann 1")}
    plain = Document("tiny")
    named = replace(plain, twin=TwinEdits(names={"p1": "the architect"}))
    assert shown_name("p1", plain, tiny.scene, people=people) == "Ann 1"
    assert shown_name("p1", named, tiny.scene, people=people) == "the architect"
    assert shown_name("p2", plain, tiny.scene, people=people) == "p2"


def test_of_two_that_are_called_the_same_each_has_its_id_beside_the_name():
    names = {"a": "Chair", "b": "Stool", "c": "Chair"}
    assert distinct_names(("a", "b", "c"), names.__getitem__) == ["Chair (a)", "Stool", "Chair (c)"]
    assert distinct_names((), names.__getitem__) == []
