"""A JSON object whose long list is written item by item, so that no list is held in memory."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Literal

from scenes.pose import Pose

DECIMALS = 9
"""Digits after the point of a matrix: a nanometre."""


class JsonList:
    """Writes `{head..., "key": [item, item, ...]}`, one item a line. Use it in a `with`.

    Args:
        path: the file; its folder is there.
        head: what comes before the list.
        key: name of the list; without one the items are the file's own list or object.
        keyed: whether items have names, so that the list is an object.

    Attributes:
        tail: what is written behind the list at the end, as only its items tell it.
    """

    def __init__(
        self,
        path: Path,
        *,
        head: Mapping[str, Any] | None = None,
        key: str = "",
        keyed: bool = False,
    ) -> None:
        self.tail: Mapping[str, Any] = {}
        self._file = path.open("w", encoding="utf-8", newline="\n")
        self._keyed, self._first, self._nested = keyed, True, bool(key)
        if key:
            before = json.dumps(head or {}, indent=1)[:-1].rstrip()
            comma = "," if head else ""
            self._file.write(f"{before}{comma}\n{json.dumps(key)}: ")
        self._file.write("{" if keyed else "[")

    def add(self, item: Any, *, name: str = "") -> None:
        """Append an item, with its name if items have names."""
        self._file.write("\n" if self._first else ",\n")
        self._first = False
        if self._keyed:
            self._file.write(f"{json.dumps(name)}: ")
        self._file.write(json.dumps(item))

    def __enter__(self) -> JsonList:
        """The writer itself."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> Literal[False]:
        """Close the file, whole only if nothing went wrong."""
        with self._file:
            if kind is None:
                self._file.write("\n}" if self._keyed else "\n]")
                for name, value in self.tail.items():
                    self._file.write(f",\n{json.dumps(name)}: {json.dumps(value)}")
                self._file.write("\n}\n" if self._nested else "\n")
        return False


def write_json(path: Path, values: Any) -> None:
    """A small JSON file."""
    path.write_text(json.dumps(values, indent=1) + "\n", encoding="utf-8", newline="\n")


def matrix(a_from_b: Pose) -> list[list[float]]:
    """4 × 4 row-major rows of a pose, metres."""
    return [[round(float(v), DECIMALS) + 0.0 for v in row] for row in a_from_b.matrix()]
