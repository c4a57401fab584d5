"""The tiny room of the studio's own tests."""

from tests.studio.conftest import no_display, no_traceback, tiny

__all__ = ("no_display", "no_traceback", "tiny")
