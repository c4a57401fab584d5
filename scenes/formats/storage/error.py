"""The one exception of every splat file reader, and the wording they share."""

from __future__ import annotations

from pathlib import Path


class FormatError(ValueError):
    """A splat file is truncated, damaged, foreign or of a kind that is not supported."""


def refusal(path: Path, where: str, what: str, remedy: str) -> FormatError:
    """One line that says which file, where in it, what is wrong and what to do.

    Args:
        path: the file.
        where: such as "byte 512" or "splat 17"; empty if the whole file is meant.
        what: what is wrong, with the value and the limit.
        remedy: what the reader of the line can do.
    """
    place = f", {where}" if where else ""
    return FormatError(f"{path}{place}: {what}; {remedy}")
