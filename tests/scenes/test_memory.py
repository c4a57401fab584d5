"""Memory that nobody uses goes back to the operating system."""

import weakref

import pytest

from scenes.memory import give_back_memory


class Holder:
    """Holds itself, so that only the collector frees it."""

    def __init__(self) -> None:
        self.itself = self


def test_what_holds_only_itself_is_gone() -> None:
    held = weakref.ref(Holder())
    give_back_memory()
    assert held() is None


def test_a_library_without_trimming_is_no_error(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("ctypes.CDLL", lambda _name: object())
    give_back_memory()
