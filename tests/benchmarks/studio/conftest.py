"""The window on the tiny room, as the window's own tests have it."""

from tests.studio.app.conftest import deleted, until
from tests.studio.app.shell.conftest import desk

__all__ = ("deleted", "desk", "until")
