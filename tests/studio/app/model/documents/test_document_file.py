import json
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from studio.app.model.documents.document import Document
from studio.app.model.documents.document_file import (
    DocumentError,
    document_from_text,
    document_to_text,
    load_document,
    save_document,
)
from tests.studio.app.model.strategies import documents


@given(documents)
@settings(max_examples=60, deadline=None)
def test_reads_back_what_it_writes(document):
    text = document_to_text(document)
    again = document_from_text(text, source="test")
    assert document_to_text(again) == text


@given(documents, st.data())
@settings(max_examples=60, deadline=None)
def test_a_damaged_file_is_refused_or_still_whole(document, data):
    text = document_to_text(document)
    place = data.draw(st.integers(0, len(text) - 1))
    damaged = text[:place] + data.draw(st.text(max_size=2)) + text[place + 1 :]
    with suppress(DocumentError):
        assert isinstance(document_from_text(damaged, source="room.nexus"), Document)


@pytest.mark.parametrize(
    ("change", "word"),
    [
        ({"version": 2}, "version 2"),
        ({"format": "other"}, "no project"),
        ({"seed": "x"}, "damaged"),
        ({"poses": {"chair": [[1, 0], [0, 1]]}}, "damaged"),
        ({"primitives": {"a": {"shape": "cone"}}}, "cone"),
        ({"meshes": {"a": {"data": "", "vertex_count": 10**9, "face_count": 1}}}, "limits"),
        ({"meshes": {"a": {"data": "AAAA", "vertex_count": 3, "face_count": 1}}}, "cannot be read"),
    ],
)
def test_says_what_is_wrong(change, word):
    values = {**json.loads(document_to_text(Document("lab"))), **change}
    with pytest.raises(DocumentError, match=word):
        document_from_text(json.dumps(values), source="room.nexus")


def test_a_failed_save_keeps_the_old_file(tmp_path, monkeypatch):
    path = tmp_path / "room.nexus"
    save_document(Document("lab"), path)

    def full(_descriptor):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("scenes.formats.storage.atomic.os.fsync", full)
    with pytest.raises(OSError, match="No space"):
        save_document(Document("desk"), path)
    assert load_document(path).scene == "lab"
    assert [entry.name for entry in tmp_path.iterdir()] == ["room.nexus"]


def test_a_project_of_before_there_were_drafts_and_trackers_opens():
    values = json.loads(document_to_text(Document("lab", seed=3)))
    del values["tracker"], values["draft"]
    document = document_from_text(json.dumps(values), source="room.nexus")
    assert (document.seed, document.draft, document.tracker) == (3, None, Document("lab").tracker)
