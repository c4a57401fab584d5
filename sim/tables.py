"""Reads values out of a TOML table, checking each; every complaint names file, key and value."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, cast


class ScenarioError(ValueError):
    """A scenario is wrong; the message is one line: file, key, value, what is allowed."""


_REQUIRED: Any = object()


class Table:
    """One table of a file. Ask for every key it may have, then call `done`.

    Args:
        values: as parsed.
        source: the file, for messages.
        path: where in the file, such as "people[0]"; empty at the top.
    """

    def __init__(self, values: Mapping[str, Any], source: str, path: str) -> None:
        self._values = values
        self._source = source
        self._path = path
        self._asked: list[str] = []

    def error(self, key: str, value: Any, wanted: str) -> ScenarioError:
        """Return the error to raise when a value is wrong."""
        return ScenarioError(f"{self._source}: {self._key(key)} = {value!r}, wanted {wanted}")

    def done(self) -> None:
        """Refuse every key that nobody asked for.

        Raises:
            ScenarioError: there is one.
        """
        for key in self._values:
            if key not in self._asked:
                raise ScenarioError(
                    f"{self._source}: {self._key(key)}: no such key; wanted one of "
                    f"{', '.join(sorted(self._asked))}"
                )

    def text(self, key: str, default: str = _REQUIRED) -> str:
        """A non-empty string."""
        value = self._get(key, default, "a text")
        if not isinstance(value, str) or not value:
            raise self.error(key, value, "a text that is not empty")
        return value

    def number(self, key: str, default: float = _REQUIRED, *, low: float, high: float) -> float:
        """A finite number within `low..high`."""
        value = self._get(key, default, f"a number {low:g}..{high:g}")
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise self.error(key, value, f"a number {low:g}..{high:g}")
        if not (math.isfinite(value) and low <= value <= high):
            raise self.error(key, value, f"a number {low:g}..{high:g}")
        return float(value)

    def optional_number(self, key: str, low: float, high: float) -> float | None:
        """A number within `low..high`, or None where there is none."""
        self._asked.append(key)
        return self.number(key, low=low, high=high) if key in self._values else None

    def integer(self, key: str, default: int = _REQUIRED, *, low: int, high: int) -> int:
        """A whole number within `low..high`."""
        value = self._get(key, default, f"a whole number {low}..{high}")
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise self.error(key, value, f"a whole number {low}..{high}")
        return value

    def integers(self, key: str) -> tuple[int, ...]:
        """A list of whole numbers from 0; empty where there is none."""
        return tuple(
            self._item(key, item, isinstance(item, int) and item >= 0, "whole numbers from 0")
            for item in self._list(key)
        )

    def texts(self, key: str) -> tuple[str, ...]:
        """A list of non-empty strings; empty where there is none."""
        return tuple(
            self._item(key, item, isinstance(item, str) and bool(item), "texts that are not empty")
            for item in self._list(key)
        )

    def point(self, key: str) -> tuple[float, float]:
        """A place (x, y) in metres."""
        value = self._get(key, _REQUIRED, "[x, y] in metres")
        if not _are_numbers(value, 2):
            raise self.error(key, value, "[x, y] in metres")
        return float(value[0]), float(value[1])

    def optional_text(self, key: str) -> str | None:
        """A non-empty string, or None where there is none."""
        self._asked.append(key)
        return self.text(key) if key in self._values else None

    def optional_point(self, key: str) -> tuple[float, float] | None:
        """A place (x, y) in metres, or None where there is none."""
        self._asked.append(key)
        return self.point(key) if key in self._values else None

    def optional_point3(self, key: str) -> tuple[float, float, float] | None:
        """Three numbers, such as a place (x, y, z) in metres, or None where there are none."""
        self._asked.append(key)
        value = self._values.get(key)
        if value is None:
            return None
        if not _are_numbers(value, 3):
            raise self.error(key, value, "three numbers")
        return float(value[0]), float(value[1]), float(value[2])

    def points(self, key: str) -> tuple[tuple[float, float, float], ...]:
        """At least one place (x, y, z) in metres."""
        items = self._list(key)
        if not items:
            raise self.error(key, items, "at least one [x, y, z] in metres")
        for item in items:
            if not _are_numbers(item, 3):
                raise self.error(key, item, "a list of [x, y, z] in metres")
        return tuple((float(x), float(y), float(z)) for x, y, z in items)

    def table(self, key: str) -> Table:
        """A table inside this one; empty where there is none."""
        value = self._get(key, {}, "a table")
        if not isinstance(value, dict):
            raise self.error(key, value, "a table")
        return Table(cast(dict[str, Any], value), self._source, self._key(key))

    def tables(self, key: str) -> list[Table]:
        """A list of tables; empty where there is none."""
        tables: list[Table] = []
        for index, item in enumerate(self._list(key)):
            if not isinstance(item, dict):
                raise self.error(f"{key}[{index}]", item, "a table")
            values = cast(dict[str, Any], item)
            tables.append(Table(values, self._source, f"{self._key(key)}[{index}]"))
        return tables

    def table_or_tables(self, key: str) -> list[Table]:
        """A table or a list of tables; empty where there is neither."""
        self._asked.append(key)
        if isinstance(self._values.get(key), dict):
            return [self.table(key)]
        return self.tables(key)

    def _get(self, key: str, default: Any, wanted: str) -> Any:
        self._asked.append(key)
        if key in self._values:
            return self._values[key]
        if default is _REQUIRED:
            raise ScenarioError(f"{self._source}: {self._key(key)} is missing, wanted {wanted}")
        return default

    def _list(self, key: str) -> list[Any]:
        value = self._get(key, [], "a list")
        if not isinstance(value, list):
            raise self.error(key, value, "a list")
        return cast(list[Any], value)

    def _item(self, key: str, item: Any, fits: bool, wanted: str) -> Any:
        if not fits or isinstance(item, bool):
            raise self.error(key, item, wanted)
        return item

    def _key(self, key: str) -> str:
        return f"{self._path}.{key}" if self._path else key


def _are_numbers(value: Any, count: int) -> bool:
    if not isinstance(value, list):
        return False
    values = cast(list[Any], value)
    return len(values) == count and all(
        isinstance(v, int | float) and not isinstance(v, bool) and math.isfinite(v) for v in values
    )
