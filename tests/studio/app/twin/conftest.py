"""A bench with the desk's scan, and a history that undoes."""

from __future__ import annotations

import time

import pytest

from scenes.opening import open_scene
from studio.app.model.documents.document import Document
from studio.app.model.settings import Settings
from studio.app.model.workbench import Workbench


class PlainHistory:
    """Undo as the window has it, without Qt."""

    def __init__(self):
        self.changes, self.undone = [], []
        self.bench = None

    def push(self, change):
        merged = self.changes[-1].merged(change) if self.changes else None
        self.changes[-1:] = [merged] if merged else [*self.changes[-1:], change]

    def undo(self):
        self.undone.append(self.changes.pop())
        self.bench.show_document(self.undone[-1].before)

    def redo(self):
        self.changes.append(self.undone.pop())
        self.bench.show_document(self.changes[-1].after)

    def clear(self):
        self.changes.clear()


@pytest.fixture(scope="session")
def desk():
    return open_scene("desk")


@pytest.fixture
def bench(desk):
    made = Workbench(Document("desk"), Settings(), PlainHistory())
    made.history.bench = made
    made.show_scene(desk)
    return made


@pytest.fixture
def until():
    """The function `until(is_done, meanwhile)`: waits, bounded, and fails if it never is."""

    def wait(is_done, meanwhile=lambda: None, *, limit_s=120.0):
        end = time.monotonic() + limit_s
        while not is_done():
            assert time.monotonic() < end, "waited in vain"
            meanwhile()
            time.sleep(0.002)

    return wait
