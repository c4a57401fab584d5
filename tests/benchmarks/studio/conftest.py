"""The window on the tiny room, as the window's own tests have it."""

from tests.studio.app.conftest import deleted, until
from tests.studio.app.shell.conftest import desk
from tests.studio.conftest import no_display, no_traceback, tiny

__all__ = ("deleted", "desk", "no_display", "no_traceback", "tiny", "until")
