"""A verb of the command line: a line of its table."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Verb:
    """One verb of the command line.

    Attributes:
        name: words after `nexus`, such as "bench raster".
        module: has `add_arguments(parser)` and `run(args) -> int`; imported when the verb is used.
        summary: one line for the list of verbs.
        example: a command that works.
    """

    name: str
    module: str
    summary: str
    example: str
