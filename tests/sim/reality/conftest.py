"""The scanned room of the tests, for those who stand for it."""

from tests.scanned_cell import scan

__all__ = ["scan"]
