"""One naming in all places: the user's, else the scan's, else the id."""

from dataclasses import replace

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


def test_of_two_that_are_called_the_same_each_has_its_id_beside_the_name():
    names = {"a": "Chair", "b": "Stool", "c": "Chair"}
    assert distinct_names(("a", "b", "c"), names.__getitem__) == ["Chair (a)", "Stool", "Chair (c)"]
    assert distinct_names((), names.__getitem__) == []
